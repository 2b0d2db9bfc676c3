"""A robot's components become one where their shapes prove it, and only there (paper, II)."""

import numpy as np
import pytest
from numpy.random import Generator

from mapweave import se2
from mapweave.arrays import FloatArray
from mapweave.assembly import place
from mapweave.fusion import FusionParameters
from mapweave.maps import LineMap, Submap, Trajectory
from mapweave.reunion import Reunion
from tests.mapweave.buildings import BUILDING, OTHER_BUILDING, part, random_pose, shaken

P = FusionParameters()


def submap(number: int, component: int, pose: FloatArray, lines: LineMap) -> Submap:
    """Return a submap of `lines`, given in the building's frame, with a frame at `pose` in it."""
    own = place(lines, se2.inverse(pose))
    return Submap(number, component, pose, own, Trajectory.empty())


@pytest.fixture
def parts(rng: Generator) -> list[LineMap]:
    spans = [(0, 12), (10, 20), (9, 19), (18, 30)]
    return [shaken(part(BUILDING, low, high), rng) for low, high in spans]


def test_a_component_that_shares_a_shape_with_an_older_one_joins_it(
    parts: list[LineMap], rng: Generator
) -> None:
    lost = random_pose(rng)  # of the building in the second component's frame
    submaps = [submap(k, 0, random_pose(rng), parts[k]) for k in (0, 1)]
    for k in (2, 3):
        pose = random_pose(rng)
        inside = submap(k, 1, pose, parts[k])
        submaps.append(Submap(k, 1, se2.compose(lost, pose), inside.map, inside.trajectory))
    joined, joints = Reunion(P).reunite(submaps)
    assert [s.component for s in joined] == [0, 0, 0, 0]
    assert [s.id for s in joined] == [0, 1, 2, 3]
    assert joints == [(1, 2)]  # of those nearest to each other: 10-20 m and 9-19 m
    for before, after in zip(submaps[:2], joined[:2], strict=True):
        np.testing.assert_array_equal(after.pose, before.pose)
    for before, after in zip(submaps[2:], joined[2:], strict=True):
        true = se2.compose(se2.inverse(lost), before.pose)
        off = se2.between(true, after.pose)
        # The frame's pose hangs on a lever of up to 30 m.
        assert np.hypot(off[0], off[1]) < 0.5 and abs(np.degrees(off[2])) < 1
        assert after.map is before.map  # a finished submap never changes, only its pose does


def test_a_component_of_another_place_stays_apart(parts: list[LineMap], rng: Generator) -> None:
    submaps = [
        submap(0, 0, random_pose(rng), parts[0]),
        submap(1, 1, random_pose(rng), part(OTHER_BUILDING, 0, 26)),
    ]
    assert Reunion(P).reunite(submaps) == (submaps, [])


def test_one_component_is_left_as_it_is(parts: list[LineMap]) -> None:
    submaps = [submap(0, 3, np.zeros(3), parts[0]), submap(1, 3, np.zeros(3), parts[1])]
    assert Reunion(P).reunite(submaps) == (submaps, [])


def test_no_submaps_are_no_components() -> None:
    assert Reunion(P).reunite([]) == ([], [])


def test_a_pair_that_was_refused_is_compared_again_when_it_has_grown(
    parts: list[LineMap], rng: Generator
) -> None:
    small = shaken(part(BUILDING, 10, 11), rng)
    reunion = Reunion(P)
    first, little = submap(0, 0, np.zeros(3), parts[0]), submap(1, 1, random_pose(rng), small)
    assert reunion.reunite([first, little]) == ([first, little], [])
    grown = submap(1, 1, little.pose, part(BUILDING, 4, 12))
    joined, joints = reunion.reunite([first, grown])
    assert joints == [(0, 1)]
    assert [s.component for s in joined] == [0, 0]


def test_a_pair_that_was_refused_is_not_compared_again_before_it_has_grown(
    parts: list[LineMap], rng: Generator
) -> None:
    """Each comparison takes as long as it takes; a robot with many components makes many."""
    elsewhere = part(OTHER_BUILDING, 0, 26)
    first, other = (
        submap(0, 0, np.zeros(3), parts[0]),
        submap(1, 1, random_pose(rng), elsewhere),
    )
    reunion = Reunion(P)
    assert reunion.reunite([first, other])[1] == []
    alike = submap(1, 1, other.pose, part(BUILDING, 4, 12))
    assert Reunion(P).reunite([first, alike])[1] == [(0, 1)]
    assert reunion.reunite([first, alike])[1] == []
