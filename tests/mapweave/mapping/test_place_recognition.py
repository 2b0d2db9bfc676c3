"""A robot that comes to where another of its components is knows it, though both are bent."""

from dataclasses import replace

import numpy as np
import pytest

from mapweave.fusion.align import FusionParameters, compare, prepare
from mapweave.geometry import se2
from mapweave.mapping.component_merging import ComponentMerger, ComponentMergingParameters
from mapweave.mapping.place_recognition import (
    PlaceRecognitionParameters,
    PlaceRecognizer,
    RecognizedPlace,
)
from mapweave.maps import LineMap, Submap, Trajectory
from mapweave.matching.hypotheses import PreparedMap
from tests.mapweave.buildings import corridor, part

F = FusionParameters()
P = PlaceRecognitionParameters(submaps=2)
LONG = corridor(
    60,
    [(1, 2, 4.0), (4, 10, 1.5), (17, 22, 2.0), (30, 32, 1.5), (40, 43, 2.5), (52, 53, 1.0)],
    [(3, 7, 3.2), (13, 16, 2.4), (25, 28, 3.0), (36, 37, 0.8), (46, 51, 1.2), (55, 58.5, 0.7)],
)


def component(number: int, first: int, bend: float) -> list[Submap]:
    """Return the long corridor in five submaps, each turned by `bend` [rad] more than it is.

    A robot that was lost for as long as 90 scans may be anywhere in it.
    """
    pose, submaps = np.array([3.0, -7.0, 0.4 * number]), []
    for k in range(5):
        own = part(LONG, 12 * k, 12 * k + 12).moved(se2.inverse(np.array([12.0 * k, 0, 0])))
        scans = 100 * number + 2 * k + np.arange(2)
        path = Trajectory(scans, np.zeros(2), np.array([[0.0, 1, 0], [12.0, 1, 0]]))
        submaps.append(Submap(first + k, number, pose, own, path))
        pose = se2.compose(pose, np.array([12.0, 0, bend]))
    return submaps


OLDER, YOUNGER = component(0, 0, 0.02), component(1, 5, -0.02)


def lines_of(submaps: list[Submap], number: int) -> LineMap:
    return LineMap.union([s.map.moved(s.pose) for s in submaps if s.component == number])


def look(place_recognition: PlaceRecognizer, submaps: list[Submap]) -> RecognizedPlace | None:
    def shape_of(number: int) -> PreparedMap | None:
        return prepare(lines_of(submaps, number), F)

    newest = [s for s in submaps if s.component == submaps[-1].component]
    return place_recognition.look(submaps, newest, shape_of)


def test_these_components_cannot_be_joined_as_wholes() -> None:
    shapes = [prepare(lines_of([*OLDER, *YOUNGER], k), F) for k in (0, 1)]
    assert compare("a", shapes[0], "b", shapes[1], F).decision != "accepted"


def test_the_newest_part_is_recognised_when_it_is_found_twice_in_a_row() -> None:
    place_recognition = PlaceRecognizer(P, F)
    grown = [[*OLDER, *YOUNGER[:count]] for count in (2, 3, 4)]
    short, once, twice = (look(place_recognition, submaps) for submaps in grown)
    assert short is None and once is None
    assert twice is not None and twice.component == 0
    # Submaps 3 of both are the same stretch of the corridor.
    placed = se2.compose(twice.transform, YOUNGER[3].pose)
    off = se2.between(OLDER[3].pose, placed)
    assert np.hypot(off[0], off[1]) < 0.5 and abs(off[2]) < 0.05


def test_a_part_that_is_found_at_two_places_in_a_row_is_not_recognised() -> None:
    """As it is in a building where places look alike."""
    place_recognition = PlaceRecognizer(P, F)
    assert look(place_recognition, [*OLDER, *YOUNGER[:3]]) is None
    shift = np.array([5.0, 0.0, 0.0])
    moved = [replace(s, pose=se2.compose(shift, s.pose)) for s in YOUNGER[:4]]
    assert look(place_recognition, [*OLDER, *moved]) is None
    assert look(place_recognition, [*OLDER, *moved]) is not None


@pytest.mark.parametrize("count", [1, 2])
def test_a_short_component_is_compared_as_a_whole_and_nothing_is_looked_for_in_it(
    count: int,
) -> None:
    place_recognition = PlaceRecognizer(P, F)
    for grown in (3, 4, 5):
        assert look(place_recognition, [*OLDER[:count], *YOUNGER[:grown]]) is None


@pytest.mark.parametrize("first", [0, 1])
def test_the_robot_that_is_recognised_joins_the_older_component(first: int) -> None:
    """Be it in the younger or in the older of both: the linked submaps are of one place."""
    components = [[replace(s, component=k) for s in c] for k, c in enumerate((OLDER, YOUNGER))]
    here, there = components[first], components[1 - first]
    ids = iter(range(10))
    submaps = [replace(s, id=next(ids)) for s in [*there, *here]]
    component_merging = ComponentMerger(ComponentMergingParameters(place_recognition=P, growth=1e6))
    results = [component_merging.reunite(submaps[: 5 + count], tracked=count) for count in (4, 5)]
    assert [len(joints) for _, joints in results] == [0, 1]
    joined, [joint] = results[-1]
    assert {s.component for s in joined} == {0}
    assert sorted(joint) == [4, 9]
    off = se2.between(joined[4].pose, joined[9].pose)
    assert np.hypot(off[0], off[1]) < 0.5 and abs(off[2]) < 0.05
    of_older = [k for k, s in enumerate(submaps) if s.component == 0]
    assert all(joined[k].pose is submaps[k].pose for k in of_older)


def test_a_robot_is_not_recognised_where_it_cannot_have_come_to() -> None:
    """It was lost for one scan, and 57 m lie between the ends of both."""
    soon = [
        replace(s, trajectory=replace(s.trajectory, scan_index=s.trajectory.scan_index - 90))
        for s in YOUNGER
    ]
    merger = ComponentMerger(ComponentMergingParameters(place_recognition=P, growth=1e6))
    results = [merger.reunite([*OLDER, *soon[:count]], tracked=count) for count in (4, 5)]
    assert [len(joints) for _, joints in results] == [0, 0]
