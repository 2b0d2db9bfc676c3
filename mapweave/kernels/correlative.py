"""Correlative search: how many points fall near known ones, at every pose in a window."""

from typing import cast

import numpy as np
import scipy
from numpy.typing import NDArray

from mapweave.kernels.loading import COMPILED
from mapweave.kernels.point_map import Floats

Floats32 = NDArray[np.float32]


def nearness_field_numpy(
    points: Floats, origin: Floats, cell: float, size: int, sigma: float
) -> Floats32:
    """Twin of `nearness_field`."""
    index = np.floor((points - origin) / cell)
    index = index[((index >= 0) & (index < size)).all(axis=1)].astype(np.int64)
    empty = np.ones((size + 1, size + 1), dtype=np.bool_)
    empty[index[:, 0], index[:, 1]] = False
    value = np.zeros(empty.shape, dtype=np.float32)
    if len(index):
        squared = np.rint(scipy.ndimage.distance_transform_edt(empty) ** 2) * cell**2
        near = np.exp(-squared / (2 * sigma**2)).astype(np.float32)
        value[:size, :size] = np.where(squared <= 16 * sigma**2, near, 0)[:size, :size]
    return value


def window_scores_numpy(
    points: Floats, field: Floats32, origin: Floats, cell: float, turns: Floats, shifts: Floats
) -> Floats32:
    """Twin of `window_scores`."""
    outside = field.shape[0] - 1
    base = np.rint((shifts - origin) / cell).astype(np.int64)
    scores = np.empty((len(turns), len(shifts), len(shifts)), dtype=np.float32)
    for k, turn in enumerate(turns):
        c, s = np.cos(turn), np.sin(turn)
        cells = np.floor(points @ np.array([[c, s], [-s, c]]) / cell).astype(np.int64)
        column, row = base[:, 0, None] + cells[None, :, 0], base[:, 1, None] + cells[None, :, 1]
        column[(column < 0) | (column > outside)] = outside
        row[(row < 0) | (row > outside)] = outside
        scores[k] = field[column[:, None, :], row[None, :, :]].sum(axis=-1)
    return scores


def nearness_field(
    points: Floats, origin: Floats, cell: float, size: int, sigma: float
) -> Floats32:
    """Return (size + 1, size + 1) nearness in [0, 1] to (n, 2) `points` [m], 0 beyond 4 sigma.

    Parameters
    ----------
    origin
        (2,) the raster's corner [m].
    cell, sigma
        [m] of the raster, and the standard deviation of the nearness.
    size
        Cells a side; the last row and column more stand for everything outside: 0.
    """
    compute = nearness_field_numpy if COMPILED is None else COMPILED.nearness_field
    return cast("Floats32", compute(points, origin, cell, size, sigma))


def window_scores(
    points: Floats, field: Floats32, origin: Floats, cell: float, turns: Floats, shifts: Floats
) -> Floats32:
    """Return (t, s, s) the summed nearness of (n, 2) `points`, turned, then moved by each shift.

    Parameters
    ----------
    field, origin, cell
        As of `nearness_field`.
    turns
        (t,) [rad].
    shifts
        (s, 2) [m]: every first coordinate with every second one.
    """
    compute = window_scores_numpy if COMPILED is None else COMPILED.window_scores
    return cast("Floats32", compute(points, field, origin, cell, turns, shifts))
