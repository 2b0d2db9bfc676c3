"""Ends of walls meet where their lines cross, and only where nothing was seen through."""

import numpy as np
import pytest
from numpy.random import Generator
from shapely.geometry import Polygon, box
from shapely.geometry.base import BaseGeometry

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.lines.collinear_junctions import StraighteningParameters, straighten
from mapweave.lines.corner_junctions import JoiningParameters, join_corners
from tests.mapweave.buildings import BUILDING, random_pose, walls_of

NOTHING = Polygon()


def joined(segments: list[list[float]], free: BaseGeometry = NOTHING) -> FloatArray:
    return join_corners(np.array(segments, dtype=float), free, JoiningParameters())


def straight(segments: list[list[float]], free: BaseGeometry = NOTHING) -> FloatArray:
    return straighten(np.array(segments, dtype=float), free, StraighteningParameters())


@pytest.mark.parametrize("gap", [-0.1, -0.03, 0.0, 0.05, 0.25])
def test_walls_that_stop_short_of_a_corner_or_go_beyond_meet_in_it(gap: float) -> None:
    found = joined([[0, 0, 3 - gap, 0], [3, gap, 3, 4]])
    np.testing.assert_allclose(found, [[0, 0, 3, 0], [3, 0, 3, 4]], atol=1e-12)


def test_walls_half_a_metre_from_their_corner_stay_as_seen() -> None:
    walls: list[list[float]] = [[0, 0, 2.5, 0], [3.0, 0.4, 3, 4]]
    np.testing.assert_array_equal(joined(walls), walls)


def test_no_wall_grows_across_space_that_was_seen_through() -> None:
    walls: list[list[float]] = [[0, 0, 2.75, 0], [3.0, 0.25, 3, 4]]
    open_ = box(2.7, -1, 2.98, 1)
    np.testing.assert_array_equal(joined(walls, open_), walls)
    np.testing.assert_allclose(joined(walls)[0, 2:], [3, 0], atol=1e-12)


def test_an_end_meets_a_start_and_never_another_end() -> None:
    """Two ends together would be two walls whose visible sides do not go on in each other."""
    walls: list[list[float]] = [[0, 0, 2.9, 0], [3, 4, 3, 0.1]]
    np.testing.assert_array_equal(joined(walls), walls)


def test_each_end_meets_one_other_the_nearest() -> None:
    found = joined([[0, 0, 2.98, 0], [3, 0.02, 3, 4], [3.2, 0.1, 3.2, 4]])
    np.testing.assert_allclose(found[:2], [[0, 0, 3, 0], [3, 0, 3, 4]], atol=1e-12)
    np.testing.assert_array_equal(found[2], [3.2, 0.1, 3.2, 4])


def test_a_building_seen_a_little_off_is_one_closed_outline_again(rng: Generator) -> None:
    walls = walls_of(BUILDING)
    for motion in (np.zeros(3), random_pose(rng)):
        off = se2.transform_segments(motion, walls + rng.normal(0, 0.01, walls.shape))
        found = join_corners(off, NOTHING, JoiningParameters())
        np.testing.assert_allclose(found[:, 2:], np.roll(found[:, :2], -1, axis=0), atol=1e-9)
        assert np.abs(found - se2.transform_segments(motion, walls)).max() < 0.15


def test_pieces_in_one_line_are_one_wall() -> None:
    found = straight([[0, 0, 1, 0.01], [1, 0, 2, 0], [2.3, 0.02, 5, 0]])
    np.testing.assert_array_equal(found, [[0, 0, 5, 0]])


def test_a_door_that_was_seen_through_parts_a_wall_and_one_never_seen_does_not() -> None:
    walls: list[list[float]] = [[0, 0, 2, 0], [2.5, 0, 5, 0]]
    assert len(straight(walls, box(2.1, -1, 2.4, 1))) == 2
    assert len(straight(walls)) == 1


def test_a_bend_of_more_than_noise_stays() -> None:
    walls: list[list[float]] = [[0, 0, 2, 0.06], [2, 0.06, 4, 0]]
    assert len(straight(walls)) == 2


def test_a_round_wall_becomes_few_chords_none_of_them_off_by_more_than_allowed() -> None:
    angles = np.linspace(0, np.pi, 101)
    points = 3 * np.column_stack([np.cos(angles), np.sin(angles)])
    chords = straight(np.hstack([points[:-1], points[1:]]).tolist())
    assert 8 <= len(chords) <= 20
    middle = (chords[:, :2] + chords[:, 2:]) / 2
    assert (3 - np.hypot(*middle.T)).max() < 0.09


def test_opposite_faces_are_never_one_wall() -> None:
    assert len(straight([[0, 0, 2, 0], [2, 0, 0, 0]])) == 2


def test_nothing_to_join_is_nothing() -> None:
    nothing = np.empty((0, 4))
    assert len(join_corners(nothing, NOTHING, JoiningParameters())) == 0
    assert len(straighten(nothing, NOTHING, StraighteningParameters())) == 0
