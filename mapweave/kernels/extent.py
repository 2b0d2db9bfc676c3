"""How far points spread: the longer side of the least rectangle around them."""

import numpy as np

from mapweave.kernels.arrays import FloatArray, IntArray

TURNS = np.radians(np.arange(0.0, 90.0, 3.0))  # [rad] of the rectangles tried


def longer_sides(points: FloatArray, group: IntArray, count: int) -> FloatArray:
    """Return (count,) longer sides [m] of the least rectangles around groups of points.

    Parameters
    ----------
    points
        (n, 2) [m].
    group
        (n,) which each is in, from 0 to `count` - 1; a group of none spreads by 0.
    """
    axes = np.stack([np.cos(TURNS), np.sin(TURNS), -np.sin(TURNS), np.cos(TURNS)])
    along = points @ axes.reshape(2, 2, -1).transpose(2, 1, 0)  # (turns, n, 2)
    order = np.argsort(group, kind="stable")
    present, first = np.unique(group[order], return_index=True)
    sides = np.zeros((count, len(TURNS), 2))
    if len(present):
        sorted_along = along[:, order].transpose(1, 0, 2)
        high = np.maximum.reduceat(sorted_along, first)
        sides[present] = high - np.minimum.reduceat(sorted_along, first)
    least = np.argmin(sides.prod(axis=2), axis=1)
    longer: FloatArray = sides[np.arange(count), least].max(axis=1)
    return longer
