"""A beam proves the space before its return to be free, and nothing else."""

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.scan.scan import Scan
from mapweave.scan.visibility import beams_through, clear_ranges, seen_through
from tests.mapweave.buildings import AROUND, FRONT, cast, random_pose, rectangle, walls_of

# The sensor stands at (1, 2) in a room 6 m by 4 m and looks along x: the wall ahead is 5 m away.
ROOM = walls_of(rectangle(0, 0, 6, 4))
SCAN = cast(ROOM, [1, 2, 0])


@pytest.mark.parametrize(
    ("point", "through"),
    [((4.6, 0), True), ((4.9, 0), False), ((5.1, 0), False), ((7, 0), False), ((0, 1.6), True),
     ((0, 1.9), False), ((0, 2.5), False), ((-0.5, 0), False)],
)  # fmt: skip
def test_points_well_before_a_wall_are_seen_through_and_others_are_not(
    point: tuple[float, float], through: bool
) -> None:
    """Before by more than the margin, 0.3 m; behind the wall, or behind the sensor: unknown."""
    assert seen_through(SCAN, np.array([point]), 0.3, 20.0).tolist() == [through]


def test_a_beam_that_did_not_come_back_proves_nothing_nor_do_its_neighbours() -> None:
    ranges = SCAN.ranges.copy()
    ranges[90] = np.nan  # straight ahead
    scan = Scan(ranges, SCAN.angles, 0, 0.0)
    points = np.column_stack([np.cos(FRONT), np.sin(FRONT)])  # all 1 m away
    through = seen_through(scan, points, 0.3, 20.0)
    assert np.flatnonzero(~through).tolist() == [89, 90, 91]


def test_beyond_its_sight_a_beam_proves_nothing() -> None:
    assert seen_through(SCAN, np.array([[2.9, 0.0]]), 0.0, 3.0).all()
    assert not seen_through(SCAN, np.array([[3.1, 0.0]]), 0.0, 3.0).any()


def test_a_margin_may_be_given_for_each_point() -> None:
    points = np.array([[4.5, 0.0], [4.5, 0.0]])
    assert seen_through(SCAN, points, np.array([0.4, 0.6]), 20.0).tolist() == [True, False]


def test_space_is_clear_as_far_as_a_beam_and_both_its_neighbours_reach() -> None:
    scan = Scan(np.array([3.0, 1.0, 4.0, 5.0, 6.0]), np.linspace(-1, 1, 5), 0, 0.0)
    np.testing.assert_array_equal(clear_ranges(scan, 5.5), [1.0, 1.0, 1.0, 4.0, 5.0])


@pytest.mark.parametrize("first", [-np.pi, 0.0, np.pi / 3])
@pytest.mark.parametrize("beams", [360, 361])
def test_it_does_not_matter_where_the_turn_of_a_lidar_begins(
    first: float, beams: int, rng: Generator
) -> None:
    """Beams all round, at 5 m: every point nearer is seen through, across the seam as well."""
    angles = first + np.radians(1.0) * np.arange(beams)
    scan = Scan(np.full(beams, 5.0), angles, 0, 0.0)
    bearing, distance = rng.uniform(-np.pi, np.pi, 200), rng.uniform(0.5, 4.9, 200)
    points = distance[:, None] * np.column_stack([np.cos(bearing), np.sin(bearing)])
    assert seen_through(scan, points, 0.0, 20.0).all()


def test_nothing_inside_a_room_is_seen_through_from_any_place_in_it_but_its_free_space(
    rng: Generator,
) -> None:
    """Brute force over places: what is seen through lies inside, the margin from every wall."""
    for _ in range(10):
        pose = np.array([*rng.uniform([0.5, 0.5], [5.5, 3.5]), rng.uniform(-np.pi, np.pi)])
        scan = cast(ROOM, pose, angles=AROUND)
        points = rng.uniform([-2, -2], [8, 6], (300, 2))
        through = seen_through(scan, se2.transform_points(se2.inverse(pose), points), 0.3, 20.0)
        inside = ((points > 0) & (points < [6, 4])).all(axis=1)
        deep = ((points > 0.5) & (points < [5.5, 3.5])).all(axis=1)
        assert not through[~inside].any()
        away = np.hypot(*(points - pose[:2]).T) > 0.3
        assert through[deep & away].mean() > 0.97  # all but the seam behind the sensor


def test_what_is_seen_through_does_not_depend_on_where_the_world_is(rng: Generator) -> None:
    moved = random_pose(rng)
    pose = np.array([1.0, 2.0, 0.4])
    points = rng.uniform(-5, 5, (100, 2))
    here = seen_through(cast(ROOM, pose), points, 0.3, 20.0)
    there = cast(se2.transform_segments(moved, ROOM), se2.compose(moved, pose))
    np.testing.assert_array_equal(here, seen_through(there, points, 0.3, 20.0))


def _surface(start: tuple[float, float], end: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """Points every 5 cm on a surface that shows its left side, in the frame of the sensor."""
    a, b = np.array(start), np.array(end)
    count = int(np.hypot(*(b - a)) / 0.05)
    along = (b - a) / np.hypot(*(b - a))
    points = a + np.linspace(0, 1, count)[:, None] * (b - a)
    return points, np.tile([-along[1], along[0]], (count, 1))


@pytest.mark.parametrize(
    ("start", "end", "through"),
    [((5, -1), (5, 1), False),  # the wall that is seen
     ((4, -1), (4, 1), True),
     ((4, 1), (4, -1), False),  # seen from behind
     ((4.5, 0.3), (2, 0.3), False),  # along the beams
     ((8, -1), (8, 1), False),  # behind what was hit
     ((-0.5, 1), (-0.5, -1), False)],  # beside all beams
)  # fmt: skip
def test_beams_go_through_a_known_wall_that_they_should_end_on(
    start: tuple[float, float], end: tuple[float, float], through: bool
) -> None:
    count = beams_through(SCAN, *_surface(start, end), 0.3, 20.0)
    assert count > 10 if through else count == 0


def test_what_a_beam_goes_through_to_end_on_a_known_wall_has_gone() -> None:
    wall, left = _surface((5, -1), (5, 1)), _surface((4, -0.5), (4, 0.5))
    points, normals = (np.concatenate(each) for each in zip(wall, left, strict=True))
    assert beams_through(SCAN, *left, 0.3, 20.0) > 10
    assert beams_through(SCAN, points, normals, 0.3, 20.0) == 0


def test_beams_prove_nothing_about_walls_far_away() -> None:
    assert beams_through(SCAN, *_surface((4, -1), (4, 1)), 0.3, 3.0) == 0
