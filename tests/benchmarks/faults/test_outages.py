"""What is missing after an outage that ends when the robots are parked: nothing."""

from pathlib import Path

import pytest

from benchmarks.faults.outages import Outage, Said, There, missing, try_out
from mapweave_protocol.wire.messages import JointStatusMessage, MapVersion

SEEDS = {
    1: "severed",  # the coordinator's link
    14: "router",
    32: "silent",  # a robot's
}


@pytest.mark.slow  # five seconds decide, which a machine with much else to do may exceed
@pytest.mark.parametrize("seed", sorted(SEEDS))
def test_nothing_is_missing_after_an_outage(seed: int, tmp_path: Path) -> None:
    outage, lacks = try_out(seed, tmp_path)
    assert outage.how == SEEDS[seed]
    assert lacks == []


def test_the_same_seed_is_the_same_outage() -> None:
    assert Outage.drawn(7) == Outage.drawn(7) != Outage.drawn(8)


def test_what_is_missing_is_named() -> None:
    a, b = (MapVersion(robot=robot, boot="x", version=2) for robot in "ab")
    older = a.model_copy(update={"version": 1})
    status = JointStatusMessage(
        boot="c", stamp=0.0, series="s", version=3, pending=False, maps=(older, b),
        alignments=((older, b),),
    )  # fmt: skip
    there = There(maps=(a, b), alignments=((a, b),), version=3)
    assert list(missing(there, Said(coordinator=status), [1, 2])) == [
        "map of a at the coordinator",
        "alignment at the coordinator",
        "versions 3 to 3 at the subscriber",
    ]
