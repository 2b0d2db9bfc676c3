"""A line map as a raster: which of its samples is nearest to each cell, and how deep that is free.

Rows run along x and columns along y.
"""

from collections.abc import Sequence
from typing import cast

import numpy as np
import scipy
from numpy.typing import NDArray

from mapweave.kernels.arrays import BoolArray, Float32Array, FloatArray, Int32Array, IntArray
from mapweave.kernels.loading import COMPILED

Codes = NDArray[np.uint8]


def nearest_samples_numpy(
    points: FloatArray, origin: FloatArray, cell: float, rows: int, columns: int
) -> tuple[Int32Array, Float32Array]:
    """Return (rows, columns) which of (n, 2) `points` is nearest to each cell, and how far it is.

    Both [m]. Counted from cell to cell; of samples in one cell the last stands for all.
    """
    index = np.floor((points - origin) / cell).astype(np.int64)
    owner = np.full((rows, columns), -1, dtype=np.int32)
    owner[index[:, 0], index[:, 1]] = np.arange(len(points))
    distance, (i, j) = scipy.ndimage.distance_transform_edt(owner < 0, return_indices=True)
    return owner[i, j], (distance * cell).astype(np.float32)


def filled_cells_numpy(
    polygons: Sequence[FloatArray], origin: FloatArray, cell: float, rows: int, columns: int
) -> BoolArray:
    """Twin of `filled_cells`: at each crossing of its outline a row is inside, or outside again."""
    filled = np.zeros((rows, columns), dtype=np.bool_)
    shape = np.array(filled.shape)
    for polygon in polygons:
        corners = (polygon - origin) / cell - 0.5  # cell centres at whole numbers
        low = np.clip(np.floor(corners.min(axis=0)), 0, shape).astype(np.int64)
        high = np.clip(np.ceil(corners.max(axis=0)) + 1, 0, shape).astype(np.int64)
        if (high > low).all():
            window = filled[low[0] : high[0], low[1] : high[1]]
            window |= _inside(corners - low, high - low)
    return filled


def filled_cells(
    polygons: Sequence[FloatArray], origin: FloatArray, cell: float, rows: int, columns: int
) -> BoolArray:
    """Return (rows, columns) which cells' centres lie in any of the simple `polygons` (k, 2) [m].

    In each row the outline crosses at some columns; between an odd and the next crossing is the
    inside.
    """
    if COMPILED is None:
        return filled_cells_numpy(polygons, origin, cell, rows, columns)
    filled = COMPILED.filled_cells(polygons, origin, cell, rows, columns)
    return cast("BoolArray", filled.view(np.bool_))


def depths_numpy(
    polygons: Sequence[FloatArray], origin: FloatArray, cell: float, rows: int, columns: int
) -> Float32Array:
    """Return (rows, columns) how deep each cell lies in the `polygons` [m], 0 outside of them.

    What lies beyond the cells is outside.
    """
    filled = filled_cells_numpy(polygons, origin, cell, rows, columns)
    padded = scipy.ndimage.distance_transform_edt(np.pad(filled, 1))[1:-1, 1:-1]
    return np.asarray(padded * cell, dtype=np.float32)


def cell_codes_numpy(
    nearest: Int32Array,
    distance: Float32Array,
    depth: Float32Array,
    facing: FloatArray,
    closeness: float,
    clearance: float,
    directions: int,
) -> Codes:
    """Twin of `cell_codes`."""
    codes = np.where(depth > clearance, directions + 1, directions).astype(np.uint8)
    near = distance < closeness
    codes[near] = (facing[nearest[near]] * directions).astype(np.int64) % directions
    return codes


def cell_codes(
    nearest: Int32Array,
    distance: Float32Array,
    depth: Float32Array,
    facing: FloatArray,
    closeness: float,
    clearance: float,
    directions: int,
) -> Codes:
    """Return (rows, columns) what each cell says of a wall in it.

    Where wall is within `closeness` [m], which of so many `directions` it faces; else that number,
    or one more where space is free by more than `clearance` [m].

    Parameters
    ----------
    nearest, distance, depth
        (rows, columns) the sample nearest to each cell, how far it is [m], and how deep in free
        space the cell lies [m].
    facing
        (n,) where the samples face, in [0, 1) turns.

    Raises
    ------
    ValueError
        Where shapes do not agree.
    """
    compute = cell_codes_numpy if COMPILED is None else COMPILED.cell_codes
    codes = compute(nearest, distance, depth, facing, closeness, clearance, directions)
    return cast("Codes", codes)


def _inside(corners: FloatArray, shape: IntArray) -> BoolArray:
    """Tell which whole numbers (row, column) of `shape` lie in the polygon of (k, 2) `corners`."""
    row, column = _crossings(corners, np.roll(corners, -1, axis=0), int(shape[0]))
    toggles = np.zeros((int(shape[0]), int(shape[1]) + 1), dtype=np.int32)
    np.add.at(toggles, (row, np.clip(np.ceil(column), 0, shape[1]).astype(np.int64)), 1)
    inside: BoolArray = np.cumsum(toggles, axis=1)[:, :-1] % 2 == 1
    return inside


def _crossings(start: FloatArray, end: FloatArray, rows: int) -> tuple[IntArray, FloatArray]:
    """Where edges from (k, 2) `start` to `end`, in cells, cross whole row numbers."""
    low = np.clip(np.ceil(np.minimum(start[:, 0], end[:, 0])), 0, rows).astype(np.int64)
    high = np.clip(np.ceil(np.maximum(start[:, 0], end[:, 0])), 0, rows).astype(np.int64)
    count = high - low
    edge = np.repeat(np.arange(len(start)), count)
    row = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + low[edge]
    run = end[edge] - start[edge]
    column = start[edge, 1] + (row - start[edge, 0]) / run[:, 0] * run[:, 1]
    return row, column
