"""What stands free and is short: a crate, a chair, a table. It may stand elsewhere tomorrow.

Walls hang together; what hangs together with no wall may be moved, and proves less where it is
missed than a wall does.
"""

from mapweave.geometry.arrays import BoolArray
from mapweave.kernels.matching.standing import standing_free
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
    reach = max(gap / 2 - raster.cell / 2, 0.0)
    return standing_free(
        *(raster.oriented.points, raster.origin, raster.cell),
        *(raster.distance, reach, max_side),
    )
