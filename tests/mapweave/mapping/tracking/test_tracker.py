"""Each scan is found from what was seen lately, or not placed at all."""

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.tracking.acceptance import ScanMatch
from mapweave.mapping.tracking.local_map import ScanEvidence
from mapweave.mapping.tracking.observation import Observation, ObservationParameters, observe
from mapweave.mapping.tracking.tracker import Tracker, TrackerParameters
from mapweave.maps import LineMap
from mapweave.scan.points import OrientedPoints, points_on_lines
from mapweave.scan.scan import Scan
from mapweave.scan.segmentation import ScanSegments
from mapweave.shape.correspondence import Correspondence
from tests.mapweave.buildings import (
    AROUND,
    BUILDING,
    FRONT,
    OTHER_BUILDING,
    cast,
    corridor,
    line_map,
    scans_along,
    walls_of,
)

WALLS = walls_of(BUILDING)


def observed(scan: Scan) -> Observation:
    return observe(scan, ObservationParameters())


def placed(tracker: Tracker, scan: Scan) -> ScanMatch | None:
    """Return what became of `scan` at once; None where it is missed or on probation."""
    seen = observed(scan)
    found = tracker.place(seen, LineMap.empty)
    return next((tracked for each, tracked in found if each is seen), None)


def tracked_along(tracker: Tracker, scans: list[Scan]) -> list[ScanMatch | None]:
    return [placed(tracker, scan) for scan in scans]


def errors(found: list[ScanMatch | None], true: FloatArray) -> FloatArray:
    """(n, 3) of poses in the first one's frame; NaN where none was found."""
    there = se2.between(true[0], true)
    poses = np.array([np.full(3, np.nan) if t is None else t.pose for t in found])
    return se2.between(there, poses)


def test_the_first_scan_defines_the_frame() -> None:
    tracker = Tracker()
    first = placed(tracker, cast(WALLS, [9, 1, 0.3]))
    assert first is not None
    np.testing.assert_array_equal(first.pose, np.zeros(3))
    assert first.evidence.score == 1.0


def test_a_walk_is_followed() -> None:
    scans, true = scans_along(BUILDING, [(3, 1), (13, 1), (13, -3)], 1)
    off = errors(tracked_along(Tracker(), scans), true)
    assert np.hypot(*off[:, :2].T).max() < 0.15
    assert np.degrees(np.abs(off[:, 2])).max() < 1


def test_a_sudden_turn_on_the_spot_is_followed(rng: Generator) -> None:
    """More than any motion model expects: shapes and the search over all turns find it."""
    true = np.array([[13, 1, a] for a in (0.0, 0.1, 0.2, 1.6, 1.7)])
    scans = [cast(WALLS, pose, index=k, noise=rng) for k, pose in enumerate(true)]
    # Before, it looked around: what it will see is known.
    around = [cast(WALLS, [13, 1, a], noise=rng) for a in np.linspace(0, 2 * np.pi, 13)]
    tracker = Tracker()
    tracked_along(tracker, around)
    off = errors(tracked_along(tracker, scans), true)
    assert np.hypot(*off[:, :2].T).max() < 0.1
    assert np.degrees(np.abs(off[:, 2])).max() < 1


@pytest.mark.parametrize(
    ("start", "leap"),
    [
        ([13, 1, 0], [0.2, -2.4, -2.5]),
        ([13, 1, 0], [-2.4, 0.0, 3.1]),
        ([13, 1, 0], [2.4, 0.0, -1.6]),
        ([24, 1, 0], [0.0, -2.4, -1.6]),
    ],
)
def test_a_leap_farther_than_the_search_reaches_is_found_by_the_shapes_of_the_map(
    start: list[float], leap: list[float], rng: Generator
) -> None:
    """As when scans were lost: 2.4 m and a turn; without polylines to compare it is not found."""
    around = [cast(WALLS, [*start[:2], a], noise=rng) for a in np.linspace(0, 2 * np.pi, 13)]
    leapt = observed(cast(WALLS, np.add(start, leap), noise=rng))
    known = line_map(se2.transform_segments(se2.inverse(start), WALLS))
    narrow = Tracker(TrackerParameters(widest=1.2))
    with_shapes, without = (narrow.afresh(trusting=True) for _ in range(2))
    for tracker in (with_shapes, without):
        tracked_along(tracker, around)
    [(_, tracked)] = with_shapes.place(leapt, lambda: known)
    assert without.place(leapt, LineMap.empty) == []
    off = se2.between(se2.between(start, np.add(start, leap)), tracked.pose)
    assert np.hypot(off[0], off[1]) < 0.1 and abs(off[2]) < 0.02


@pytest.mark.parametrize(("leap", "placed_again"), [(2.2, True), (3.4, False)])
def test_a_leap_farther_than_a_robot_can_have_got_is_not_believed(
    leap: float, placed_again: bool, rng: Generator
) -> None:
    """However well it fits the known map: scans are tracked over 2.5 m at the most."""
    start = np.array([13.0, 1.0, 0.0])
    known = line_map(se2.transform_segments(se2.inverse(start), WALLS))
    tracker = Tracker()
    around = [cast(WALLS, [*start[:2], a], noise=rng) for a in np.linspace(0, 2 * np.pi, 13)]
    tracked_along(tracker, around)
    leapt = observed(cast(WALLS, start - [0.0, leap, 1.6], noise=rng))
    assert bool(tracker.place(leapt, lambda: known)) == placed_again


def test_what_shapes_propose_is_aligned_to_corresponding_polylines_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A piece of another polyline lies nearer than the true wall; it must not pull (paper, V)."""
    corner = np.array([[0.0, 0, 4, 0], [4, 0, 4, 3]])
    pier = np.array([[7.0, 0, 8, 0], [8, 0, 8, 1]])
    decoy = np.array([[0.0, 0.25, 4, 0.25]])
    known = LineMap(np.vstack([corner, pier, decoy]), np.array([0, 0, 1, 1, 1]), np.full(5, 9))
    lines = LineMap(np.vstack([corner, pier]), np.array([0, 0, 1, 1]), np.ones(4, dtype=np.int64))
    on_polylines, segment = points_on_lines(lines, 0.1)
    oriented = OrientedPoints(on_polylines.points, on_polylines.normals, segment)
    scan = cast(WALLS, [9, 1, 0])
    found = ScanSegments(lines.segments, np.full(len(scan.ranges), -1))
    fixed = np.zeros(len(oriented), dtype=np.bool_)
    seen = Observation(scan, found, oriented, oriented, fixed, 0.5)
    np.testing.assert_array_equal(seen.lines.segments, lines.segments)
    near = Correspondence(np.array([0.0, 0.2, 0.0]), np.eye(2, dtype=np.bool_))
    monkeypatch.setattr("mapweave.mapping.tracking.shape_starts.correspond", lambda *_: [near])
    [start] = Tracker()._shape_starts(seen, known)
    np.testing.assert_allclose(start, 0.0, atol=0.01)


def test_a_scan_of_another_place_is_not_placed(rng: Generator) -> None:
    scans, _ = scans_along(BUILDING, [(3, 1), (9, 1)], 1)
    tracker = Tracker()
    tracked_along(tracker, scans)
    before = tracker.pose
    elsewhere = cast(walls_of(OTHER_BUILDING), [9, -3, 0.5], noise=rng)
    assert placed(tracker, elsewhere) is None
    np.testing.assert_array_equal(tracker.pose, before)


@pytest.mark.parametrize("seen", [0, 15])
def test_a_scan_that_shows_too_little_is_blind_and_not_placed(seen: int) -> None:
    ranges = np.where(np.arange(len(FRONT)) < seen, 2.0, np.nan)
    blind = Scan(ranges, FRONT, 0, 0.0)
    tracker = Tracker()
    assert tracker.is_blind(observed(blind))
    assert placed(tracker, blind) is None
    sighted = placed(tracker, cast(WALLS, [9, 1, 0]))
    assert sighted is not None and (sighted.pose == 0).all()  # the blind one left no trace


def test_in_a_bare_corridor_the_information_along_it_is_nearly_nil(rng: Generator) -> None:
    bare = walls_of(corridor(80, [], []))
    tracker = Tracker()
    true = np.array([[x, 1.1, 0.0] for x in np.arange(30, 32, 0.3)])
    found = tracked_along(tracker, [cast(bare, pose, noise=rng) for pose in true])
    assert found[-1] is not None
    information = found[-1].information
    assert information[0, 0] < 0.02 * information[1, 1]


def test_evidence_counts_for_and_against() -> None:
    """Walls seen before explain a scan; a wall that went through free space is held against it."""
    tracker = Tracker().afresh(trusting=True)
    tracked_along(tracker, [cast(WALLS, [9, 1.0, 0]), cast(WALLS, [9.4, 1.0, 0])])
    again = placed(tracker, cast(WALLS, [9.2, 1.0, 0]))
    assert again is not None
    assert again.evidence.explained > 0.95
    assert again.evidence.contradicted == pytest.approx(0, abs=0.01)
    box = np.array([[11.0, 1.4, 11, 0.6]])  # faces the robot, in the middle of the corridor
    blocked = placed(tracker, cast(np.vstack([WALLS, box]), [9.2, 1, 0]))
    assert blocked is not None
    assert blocked.evidence.contradicted > 0.05
    assert blocked.evidence.score < again.evidence.score - 0.05


@pytest.mark.parametrize("half", [0.1, 0.3, 0.45])
def test_what_stands_free_and_is_short_may_have_come_since(half: float) -> None:
    person = np.array([[11.0, 1 + half, 11, 1 - half]])
    tracker = Tracker().afresh(trusting=True)
    tracked_along(tracker, [cast(WALLS, [9, 1.0, 0]), cast(WALLS, [9.4, 1.0, 0])])
    found = placed(tracker, cast(np.vstack([WALLS, person]), [9.2, 1, 0]))
    assert found is not None
    assert found.evidence.excused == found.evidence.contradicted > 0
    assert found.evidence.without_excused.contradicted == 0
    assert found.evidence.without_excused.score > max(0.9, found.evidence.score)


def test_a_wall_that_the_scan_sees_through_speaks_against_its_pose() -> None:
    """A box in the corridor, seen twice, is gone: what was known there is seen through."""
    box = np.array([[11.0, 1.3, 11, 0.7]])  # faces the robot
    tracker = Tracker().afresh(trusting=True)
    there = [cast(np.vstack([WALLS, box]), [x, 1.0, 0]) for x in (9.0, 9.4)]
    tracked_along(tracker, there)
    gone = placed(tracker, cast(WALLS, [9.2, 1.0, 0]))
    assert gone is not None
    assert gone.evidence.seen_through > 0.02
    seen_again = placed(tracker, there[1])
    assert seen_again is not None
    assert seen_again.evidence.seen_through == pytest.approx(0, abs=0.01)


def test_an_older_scan_is_placed_without_moving_the_track(rng: Generator) -> None:
    scans, true = scans_along(BUILDING, [(3, 1), (9, 1)], 1)
    tracker = Tracker()
    tracked_along(tracker, scans)
    before = tracker.pose
    place = np.array([5.0, 1.2, 0.4])
    older = cast(WALLS, place, noise=rng)
    near = se2.between(true[0], se2.compose(place, [0.4, -0.3, 0.3]))
    found = tracker.revisit(observed(older), near, 1.2)
    assert found is not None
    off = se2.between(se2.between(true[0], place), found.pose)
    assert np.hypot(off[0], off[1]) < 0.1 and abs(off[2]) < 0.02
    np.testing.assert_array_equal(tracker.pose, before)


def passer_by(pose: list[float], rng: Generator) -> Scan:
    """Return a scan in which somebody stands close before the robot and hides most of it."""
    scan = cast(WALLS, pose, noise=rng)
    near = np.where(np.abs(FRONT) < np.radians(60), 0.6, scan.ranges)
    return Scan(near, FRONT, 0, 0.0)


def test_a_scan_that_people_hide_costs_neither_it_nor_the_way_on(rng: Generator) -> None:
    """The next ones fit where the robot went meanwhile; two of them are believed."""
    way = [[x, 1.0, 0.0] for x in np.arange(4, 11, 0.5)]
    tracker = Tracker()
    tracked_along(tracker, [cast(WALLS, pose, noise=rng) for pose in way[:10]])
    assert placed(tracker, passer_by(way[10], rng)) is None
    on_probation = cast(WALLS, way[11], noise=rng)
    assert tracker.place(observed(on_probation), LineMap.empty) == []
    found = tracker.place(observed(cast(WALLS, way[12], noise=rng)), LineMap.empty)
    assert len(found) >= 2  # it, the one before, and the hidden one where that can be made out
    np.testing.assert_allclose(tracker.pose[:2], [way[12][0] - way[0][0], 0], atol=0.1)


def test_a_missed_scan_is_placed_when_those_after_it_have_shown_what_it_saw(
    rng: Generator,
) -> None:
    """Round a corner into a room nobody had looked into, and back to where both are in sight."""
    way = [[x, 1.0, 0.0] for x in np.arange(6, 12.6, 0.5)]
    tracker = Tracker(TrackerParameters(widest=1.2))
    tracked_along(tracker, [cast(WALLS, pose, noise=rng) for pose in way])
    inside = np.array([12.5, -1.0, -np.pi / 2])
    missed = observed(cast(WALLS, inside, noise=rng, angles=FRONT[45:136]))
    assert tracker.place(missed, LineMap.empty) == []
    found = [
        pair
        for x in (12.8, 13.0)
        for pair in tracker.place(
            observed(cast(WALLS, [x, 0.2, -0.8], noise=rng, angles=AROUND)), LineMap.empty
        )
    ]
    [pose] = [tracked.pose for seen, tracked in found if seen is missed]
    off = se2.between(se2.between(np.array(way[0]), inside), pose)
    assert np.hypot(off[0], off[1]) < 0.1 and abs(off[2]) < 0.02
    assert tracker.missed == []


def test_a_scan_on_probation_that_the_next_one_does_not_confirm_leaves_no_trace(
    rng: Generator,
) -> None:
    way = [[x, 1.0, 0.0] for x in np.arange(4, 11, 0.5)]
    tracker = Tracker()
    tracked_along(tracker, [cast(WALLS, pose, noise=rng) for pose in way[:10]])
    before = tracker.pose
    away = [cast(walls_of(OTHER_BUILDING), [9, -3, 0.5], noise=rng) for _ in range(2)]
    assert placed(tracker, away[0]) is None
    assert tracker.place(observed(cast(WALLS, way[11], noise=rng)), LineMap.empty) == []
    assert placed(tracker, away[1]) is None
    assert len(tracker.missed) == 3
    np.testing.assert_array_equal(tracker.pose, before)


def test_at_the_end_the_scan_on_probation_is_believed(rng: Generator) -> None:
    way = [[x, 1.0, 0.0] for x in np.arange(4, 11, 0.5)]
    tracker = Tracker()
    tracked_along(tracker, [cast(WALLS, pose, noise=rng) for pose in way[:10]])
    placed(tracker, passer_by(way[10], rng))
    last = observed(cast(WALLS, way[11], noise=rng))
    assert tracker.place(last, LineMap.empty) == []
    assert any(seen is last for seen, _ in tracker.settle())
    assert tracker.settle() == []


def test_a_robot_that_lost_track_moves_as_it_did(rng: Generator) -> None:
    """Where the walls are bare, what it is expected to do decides; it need not learn that again."""
    bare = walls_of(corridor(80, [], []))
    tracker = Tracker()
    tracked_along(tracker, [cast(WALLS, [x, 1.0, 0.0], noise=rng) for x in np.arange(4, 11, 0.5)])
    anew = tracker.afresh()
    scans = [cast(bare, [x, 1.1, 0.0], noise=rng) for x in np.arange(30, 33, 0.5)]
    found = tracked_along(anew, scans)
    assert found[0] is not None and (found[0].pose == 0).all()
    assert found[-1] is not None
    assert abs(found[-1].pose[0] - 2.5) < 0.3


@pytest.mark.parametrize(("better", "placed_again"), [(0.6, True), (0.9, False)])
def test_after_a_miss_no_other_pose_may_be_worth_more(
    better: float, placed_again: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One along a bare wall that nothing holds, say: then neither is believed."""
    tracker, scan = Tracker(), cast(WALLS, [9, 1, 0.3])
    placed(tracker, scan)
    seen = observed(scan)
    tracker.missed.append(seen)
    held, loose = np.diag([30.0, 6.0, 50.0]), np.diag([30.0, 0.2, 50.0])
    candidates = [
        ScanMatch(np.array([0.3, 0.0, 0.0]), ScanEvidence(0.8, 0.0, 0.0), held),
        ScanMatch(np.array([1.2, 0.0, 0.0]), ScanEvidence(better, 0.0, 0.0), loose),
    ]
    monkeypatch.setattr(Tracker, "_aligned", lambda *_: candidates)
    tracker.place(seen, LineMap.empty)
    assert bool(tracker.settle()) == placed_again
