"""Lengths, directions and samples of segments."""

import numpy as np

from mapweave.geometry.segments import cross, lengths, sample, units

SEGMENTS = np.array([[0.0, 0, 3, 4], [1, 1, 1, 1], [2, 0, 2, -1]])


def test_a_length_is_the_distance_of_the_ends() -> None:
    assert lengths(SEGMENTS).tolist() == [5, 0, 1]


def test_a_direction_is_a_unit_vector_and_nothing_where_there_is_no_length() -> None:
    directions, length = units(SEGMENTS)
    np.testing.assert_allclose(directions, np.array([[0.6, 0.8], [0, 0], [0, -1]]))
    assert length.tolist() == [5, 0, 1]


def test_a_cross_product_is_the_sine_to_the_left() -> None:
    assert cross(np.array([[1.0, 0], [1, 0]]), np.array([[0.0, 2], [0, -2]])).tolist() == [2, -2]


def test_samples_stand_for_equal_parts_that_add_up_to_the_segment() -> None:
    found = sample(SEGMENTS[[0, 2]], spacing=2.0)
    assert found.owner.tolist() == [0, 0, 0, 1]
    np.testing.assert_allclose(found.lengths, [5 / 3] * 3 + [1])
    np.testing.assert_allclose(found.points[1], [1.5, 2])
