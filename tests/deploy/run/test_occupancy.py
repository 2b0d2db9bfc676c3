"""The occupancy grid that bytes are compared with."""

import numpy as np

from mapweave.scan.scan import Scan
from mapweave_deploy.run.occupancy import CELL, FREE, OCCUPIED, UNKNOWN, draw_grid


def circle(radius: float) -> Scan:
    """Return a scan from the middle of a round room."""
    angles = np.linspace(-np.pi, np.pi, 2000)[1:]
    return Scan(np.full(len(angles), radius), angles, 0, 0.0)


def test_a_round_room_is_a_ring_of_occupied_cells_around_free_ones() -> None:
    grid = draw_grid([circle(2.0)], np.zeros((1, 3)))
    rows, columns = np.indices(grid.shape)
    origin = -2.0
    away = np.hypot(*(origin + (np.stack([columns, rows]) + 0.5) * CELL))
    assert grid.shape in {(80, 80), (81, 81)}
    assert np.all(grid[away < 2.0 - 2 * CELL] == FREE)
    assert np.all(grid[away > 2.0 + 2 * CELL] == UNKNOWN)
    assert np.count_nonzero(grid == OCCUPIED) > 2 * np.pi * 2.0 / CELL * 0.8


def test_the_grid_covers_the_returns_of_all_scans_where_they_were_placed() -> None:
    grid = draw_grid([circle(1.0), circle(1.0)], np.array([[0.0, 0.0, 0.3], [5.0, 0.0, 2.0]]))
    assert grid.shape[1] in {140, 141}
    assert grid.shape[0] in {40, 41}
    assert np.all(grid[:, 60:80] == UNKNOWN)
