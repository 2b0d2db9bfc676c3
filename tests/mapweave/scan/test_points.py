"""Oriented points: on what was seen, with normals towards the side it was seen from."""

import numpy as np
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.mapping.tracking.observation import ObservationParameters, observe
from mapweave.scan.points import join_points, left_normals, points_on_lines, scan_points
from mapweave.scan.segmentation import extract_segments
from tests.mapweave.buildings import (
    AROUND,
    BUILDING,
    cast,
    corridor,
    line_map,
    random_pose,
    rectangle,
    walls_of,
)

ROOM = walls_of(rectangle(0, 0, 6, 4))


def test_the_visible_side_is_on_the_left() -> None:
    np.testing.assert_allclose(
        left_normals(np.array([[2.0, 0], [0, 3], [-1, 0]])), [[0, 1], [-1, 0], [0, -1]]
    )


def test_all_normals_of_a_scan_face_the_sensor(rng: Generator) -> None:
    scan = cast(walls_of(BUILDING), [9, 1, 0.3], angles=AROUND, noise=rng)
    seen = observe(scan, ObservationParameters()).oriented
    towards = -np.einsum("ij,ij->i", seen.points, seen.normals)
    assert len(seen) > 300
    # A stray pair of returns at a corner may err; surfaces may not.
    assert (towards > 0).mean() > 0.99
    np.testing.assert_allclose(np.hypot(*seen.normals.T), 1)


def test_the_normals_of_a_scan_are_those_of_the_walls(rng: Generator) -> None:
    """Of a room along the axes: one component is 1, the other 0, wherever the sensor looks."""
    pose = np.array([2.0, 1.5, 0.7])
    seen = observe(cast(ROOM, pose, angles=AROUND, noise=rng), ObservationParameters()).oriented
    normals = seen.moved(pose).normals
    assert (np.abs(normals).max(axis=1) > 0.99).mean() > 0.95


def test_every_return_up_to_the_range_becomes_a_point_and_no_other(rng: Generator) -> None:
    scan = cast(walls_of(BUILDING), [9, 1, 0.3], noise=rng)
    segments = extract_segments(scan)
    seen, _ = scan_points(scan, segments, 6.0, 0.2)
    assert np.hypot(*seen.points.T).max() <= 6.0
    near = (scan.ranges <= 6.0) & (segments.label >= 0)
    assert len(seen) >= near.sum()
    assert (seen.polyline >= 0).sum() == near.sum()


def test_of_a_wall_that_was_seen_at_a_slant_no_part_is_left_out(rng: Generator) -> None:
    """The returns along a corridor are metres apart; what is remembered of its walls is not."""
    scan = cast(walls_of(corridor(60, [], [])), [10, 1.1, 0], noise=rng)
    parameters = ObservationParameters()
    seen = observe(scan, parameters)
    right = seen.walls.at((seen.walls.normals[:, 1] > 0.9) & (seen.walls.points[:, 0] > 0))
    along = np.sort(right.points[:, 0])
    assert along[-1] - along[0] > 7
    assert np.diff(along).max() <= parameters.spacing + 0.01
    assert np.abs(right.points[:, 1] + 1.1).max() < 0.15


def test_a_line_is_sampled_evenly_and_even_a_short_one_once() -> None:
    lines = line_map(np.array([[0.0, 0, 2, 0], [5, 5, 5, 5.01]]))
    oriented, owner = points_on_lines(lines, 0.5)
    np.testing.assert_allclose(oriented.points[:4], [[0.25, 0], [0.75, 0], [1.25, 0], [1.75, 0]])
    assert owner.tolist() == [0, 0, 0, 0, 1]
    np.testing.assert_allclose(oriented.normals[0], [0, 1])


def test_sampling_and_moving_may_be_exchanged(rng: Generator) -> None:
    pose, lines = random_pose(rng), line_map(walls_of(BUILDING))
    moved = line_map(se2.transform_segments(pose, lines.segments))
    first, second = points_on_lines(lines, 0.17)[0].moved(pose), points_on_lines(moved, 0.17)[0]
    np.testing.assert_allclose(first.points, second.points, atol=1e-9)
    np.testing.assert_allclose(first.normals, second.normals, atol=1e-9)


def test_joined_surfaces_keep_all_their_points() -> None:
    one, _ = points_on_lines(line_map(ROOM), 0.5)
    both = join_points([one, one.at(slice(0, 3))])
    assert len(both) == len(one) + 3
    np.testing.assert_array_equal(both.normals[-3:], one.normals[:3])
