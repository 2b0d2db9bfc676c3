"""Scan to directed segments (paper, V, first step)."""

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.scan.scan import Scan
from mapweave.scan.segmentation import SegmentationParameters, extract_segments, fit_segment
from tests.mapweave.buildings import AROUND, BUILDING, FRONT, cast, random_pose, rectangle, walls_of

ROOM = walls_of(rectangle(0, 0, 6, 4))


def cross_from_sensor(segments: FloatArray) -> FloatArray:
    """(n,) twice the area of sensor, start, end: positive where the sensor is on the left."""
    return np.asarray(segments[:, 0] * segments[:, 3] - segments[:, 1] * segments[:, 2])


def test_the_walls_of_a_room_ray_cast_by_hand_are_found_where_they_are() -> None:
    """Standing at (1, 2), looking along x: right wall's half, the wall ahead, the left wall's."""
    found = extract_segments(cast(ROOM, [1, 2, 0])).segments
    for x1, y1, x2, y2 in [[0, -2, 5, -2], [5, -2, 5, 2], [5, 2, 0, 2]]:
        along = np.array([x2 - x1, y2 - y1]) / np.hypot(x2 - x1, y2 - y1)
        ends = found.reshape(-1, 2, 2) - [x1, y1]
        on_it = (np.abs(ends @ [-along[1], along[0]]) < 0.015).all(axis=1)
        shares = ends[on_it] @ along
        assert (shares[:, 1] > shares[:, 0]).all()  # in the wall's direction
        # Nearly all of it: no beam ends just in a corner.
        assert np.diff(shares).sum() == pytest.approx(np.hypot(x2 - x1, y2 - y1), abs=0.12)


def test_all_segments_have_the_sensor_on_their_left(rng: Generator) -> None:
    for x in rng.uniform(0.5, 29.5, 20):
        pose = [x, rng.uniform(0.4, 1.8), rng.uniform(-np.pi, np.pi)]
        found = extract_segments(cast(walls_of(BUILDING), pose, angles=AROUND, noise=rng))
        assert len(found.segments) > 5
        assert (cross_from_sensor(found.segments) > 0).all()


def test_segments_come_in_the_order_of_the_beams(rng: Generator) -> None:
    found = extract_segments(cast(walls_of(BUILDING), [9, 1, 0.3], noise=rng)).segments
    middle = (found[:, :2] + found[:, 2:]) / 2
    assert (np.diff(np.arctan2(middle[:, 1], middle[:, 0])) > 0).all()


def test_returns_lie_within_tolerance_of_the_segment_they_are_labelled_with(rng: Generator) -> None:
    p = SegmentationParameters()
    scan = cast(walls_of(BUILDING), [13, 1, 0.3], angles=AROUND, noise=rng)
    found = extract_segments(scan)
    assert (found.label >= 0).mean() > 0.85
    for beam in np.flatnonzero(found.label >= 0):
        a, b = found.segments[found.label[beam]].reshape(2, 2)
        normal = np.array([a[1] - b[1], b[0] - a[0]]) / np.hypot(*(b - a))
        allowed = p.tolerance + p.relative_tolerance * scan.ranges[beam]
        assert abs(normal @ (scan.points[beam] - a)) < 1.5 * allowed


def test_where_the_world_is_changes_nothing(rng: Generator) -> None:
    walls, pose, moved = walls_of(BUILDING), np.array([13.0, 1.0, 0.3]), random_pose(rng)
    here = extract_segments(cast(walls, pose))
    there = extract_segments(cast(se2.transform_segments(moved, walls), se2.compose(moved, pose)))
    np.testing.assert_allclose(there.segments, here.segments, atol=1e-6)


def test_two_surfaces_one_behind_the_other_are_not_bridged() -> None:
    """A board 0.8 m before the wall: no segment leads from it to the wall."""
    board = walls_of(rectangle(4, 1.5, 4.2, 2.5)[::-1])
    found = extract_segments(cast(np.vstack([ROOM, board]), [1, 2, 0])).segments
    run = found[:, 2:] - found[:, :2]
    assert np.isclose(np.abs(run).min(axis=1) / np.hypot(*run.T), 0, atol=0.02).all()
    assert np.isclose(found[:, ::2], 3.0, atol=0.01).all(axis=1).sum() == 1


def test_beams_that_did_not_come_back_part_a_wall() -> None:
    scan = cast(ROOM, [1, 2, 0])
    ranges = scan.ranges.copy()
    ranges[80:101] = np.nan
    found = extract_segments(Scan(ranges, scan.angles, 0, 0.0))
    across = np.sort(np.arctan2(found.segments[:, 1::2], found.segments[:, ::2]))
    assert not ((across[:, 0] < 0) & (across[:, 1] > 0)).any()
    assert (found.label[80:101] == -1).all()


@pytest.mark.parametrize("ranges", [np.full(181, np.nan), np.where(np.arange(181) == 5, 1, np.nan)])
def test_a_scan_that_shows_nothing_has_no_segments(ranges: FloatArray) -> None:
    found = extract_segments(Scan(ranges, FRONT, 0, 0.0))
    assert found.segments.shape == (0, 4)
    assert (found.label == -1).all()


def test_returns_beyond_the_range_are_left_out() -> None:
    found = extract_segments(cast(ROOM, [1, 2, 0]), SegmentationParameters(max_range=4.0))
    assert np.hypot(*found.segments.reshape(-1, 2).T).max() < 4.05


def test_the_fit_is_the_line_of_least_squares_across(rng: Generator) -> None:
    """Brute force over directions: none has a smaller sum of squared distances."""
    points = np.column_stack([np.linspace(0, 3, 30), rng.normal(0, 0.05, 30)]) @ se2.rotation(1.1).T
    start, end = fit_segment(points).reshape(2, 2)
    assert (end - start) @ (points[-1] - points[0]) > 0
    centred = points - points.mean(axis=0)

    def spread(angle: float) -> float:
        return float(((centred @ [-np.sin(angle), np.cos(angle)]) ** 2).sum())

    fitted = spread(float(np.arctan2(*(end - start)[::-1])))
    assert fitted <= min(spread(a) for a in np.linspace(0, np.pi, 2000)) + 1e-9


@pytest.mark.parametrize("seed", range(20))
def test_a_wall_is_one_segment_however_its_returns_err(seed: int) -> None:
    """Noise of 1 cm, 4 cm at its ends: the chord between those would split it."""
    rng = np.random.default_rng(seed)
    wall = np.array([[3.0, -2.5, 3.0, 2.5]])
    scan = cast(wall, [0, 0, 0], noise=rng)
    hits = np.flatnonzero(scan.hits)
    ranges = scan.ranges.copy()
    ranges[hits[[0, -1]]] += rng.choice([-0.04, 0.04], 2)
    (found,) = extract_segments(Scan(ranges, scan.angles)).segments
    run = found[2:] - found[:2]
    assert np.hypot(*run) == pytest.approx(5, abs=0.25)
    assert abs(np.degrees(np.arctan2(run[0], run[1]))) < 0.5


def test_walls_that_meet_at_a_slight_angle_stay_two() -> None:
    """Ten degrees, 2 m each: 9 cm off one line in the middle, more than returns err."""
    bend = np.array([[3.0, -2.0, 3.0, 0.0], [3.0, 0.0, 3.0 - np.tan(np.radians(10)) * 2, 2.0]])
    found = extract_segments(cast(bend, [0, 0, 0])).segments
    turn = np.degrees(np.arctan2(found[:, 2] - found[:, 0], found[:, 3] - found[:, 1]))
    np.testing.assert_allclose(turn, [0, -10], atol=1)
