"""Which samples of walls are of things that stand free and are short."""

from typing import cast

import numpy as np
import scipy

from mapweave.kernels.arrays import BoolArray, Float32Array, FloatArray, IntArray
from mapweave.kernels.extent import longer_sides
from mapweave.kernels.loading import COMPILED


def standing_free_numpy(
    points: FloatArray,
    origin: FloatArray,
    cell: float,
    distance: Float32Array,
    reach: float,
    max_side: float,
) -> BoolArray:
    """Twin of `standing_free`."""
    label, count = scipy.ndimage.label(distance <= reach, np.ones((3, 3)))
    i, j = np.floor((points - origin) / cell).astype(np.int64).T
    thing = np.asarray(label[i, j] - 1, dtype=np.int64)
    small = _bounds(points, thing, count) <= np.sqrt(2) * max_side  # whatever its turn
    asked = np.flatnonzero(small[thing])
    sides = np.full(count, np.inf)
    sides[small] = longer_sides(points[asked], thing[asked], count)[small]
    short: BoolArray = sides[thing] <= max_side
    return short


def standing_free(
    points: FloatArray,
    origin: FloatArray,
    cell: float,
    distance: Float32Array,
    reach: float,
    max_side: float,
) -> BoolArray:
    """Tell which samples (n,) are of things that stand free and are no longer than `max_side`.

    Samples hang together where cells near them touch.

    Parameters
    ----------
    points
        (n, 2) samples of walls [m], all in the raster.
    origin, cell
        (2,) the raster's corner [m]; the cells' size [m].
    distance
        (rows, columns) of each cell to the nearest sample [m]; 0 where one is.
    reach
        [m] to a sample, within which a cell is near it.
    max_side
        [m] of the longer side of the least rectangle around a thing.

    Raises
    ------
    ValueError
        Where lengths do not agree, or a sample is not in the raster.
    """
    if COMPILED is None:
        return standing_free_numpy(points, origin, cell, distance, reach, max_side)
    found = COMPILED.standing_free(points, origin, cell, distance, reach, max_side)
    return cast("BoolArray", found.view(np.bool_))


def _bounds(points: FloatArray, thing: IntArray, count: int) -> FloatArray:
    """(count,) longer sides [m] of the upright rectangles around the points of each thing."""
    order = np.argsort(thing, kind="stable")
    first = np.flatnonzero(np.diff(thing[order], prepend=-1))
    sorted_points, spread = points[order], np.full(count, -np.inf)
    apart = np.maximum.reduceat(sorted_points, first) - np.minimum.reduceat(sorted_points, first)
    spread[thing[order][first]] = apart.max(axis=1)
    return spread
