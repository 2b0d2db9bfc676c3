"""A grid of a building as other programs keep it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class GridCells:
    """Which cells are walls, and which are free; the others are unknown.

    Attributes
    ----------
    wall, free
        (rows, columns); the first row has the smallest y.
    resolution
        [m] of a cell.
    origin
        (3,) pose of the corner of the first cell of the first row [m, m, rad], map frame.
    """

    wall: BoolArray
    free: BoolArray
    resolution: float
    origin: FloatArray

    @cached_property
    def nearest_wall(self) -> tuple[FloatArray, IntArray]:
        """(rows, columns) [cells] to the nearest wall, and (2, rows, columns) where that is."""
        distance, nearest = scipy.ndimage.distance_transform_edt(~self.wall, return_indices=True)
        return np.asarray(distance), np.asarray(nearest, dtype=np.int64)
