"""Maps that are bent are joined at the places that both saw, and the alignment says which."""

from collections.abc import Callable

import numpy as np
import pytest

from mapweave.evidence import Evidence
from mapweave.fusion.align import FusionParameters, align, compare, prepare
from mapweave.fusion.component import Component, Window
from mapweave.fusion.places import PlaceParameters, compare_at_places, located
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment, LineMap, RobotMap, SharedPlace, Submap, Trajectory
from mapweave.reasons import Reason, ReasonKind
from tests.mapweave.buildings import BUILDING, OTHER_BUILDING, corridor, line_map, part

F = FusionParameters()
P = F.places

LONG = corridor(
    60,
    [(1, 2, 4.0), (4, 10, 1.5), (17, 22, 2.0), (30, 32, 1.5), (40, 43, 2.5), (52, 53, 1.0)],
    [(3, 7, 3.2), (13, 16, 2.4), (25, 28, 3.0), (36, 37, 0.8), (46, 51, 1.2), (55, 58.5, 0.7)],
)
SLANTED = LONG + (LONG == (17.0, -2.0)).all(axis=1)[:, None] * (1.0, 0.0)  # no wing has it twice


def submap(number: int, lines: LineMap, length: float, pose: FloatArray) -> Submap:
    path = np.array([[0.0, 0, 0], [length, 0, 0]])
    trajectory = Trajectory(np.arange(2), np.full(2, np.nan), path)
    return Submap(number, 0, pose, lines, trajectory)


def robot(name: str, bend: float, outline: FloatArray = LONG) -> RobotMap:
    """Return the map of a long corridor in five submaps, each turned by `bend` [rad] more."""
    pose, submaps = np.zeros(3), []
    for k in range(5):
        lines = part(outline, 12 * k, 12 * k + 12)
        here = se2.inverse(np.array([12.0 * k, 0, 0]))
        own = line_map(
            se2.transform_segments(here, lines.segments),
            tuple(se2.transform_points(here, ring) for ring in lines.free_space),
        )
        submaps.append(submap(k, own, 12.0, pose))
        pose = se2.compose(pose, np.array([12.0, 0, bend]))
    return RobotMap(name, "boot", 1, tuple(submaps))


def off(place: SharedPlace) -> float:
    """[m] that a place is off: submaps of one number saw the same stretch of the corridor."""
    there = np.array([12.0 * (place.other - place.reference), 0.0])
    return float(np.hypot(*(place.transform[:2] - there)))


@pytest.mark.parametrize(("degrees", "least"), [(0.3, 0.2), (0.6, 0.6)])
def test_maps_bent_against_each_other_are_joined_and_right_at_each_place(
    degrees: float, least: float
) -> None:
    """As one rigid piece they are off by more at an end."""
    bent = np.radians(degrees)
    (found,) = align(robot("a", bent), robot("b", -bent))
    assert found.decision == "accepted"
    assert found.confidence >= F.decision.min_confidence
    assert max(map(off, found.places)) < 0.3
    ends = robot("b", -bent).lines(0).segments.reshape(-1, 2)[[0, -1]]
    there = robot("a", bent).lines(0).segments.reshape(-1, 2)[[0, -1]]
    rigid = np.hypot(*(se2.transform_points(found.transform, ends) - there).T)
    assert rigid.max() > least


def test_an_alignment_of_rigid_maps_says_where_it_holds() -> None:
    (found,) = align(robot("a", 0.0, SLANTED), robot("b", 0.0, SLANTED))
    assert found.decision == "accepted"
    assert found.evidence.parts is None
    apart = np.array([p.at for p in found.places])
    assert len(found.places) == 5
    assert np.ptp(apart[:, 0]) > 40
    assert max(map(off, found.places)) < 0.05
    assert found.evidence.place == found.confidence


@pytest.mark.parametrize(("one_place", "asked"), [(32.0, False), (15.0, True)])
def test_what_a_coarse_look_refuses_is_asked_about_places_where_the_smaller_map_has_several(
    one_place: float, asked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What lies about one place was compared as a whole already."""
    looked: list[bool] = []
    monkeypatch.setattr("mapweave.fusion.align.compare_at_places", lambda *_: looked.append(True))
    first, second = (
        RobotMap(name, "boot", 1, (submap(0, part(outline, 0, 20), 1.0, np.zeros(3)),))
        for name, outline in (("a", BUILDING), ("b", OTHER_BUILDING))
    )
    (found,) = align(first, second, FusionParameters(places=PlaceParameters(one_place=one_place)))
    assert found.decision == "refused" and looked == [True] * asked


def test_where_nothing_is_shared_no_place_is_named() -> None:
    (found,) = align(robot("a", 0.0), empty("b"))
    assert found.places == ()


def empty(name: str) -> RobotMap:
    lone = submap(0, LineMap.empty(), 1.0, np.zeros(3))
    return RobotMap(name, "boot", 1, (lone,))


def components(outline: FloatArray = LONG) -> tuple[Component, Component]:
    first, second = (
        Component(robot(name, 0.0, outline), 0, lambda lines: prepare(lines, F)) for name in "ab"
    )
    return first, second


def told(decide: Callable[[int], tuple[float, float]]) -> Alignment | None:
    """Compare at places where `decide` says of each what is found there: x [m], held [m].

    Nothing contradicts it: the corridor is plain.
    """
    first, second = components(corridor(60, [], []))
    count = iter(range(100))

    def look(ours: Window, theirs: Window) -> Alignment:
        x, held = decide(next(count))
        real = compare("a/0", ours.shape, "b/0", theirs.shape, F)
        evidence = Evidence(common=real.evidence.common, held=held)
        cause = Reason.words("so")
        return Alignment("a/0", "b/0", np.array([x, 0, 0]), "accepted", 0.95, cause, evidence)

    short = PlaceParameters(radius=8.0, apart=8.0, max_rival=0.4)
    return compare_at_places(first, second, None, short, look)


def test_places_that_agree_are_one_alignment_with_all_of_them() -> None:
    found = told(lambda k: (0.02 * k, 9.0))
    assert found is not None
    assert found.decision == "accepted"
    assert found.cause.kind is ReasonKind.PARTS_AGREE
    assert found.evidence.parts is not None
    assert min(found.evidence.parts, len(found.places)) >= 3
    assert found.evidence.spread is not None
    assert 0.02 <= found.evidence.spread < 0.2


def test_places_that_contradict_each_other_prove_nothing() -> None:
    """What is 3 m along a corridor is another place, and speaks for itself as much."""
    found = told(lambda k: (3.0 * (k % 2), 9.0))
    assert found is not None
    assert found.decision == "ambiguous"
    assert found.cause.kind is ReasonKind.RIVAL
    assert found.confidence < F.decision.min_confidence
    assert found.cause.numbers["distance"] == pytest.approx(3.0)


def test_what_may_slide_is_no_rival() -> None:
    found = told(lambda k: (3.0 * (k % 2), 9.0 if k % 2 == 0 else 0.1))
    assert found is not None
    assert found.decision == "accepted"


def test_the_place_with_the_most_wall_in_common_is_named_first() -> None:
    first, second = components()
    assert first.whole is not None
    assert second.whole is not None
    found = Alignment(
        "a/0", "b/0", np.zeros(3), "accepted", 0.9, Reason.words("so"), Evidence(common=9.0)
    )
    places = located(found, first.whole, second.whole, P).places
    lengths = {
        s.id: float(np.hypot(*(s.map.segments[:, 2:] - s.map.segments[:, :2]).T).sum())
        for s in first.submaps
    }
    assert [p.reference for p in places] == sorted(lengths, key=lambda k: -lengths[k])
    assert all(p.reference == p.other for p in places)
