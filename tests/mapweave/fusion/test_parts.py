"""Parts of maps are found in each other where wholes are bent, and must agree."""

import numpy as np
import pytest

from mapweave.evidence import Evidence
from mapweave.fusion.align import FusionParameters, align
from mapweave.fusion.parts import PartParameters, agreed, cut
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment, LineMap, RobotMap, Submap, Trajectory
from mapweave.reasons import Reason, ReasonKind
from tests.mapweave.buildings import corridor, line_map, part

P = PartParameters()
LONG = corridor(
    60,
    [(1, 2, 4.0), (4, 10, 1.5), (17, 22, 2.0), (30, 32, 1.5), (40, 43, 2.5), (52, 53, 1.0)],
    [(3, 7, 3.2), (13, 16, 2.4), (25, 28, 3.0), (36, 37, 0.8), (46, 51, 1.2), (55, 58.5, 0.7)],
)


def submap(number: int, lines: LineMap, length: float, pose: FloatArray) -> Submap:
    path = np.array([[0.0, 0, 0], [length, 0, 0]])
    trajectory = Trajectory(np.arange(2), np.full(2, np.nan), path)
    return Submap(number, 0, pose, lines, trajectory)


def robot(name: str, bend: float) -> RobotMap:
    """Return the map of the long corridor in five submaps, each turned by `bend` [rad] more."""
    pose, submaps = np.zeros(3), []
    for k in range(5):
        lines = part(LONG, 12 * k, 12 * k + 12)
        here = se2.inverse(np.array([12.0 * k, 0, 0]))
        own = line_map(
            se2.transform_segments(here, lines.segments),
            tuple(se2.transform_points(here, ring) for ring in lines.free_space),
        )
        submaps.append(submap(k, own, 12.0, pose))
        pose = se2.compose(pose, np.array([12.0, 0, bend]))
    return RobotMap(name, "boot", 1, tuple(submaps))


def test_parts_are_consecutive_submaps_and_together_the_whole() -> None:
    whole = robot("a", 0.0)
    parts = cut(whole, 0, PartParameters(length=24.0))
    assert len(parts) == 3
    assert sum(len(lines.segments) for lines in parts) == sum(
        len(s.map.segments) for s in whole.submaps
    )
    assert all((np.ptp(lines.segments[:, 0]) < 26) for lines in parts)


def test_a_longer_path_has_longer_parts_and_not_more() -> None:
    assert len(cut(robot("a", 0.0), 0, PartParameters(length=6.0, count=2))) == 2
    assert len(cut(robot("a", 0.0), 0, PartParameters(length=100.0))) == 1


def test_maps_bent_against_each_other_are_joined_in_parts() -> None:
    bent = np.radians(0.5)
    parameters = FusionParameters(parts=PartParameters(length=24.0))
    (found,) = align(robot("a", bent), robot("b", -bent), parameters)
    assert found.decision == "accepted"
    assert found.cause.kind is ReasonKind.PARTS_AGREE
    numbers = found.evidence.by_name()
    assert numbers["parts"] >= 2
    assert numbers["spread"] <= P.distance
    assert {"place", "reach"} <= numbers.keys()  # judged for the wholes


def test_maps_that_are_rigid_are_joined_as_wholes() -> None:
    (found,) = align(robot("a", 0.0), robot("b", 0.0))
    assert found.decision == "accepted"
    assert found.evidence.parts is None


def alignment(x: float, turn: float, held: float) -> Alignment:
    transform = np.array([x, 0.0, turn])
    return Alignment(
        "a/0", "b/0", transform, "accepted", 0.9, Reason.words("so"), Evidence(held=held)
    )


@pytest.mark.parametrize(
    ("second", "agree"),
    [
        (alignment(0.5, 0.0, 9.0), True),
        (alignment(1.5, 0.0, 9.0), False),
        (alignment(0.0, 0.2, 9.0), False),
    ],
)
def test_parts_that_contradict_each_other_prove_nothing(second: Alignment, agree: bool) -> None:
    found = agreed([alignment(0.0, 0.0, 5.0), second], np.zeros((2, 2)), P)
    assert (found is not None) == agree
    if found is not None:
        assert found.transform is second.transform  # the better held


def test_one_part_alone_proves_nothing() -> None:
    assert agreed([alignment(0.0, 0.0, 5.0)], np.zeros((1, 2)), P) is None
    assert agreed([], np.empty((0, 2)), P) is None
