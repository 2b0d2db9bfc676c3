"""What stands free and is short: a crate, a chair, a table. It may stand elsewhere tomorrow.

Walls hang together; what hangs together with no wall may be moved, and proves less where it is
missed than a wall does.
"""

import numpy as np
import scipy

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.geometry.extent import longer_sides
from mapweave.matching.distance_field import DistanceField


def free_standing(raster: DistanceField, gap: float, max_side: float) -> BoolArray:
    """Tell which samples (n,) of the walls of `raster` are of things that may have been moved.

    Parameters
    ----------
    gap
        [m] to all other wall: what is nearer hangs together, whatever it is.
    max_side
        [m] of the longer side of what may be moved.
    """
    limits = gap, max_side
    if limits not in raster.things:
        raster.things[limits] = _free_standing(raster, *limits)
    return raster.things[limits]


def _free_standing(raster: DistanceField, gap: float, max_side: float) -> BoolArray:
    """Work it out: samples hang together where cells around them touch."""
    around = raster.distance <= max(gap / 2 - raster.cell / 2, 0.0)
    label, count = scipy.ndimage.label(around, np.ones((3, 3)))
    points = raster.oriented.points
    i, j = np.floor((points - raster.origin) / raster.cell).astype(np.int64).T
    thing = np.asarray(label[i, j] - 1, dtype=np.int64)
    small = _bounds(points, thing, count) <= np.sqrt(2) * max_side  # whatever its turn
    asked = np.flatnonzero(small[thing])
    sides = np.full(count, np.inf)
    sides[small] = longer_sides(points[asked], thing[asked], count)[small]
    short: BoolArray = sides[thing] <= max_side
    return short


def _bounds(points: FloatArray, thing: IntArray, count: int) -> FloatArray:
    """(count,) longer sides [m] of the upright rectangles around the points of each thing."""
    order = np.argsort(thing, kind="stable")
    first = np.flatnonzero(np.diff(thing[order], prepend=-1))
    sorted_points, spread = points[order], np.full(count, -np.inf)
    apart = np.maximum.reduceat(sorted_points, first) - np.minimum.reduceat(sorted_points, first)
    spread[thing[order][first]] = apart.max(axis=1)
    return spread
