"""The ellipse of a symmetric matrix: how much it is along which direction."""

import math
from typing import NamedTuple

from mapweave.geometry.arrays import FloatArray


class Ellipse(NamedTuple):
    """Eigenvalues of a symmetric matrix, and the direction of the larger one.

    Attributes
    ----------
    least, most
        The eigenvalues.
    direction
        [rad] in (-pi/2, pi/2], of the larger one's eigenvector.
    """

    least: float
    most: float
    direction: float


def ellipse(matrix: FloatArray) -> Ellipse:
    """Return that of the upper left (2, 2) of a symmetric matrix: plain floats, no LAPACK.

    Asked at every scan about one matrix at a time.
    """
    xx, xy, yy = float(matrix[0, 0]), float(matrix[0, 1]), float(matrix[1, 1])
    middle, half = (xx + yy) / 2, (xx - yy) / 2
    radius = math.hypot(half, xy)
    return Ellipse(middle - radius, middle + radius, math.atan2(xy, half) / 2)
