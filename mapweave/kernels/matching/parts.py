"""The parts that the cells of a raster fall into, and which part is nearest to each cell."""

from typing import cast

import numpy as np
import scipy

from mapweave.kernels.arrays import BoolArray, IntArray
from mapweave.kernels.loading import COMPILED


def nearest_parts_numpy(chosen: BoolArray) -> tuple[IntArray, IntArray]:
    """Twin of `nearest_parts`; of parts equally near it may name another."""
    found, count = scipy.ndimage.label(chosen, np.ones((3, 3)))
    label = np.asarray(found, dtype=np.int64)
    if count == 0:
        return label, label.copy()
    away = scipy.ndimage.distance_transform_edt(
        label == 0, return_distances=False, return_indices=True
    )
    return label, label[tuple(away)]


def nearest_parts(chosen: BoolArray) -> tuple[IntArray, IntArray]:
    """Return (rows, columns) the number of each cell's part, and of the part nearest to it.

    Cells that touch are of one part, corners included; from 1 on, 0 for cells that are not chosen,
    and everywhere where none is.
    """
    if COMPILED is None:
        return nearest_parts_numpy(chosen)
    return cast("tuple[IntArray, IntArray]", COMPILED.nearest_parts(np.ascontiguousarray(chosen)))
