"""Partitions end at the face of the wall that they reach."""

import numpy as np
import pytest
from numpy.random import Generator
from shapely.geometry import Polygon, box
from shapely.geometry.base import BaseGeometry

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.lines.t_junctions import WallEndParameters, meet_walls
from tests.mapweave.buildings import random_pose

WALL = [0.0, 0.0, 6.0, 0.0]
NOTHING = Polygon()


def met(segments: list[list[float]], free: BaseGeometry = NOTHING) -> FloatArray:
    return meet_walls(np.array(segments, dtype=float), free, WallEndParameters())


@pytest.mark.parametrize("height", [-0.1, -0.02, 0.04, 0.18])
def test_a_partition_that_nearly_reaches_a_wall_ends_at_it(height: float) -> None:
    into, out = [3.0, 2.0, 3.0, height], [3.2, height, 3.2, 2.0]
    found = met([WALL, into, out])
    expected = np.array([WALL, [3, 2, 3, 0], [3.2, 0, 3.2, 2]])
    np.testing.assert_allclose(found, expected, atol=1e-12)


@pytest.mark.parametrize("height", [-0.3, 0.3])
def test_one_that_ends_farther_off_or_goes_through_stays(height: float) -> None:
    walls = [WALL, [3.0, 2.0, 3.0, height]]
    np.testing.assert_array_equal(met(walls), walls)


def test_it_does_not_grow_through_what_was_seen_to_be_free() -> None:
    walls = [WALL, [3.0, 2.0, 3.0, 0.18]]
    np.testing.assert_array_equal(met(walls, box(2, 0.02, 4, 0.17)), walls)


def test_an_end_that_meets_a_corner_stays_in_it() -> None:
    walls = [WALL, [3.0, 2.0, 3.0, 0.1], [3.0, 0.1, 4.0, 0.1]]
    np.testing.assert_array_equal(met(walls), walls)


def test_of_two_faces_the_nearer_is_met() -> None:
    found = met([WALL, [6.0, -0.1, 0.0, -0.1], [3.0, 2.0, 3.0, 0.05]])
    np.testing.assert_allclose(found[2], [3, 2, 3, 0], atol=1e-12)


def test_a_wall_nearly_parallel_stays_as_seen() -> None:
    walls = [WALL, [1.0, 1.0, 3.0, 0.1]]
    np.testing.assert_array_equal(met(walls), walls)


def test_a_rigid_motion_changes_nothing(rng: Generator) -> None:
    walls, motion = [WALL, [3.0, 2.0, 3.0, 0.1], [4.0, -0.05, 4.5, 2.0]], random_pose(rng)
    there = met(se2.transform_segments(motion, np.array(walls)).tolist())
    np.testing.assert_allclose(there, se2.transform_segments(motion, met(walls)), atol=1e-9)


@pytest.mark.parametrize("count", [0, 1])
def test_few_walls_stay_as_they_are(count: int) -> None:
    walls = np.array([WALL])[:count]
    np.testing.assert_array_equal(meet_walls(walls, NOTHING, WallEndParameters()), walls)
