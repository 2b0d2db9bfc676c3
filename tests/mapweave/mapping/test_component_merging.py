"""A robot's components become one where what both saw proves it, and only there (paper, II)."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.fusion.align import FusionParameters
from mapweave.fusion.decision import Hypothesis, decide
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.component_merging import (
    ComponentMerger,
    ComponentMergingParameters,
    _covering,
)
from mapweave.mapping.localization.gaps import GapParameters
from mapweave.maps import Alignment, LineMap, Submap, Trajectory
from mapweave.matching.verification import Verdict
from mapweave.reasons import Reason
from tests.mapweave.buildings import BUILDING, OTHER_BUILDING, corridor, part, random_pose, shaken


def submap(number: int, component: int, pose: FloatArray, lines: LineMap) -> Submap:
    """Return a submap of `lines`, given in the building's frame, with a frame at `pose` in it."""
    own = lines.moved(se2.inverse(pose))
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
    joined, joints = ComponentMerger().reunite(submaps)
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


def test_what_two_components_share_is_rare_or_they_wait(parts: list[LineMap]) -> None:
    submaps = [submap(0, 0, se2.IDENTITY, parts[0]), submap(1, 1, se2.IDENTITY, parts[2])]
    submaps += [submap(2, 0, se2.IDENTITY, parts[1])]
    usual = ComponentMergingParameters()
    for rare, is_joined in ((usual.rare, True), (10_000.0, False)):
        asking = usual.model_copy(update={"rare": rare, "rare_there": rare})
        assert bool(ComponentMerger(asking).reunite(submaps)[1]) == is_joined


def test_a_component_of_another_place_stays_apart(parts: list[LineMap], rng: Generator) -> None:
    submaps = [
        submap(0, 0, random_pose(rng), parts[0]),
        submap(1, 1, random_pose(rng), part(OTHER_BUILDING, 0, 26)),
    ]
    assert ComponentMerger().reunite(submaps) == (submaps, [])


def test_one_component_is_left_as_it_is(parts: list[LineMap]) -> None:
    submaps = [submap(0, 3, np.zeros(3), parts[0]), submap(1, 3, np.zeros(3), parts[1])]
    assert ComponentMerger().reunite(submaps) == (submaps, [])


def test_no_submaps_are_no_components() -> None:
    assert ComponentMerger().reunite([]) == ([], [])


def test_a_pair_that_was_refused_is_compared_again_when_it_has_grown(
    parts: list[LineMap], rng: Generator
) -> None:
    small = shaken(part(BUILDING, 10, 11), rng)
    component_merging = ComponentMerger()
    first, little = submap(0, 0, np.zeros(3), parts[0]), submap(1, 1, random_pose(rng), small)
    assert component_merging.reunite([first, little]) == ([first, little], [])
    grown = submap(1, 1, little.pose, part(BUILDING, 4, 12))
    joined, joints = component_merging.reunite([first, grown])
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
    component_merging = ComponentMerger()
    assert component_merging.reunite([first, other])[1] == []
    alike = submap(1, 1, other.pose, part(BUILDING, 0, 26))
    assert ComponentMerger().reunite([first, alike])[1] == [(0, 1)]
    assert component_merging.reunite([first, alike])[1] == []


def test_a_pair_that_was_refused_is_compared_again_when_a_part_of_one_has_left_it(
    parts: list[LineMap], rng: Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a submap that was tracked to a wrong place, and contradicted the other component there."""
    compared: list[str] = []

    def refuse(*names: object, **_: object) -> Alignment:
        compared.append(str(names[0]))
        return Alignment("older", "younger", np.zeros(3), "refused", 0.0, Reason.words("so"))

    monkeypatch.setattr("mapweave.mapping.component_merging.compare", refuse)
    good, wrong = submap(0, 0, np.zeros(3), parts[0]), submap(1, 0, np.zeros(3), parts[1])
    other = submap(2, 1, random_pose(rng), part(OTHER_BUILDING, 0, 26))
    component_merging = ComponentMerger()
    for submaps, count in (
        ([good, wrong, other], 1),
        ([good, wrong, other], 1),
        ([good, replace(wrong, component=1), other], 2),
    ):
        component_merging.reunite(submaps)
        assert len(compared) == count


def test_however_many_components_there_are_few_are_compared_at_once_and_all_in_the_end(
    rng: Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A robot that is lost again and again does not pay for each piece with every scan."""
    compared: list[str] = []

    def refuse(*names: object, **_: object) -> Alignment:
        compared.append(str(names[0]))
        return Alignment("older", "younger", np.zeros(3), "refused", 0.0, Reason.words("so"))

    monkeypatch.setattr("mapweave.mapping.component_merging.compare", refuse)
    monkeypatch.setattr("mapweave.mapping.component_merging.between_them", lambda *_: np.empty(0))
    lines = part(OTHER_BUILDING, 0, 26)
    pieces = [submap(k, k, random_pose(rng), lines) for k in range(8)]
    component_merging = ComponentMerger()
    counts = []
    for _ in range(8):
        compared.clear()
        component_merging.reunite(pieces)
        counts.append(len(compared))
    most = ComponentMergingParameters().comparisons
    assert max(counts) == most and sum(counts) == 8 * 7 // 2 and counts[-1] == 0


def broken(parts: list[LineMap], gap: FloatArray) -> list[Submap]:
    """Return two submaps of one corridor; at the end of the first, track was lost.

    The robot then moved by `gap` (3,), and the second component begins there.
    """
    last = np.array([19.0, 1.0, 0.0])
    first = se2.compose(last, gap)
    path = np.array([[11.0, 1.0, 0.0], last])
    before = submap(0, 0, np.zeros(3), parts[0])
    after = submap(1, 1, first, parts[1])
    return [
        Submap(0, 0, before.pose, before.map, trajectory(path)),
        Submap(1, 1, np.zeros(3), after.map, trajectory(np.zeros((1, 3)), 2)),
    ]


def by_shape_alone() -> ComponentMerger:
    """Return one that looks nowhere in particular."""
    return ComponentMerger(ComponentMergingParameters(gaps=GapParameters(max_reach=0.01)))


def trajectory(pose: FloatArray, first: int = 0) -> Trajectory:
    """Return a path of scans whose numbers begin with `first`, a second apart."""
    number = first + np.arange(len(pose))
    return Trajectory(number, number.astype(float), pose, None)


# A corridor with the same two alcoves again 14 m farther on.
TWINS = corridor(
    60.0,
    [(x, x + w, d) for s in (0, 14) for x, w, d in ((s + 15.0, 1.5, 2.0), (s + 18.0, 3.0, 1.2))],
    [],
)


def test_a_robot_that_lost_track_is_looked_for_where_it_lost_it(rng: Generator) -> None:
    """Shapes alone leave two places open; the robot did not leap 14 m."""
    parts = [shaken(part(TWINS, 8, 40), rng), shaken(part(TWINS, 12, 22), rng)]
    submaps = broken(parts, np.array([0.8, 0.2, 0.3]))
    assert by_shape_alone().reunite(submaps)[1] == []
    joined, joints = ComponentMerger().reunite(submaps)
    assert joints == [(0, 1)]
    np.testing.assert_allclose(joined[1].pose, [19.86, 1.2, 0.3], atol=0.15)


def test_where_track_was_lost_less_proof_is_asked_for_than_anywhere(
    rng: Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A place that leads the next best by little counts there, and nowhere else."""
    asked: list[tuple[bool, float, float]] = []

    def refuse(
        a: str,
        _: object,
        b: str,
        __: object,
        p: FusionParameters,
        possible: object = None,
        *,
        closely: bool = False,
    ) -> Alignment:
        assert closely or possible is not None
        asked.append((possible is not None, p.decision.min_confidence, p.decision.min_lead))
        return Alignment(a, b, np.zeros(3), "ambiguous", 0.0, Reason.words("so"))

    monkeypatch.setattr("mapweave.mapping.component_merging.compare", refuse)
    parts = [shaken(part(TWINS, 8, 40), rng), shaken(part(TWINS, 12, 22), rng)]
    ComponentMerger().reunite(broken(parts, np.array([0.8, 0.2, 0.3])))
    (_, sure, lead), (there, sure_there, lead_there) = asked
    assert there and sure_there < sure and lead_there < lead


@pytest.mark.parametrize(("steps", "joint"), [(1, [(0, 2)]), (8, [])])
def test_what_was_seen_in_between_in_pieces_does_not_hide_where_track_was_lost(
    rng: Generator, steps: int, joint: list[tuple[int, int]]
) -> None:
    """A piece that nothing is known of: the robot came no farther than its path and two gaps."""
    parts = [shaken(part(TWINS, 8, 40), rng), shaken(part(TWINS, 12, 22), rng)]
    before, after = broken(parts, np.array([1.8, 0.2, 0.3]))
    path = np.outer(np.arange(2 * steps), [0.5, 0.0, 0.0])
    piece = Submap(1, 1, np.zeros(3), LineMap.empty(), trajectory(path, 2))
    end = trajectory(np.zeros((1, 3)), 2 + len(path))
    after = replace(after, id=2, component=2, trajectory=end)
    assert by_shape_alone().reunite([before, piece, after])[1] == []
    assert ComponentMerger().reunite([before, piece, after])[1] == joint


def test_a_robot_that_was_carried_away_is_not_believed_to_be_where_it_was(rng: Generator) -> None:
    """Where it was, its walls fit as well as at a third place; but it sees more that fits there."""
    longer = corridor(
        90.0,
        [(x, x + w, d) for s in (0, 14) for x, w, d in ((s + 15.0, 1.5, 2.0), (s + 18.0, 3.0, 1.2))]
        + [(x, x + w, d) for s in (44, 62) for x, w, d in ((s, 1.5, 2.0), (s + 3.0, 3.0, 1.2))],
        [(x, x + 2.0, 1.5) for x in (41.0, 53.0, 59.0, 71.0)],
    )
    known = shaken(part(longer, 8, 88), rng)
    seen = shaken(part(longer, 40, 56), rng)
    last, there = np.array([17.0, 1.0, 0.0]), np.array([46.0, 1.0, 0.0])
    before, after = submap(0, 0, np.zeros(3), known), submap(1, 1, there, seen)
    submaps = [
        Submap(0, 0, before.pose, before.map, trajectory(last[None])),
        Submap(1, 1, np.zeros(3), after.map, trajectory(np.zeros((1, 3)), 1)),
    ]
    assert by_shape_alone().reunite(submaps)[1] == []  # two places are like that
    assert ComponentMerger().reunite(submaps)[1] == []


def test_however_often_a_place_was_seen_comparing_it_costs_no_more(parts: list[LineMap]) -> None:
    p = ComponentMergingParameters()
    laps = [submap(k, 0, np.zeros(3), parts[k % 4]) for k in range(40)]
    covering = _covering(laps, p)
    assert len(covering) <= 4 * p.visits
    assert covering[-1] is laps[-1]
    assert {id(s.map.segments) for s in covering} >= {id(s.map.segments) for s in laps[-4:]}


def test_within_a_robots_map_straight_walls_join_nothing_however_well_held() -> None:
    """Nobody undoes such a join, so a shape is asked for; two robots are joined by the same."""
    verdict = Verdict(60.0, 0.0, 1.0, 0.02, 50.0, 5.0)
    straight = Hypothesis(np.zeros(3), np.zeros(2), verdict, 0.0, 500.0)
    within, between = ComponentMergingParameters().fusion.decision, FusionParameters().decision
    assert decide(straight, None, 0.99, within)[0] == "ambiguous"
    assert decide(straight, None, 0.99, between)[0] == "accepted"


def carried_off(rng: Generator, seen: float) -> list[Submap]:
    """Return a long corridor as it was mapped, and the end of it, `seen` so far [m].

    The robot was at 4 m when it lost track, and a second later it was at 22 m.
    """
    known, after = shaken(part(BUILDING, 0, 30), rng), part(BUILDING, 30 - seen, 30)
    before = Submap(0, 0, np.zeros(3), known, trajectory(np.array([[4.0, 1.0, 0.0]])))
    later = submap(1, 1, np.array([22.0, 1.0, 0.0]), after)
    there = trajectory(np.zeros((1, 3)), 1)
    return [before, Submap(1, 1, np.zeros(3), later.map, there)]


def test_a_join_by_which_the_robot_leaped_is_held_until_what_it_saw_since_agrees(
    rng: Generator,
) -> None:
    """In a building that repeats itself, a look-alike is likelier than that it was carried off."""
    merger = ComponentMerger()
    little, more = carried_off(rng, 12.0), carried_off(rng, 30.0)
    assert merger.reunite(little)[1] == []
    assert merger.reunite(little)[1] == []  # nothing new agrees
    joined, joints = merger.reunite(more)
    assert joints == [(0, 1)]
    np.testing.assert_allclose(joined[1].pose, [22.0, 1.0, 0.0], atol=0.2)


def test_from_one_run_to_another_a_robot_may_be_taken_anywhere(rng: Generator) -> None:
    submaps = carried_off(rng, 12.0)
    assert ComponentMerger(known=1).reunite(submaps)[1] == [(0, 1)]
