"""Lengths and directions of segments."""

import numpy as np

from mapweave.geometry.segments import cross, lengths, near_intervals, units

SEGMENTS = np.array([[0.0, 0, 3, 4], [1, 1, 1, 1], [2, 0, 2, -1]])


def test_a_length_is_the_distance_of_the_ends() -> None:
    assert lengths(SEGMENTS).tolist() == [5, 0, 1]


def test_a_direction_is_a_unit_vector_and_nothing_where_there_is_no_length() -> None:
    directions, length = units(SEGMENTS)
    np.testing.assert_allclose(directions, np.array([[0.6, 0.8], [0, 0], [0, -1]]))
    assert length.tolist() == [5, 0, 1]


def test_a_cross_product_is_the_sine_to_the_left() -> None:
    assert cross(np.array([[1.0, 0], [1, 0]]), np.array([[0.0, 2], [0, -2]])).tolist() == [2, -2]


def test_a_segment_of_hardly_any_length_is_within_reach_or_is_not() -> None:
    wall = np.array([[1.6e-138, 0.017, 0.0, 0.0]])
    for x, near in ((0.0, True), (5.0, False)):
        first, last = near_intervals(np.array([[x, 2e-173, x, 0.0]]), wall, 0.35)
        assert (first[0] <= last[0]) == near


def test_what_is_within_reach_of_a_wall_is_one_interval_of_a_segment() -> None:
    """As distances of many points tell; walls of no length are points."""
    random = np.random.default_rng(3)
    segments, walls = random.uniform(0, 4, (2, 300, 4))
    walls[::10, 2:] = walls[::10, :2]
    walls[5::10] = segments[5::10] + 0.3  # alongside
    first, last = near_intervals(segments, walls, 0.7)
    share = np.linspace(0, 1, 401)
    for segment, wall, begin, end in zip(segments, walls, first, last, strict=True):
        points = segment[:2] + share[:, None] * (segment[2:] - segment[:2])
        along = wall[2:] - wall[:2]
        nearest = (points - wall[:2]) @ along / max(along @ along, 1e-12)
        foot = wall[:2] + np.clip(nearest, 0, 1)[:, None] * along
        distance = np.linalg.norm(points - foot, axis=1)
        clear = np.abs(distance - 0.7) > 1e-9
        inside = (begin <= share) & (share <= end)
        np.testing.assert_array_equal(inside[clear], distance[clear] < 0.7)
