"""What the benchmark of many robots says was missed, late or grown."""

import subprocess
import sys
import time
from pathlib import Path

import pytest

from benchmarks.faults.crowd import Heard, delays, missed, took
from benchmarks.faults.usage import Figures, Usage
from mapweave_protocol.wire.messages import JointStatusMessage, MapVersion, StatusMessage


def said(robot: str, last: int, **held: int) -> StatusMessage:
    holds = tuple(MapVersion(robot=r, boot="x", version=v) for r, v in held.items())
    counts = dict.fromkeys(("scans_seen", "scans_placed", "components", "submaps"), 1)
    fields = {"robot": robot, "boot": "x", "stamp": 0.0, "state": "finished", **counts}
    return StatusMessage.model_validate({**fields, "map_version": last, "holds": holds})


def coordinated(**held: int) -> JointStatusMessage:
    maps = tuple(MapVersion(robot=r, boot="x", version=v) for r, v in held.items())
    return JointStatusMessage(boot="c", stamp=0, series="s", version=2, pending=False, maps=maps)


def heard(a: StatusMessage, b: StatusMessage, coordinator: JointStatusMessage) -> Heard:
    return Heard(
        maps={"a": {4: 10.0, 7: 11.5}},
        versions={1: 10.4, 2: 12.5},
        robots={"a": a, "b": b},
        coordinator=coordinator,
    )


def test_nothing_is_missed_where_all_hold_the_last_maps_and_every_version_came() -> None:
    whole = heard(said("a", 7, b=3), said("b", 3, a=7), coordinated(a=7, b=3))
    assert list(missed(whole, ("a", "b"), 2)) == []


def test_each_map_and_version_that_did_not_come_is_told() -> None:
    lacking = heard(said("a", 7, b=3), said("b", 3, a=4), coordinated(a=7))
    assert list(missed(lacking, ("a", "b"), 3)) == [
        "a: version 7 of its map, 4 at b",
        "b: version 3 of its map, None at the coordinator",
        "versions [3] of the joint map never heard",
    ]


def test_a_map_is_in_the_first_version_that_was_begun_after_it_came() -> None:
    both = heard(said("a", 7), said("b", 0), coordinated())
    assert delays(both, [10.1, 12.0]) == pytest.approx([0.4, 1.0])
    assert delays(both, [9.0, 10.1]) == pytest.approx([2.5]), "in none yet"


def test_how_long_versions_took_is_told_of_those_that_came() -> None:
    both = heard(said("a", 7), said("b", 0), coordinated())
    assert took(both, [10.1, 12.0, 13.0]) == pytest.approx([0.3, 0.5])


@pytest.mark.parametrize(
    ("half", "end", "grown"), [(100, 109, False), (200, 221, True), (9, 20, False)]
)
def test_memory_has_grown_when_it_is_more_by_a_share_and_by_more_than_nothing(
    half: float, end: float, grown: bool
) -> None:
    assert Figures("agent", half, end, 0.1).has_grown(0.1, 16.0) == grown


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes as Linux tells them")
def test_what_a_process_has_started_counts_with_it() -> None:
    child = "x = bytearray(64 * 2**20); print('made', flush=True); input()"
    code = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {child!r}])"
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", code], process_group=0, **pipes) as process:  # type: ignore[call-overload]
        process.stdout.readline()
        usage = Usage()
        for _ in range(2):
            usage.look({"one": process.pid})
            time.sleep(0.01)
        process.communicate(b"\n")
    [figures] = usage.figures()
    assert 64 < figures.end < 1000
