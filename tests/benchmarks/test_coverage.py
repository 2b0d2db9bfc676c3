"""Shares and metres have the values that can be worked out by hand."""

import numpy as np
import pytest

from benchmarks.coverage import explained_share, metres_in_common, returns_at, wall_cells
from mapweave.scan.scan import Scan


def test_returns_beyond_twelve_metres_and_blind_beams_do_not_count() -> None:
    scan = Scan(np.array([np.nan, 11.0, 13.0]), np.array([-0.1, 0.0, 0.1]), 0, 0.0)
    points = returns_at([scan], np.array([[1.0, 2.0, np.pi / 2]]))
    np.testing.assert_allclose(points, [[1.0, 13.0]])


def test_a_return_is_explained_up_to_ten_centimetres_from_a_segment_and_its_ends() -> None:
    wall = np.array([[0.0, 0.0, 1.0, 0.0]])
    points = np.array([[0.5, 0.09], [0.5, -0.09], [0.5, 0.11], [1.09, 0.0], [1.11, 0.0]])
    assert explained_share(points, wall) == pytest.approx(3 / 5)


def test_a_cell_counts_from_two_returns_on() -> None:
    points = np.array([[0.05, 0.05], [0.1, 0.1], [1.0, 1.0]])
    np.testing.assert_allclose(wall_cells(points), [[0.075, 0.075]])


def test_a_wall_shared_by_half_counts_by_its_cells_whichever_comes_first() -> None:
    wall = np.column_stack([0.15 * np.arange(100) + 0.075, np.zeros(100)])
    first, second = wall[:60], wall[40:]
    # 20 cells in common, and one more on each side lies within 0.25 m.
    assert metres_in_common(first, second) == pytest.approx(2.1)
    assert metres_in_common(second, first) == metres_in_common(first, second)
    assert metres_in_common(first, first + np.array([0.0, 5.0])) == 0.0
