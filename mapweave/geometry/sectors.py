"""Sectors: directions from one to another, counter-clockwise, in degrees as people state them."""

from typing import TypeAlias

import numpy as np

from mapweave.geometry.arrays import BoolArray, FloatArray

Sector: TypeAlias = tuple[float, float]
"""[°] From its first direction counter-clockwise to its second; both belong to it. A whole turn
where they are a whole turn apart."""


def within(angles: FloatArray, sectors: tuple[Sector, ...]) -> BoolArray:
    """Tell which (n,) `angles` [rad] lie in one of the `sectors` [°]."""
    inside = np.zeros(len(angles), dtype=bool)
    directions = np.degrees(angles)
    for first, last in sectors:
        width = last - first if abs(last - first) >= 360 else (last - first) % 360
        inside |= (directions - first) % 360 <= abs(width)
    return inside
