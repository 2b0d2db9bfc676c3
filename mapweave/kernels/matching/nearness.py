"""How far places are from the nearest of some points."""

from typing import cast

import numpy as np
import scipy

from mapweave.kernels.arrays import FloatArray
from mapweave.kernels.loading import COMPILED


def nearest_distances_numpy(points: FloatArray, places: FloatArray) -> FloatArray:
    """Twin of `nearest_distances`."""
    if len(points) == 0:
        return np.full(len(places), np.inf)
    return np.asarray(scipy.spatial.KDTree(points).query(places)[0], dtype=np.float64)


def nearest_distances(points: FloatArray, places: FloatArray) -> FloatArray:
    """Return (m,) how far each of (m, 2) `places` is from the nearest of (n, 2) `points` [m].

    Points that follow each other are near each other, as along walls, or it takes longer.
    """
    if COMPILED is None:
        return nearest_distances_numpy(points, places)
    given = np.ascontiguousarray(points), np.ascontiguousarray(places)
    return cast("FloatArray", COMPILED.nearest_distances(*given))
