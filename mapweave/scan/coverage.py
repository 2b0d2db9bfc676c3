"""What of the region was searched, and where it goes on: explored area, and frontiers.

A frontier is where free space ends and no wall is near: beyond it nobody has looked. Both follow
from a line map alone, so whoever has the map has them.
"""

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from pydantic import Field

from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap
from mapweave.parameters import StageParameters, derived
from mapweave.scan.free_space import from_rings


class CoverageParameters(StageParameters):
    """What counts as a wall's edge, and what as a way on."""

    reach: float = derived(
        lambda c: 0.5 * c.mapping.clearance + 0.1 + c.mapping.resolution,
        gt=0,
        description="[m] from a wall within which free space ends because of it: what is kept from"
        " walls, by what outlines are simplified, and a cell",
    )
    min_length: float = Field(0.5, gt=0, description="[m] narrower is no way on for a robot")


@dataclass(frozen=True, slots=True, eq=False)
class Coverage:
    """What was searched of one component.

    Attributes
    ----------
    explored
        [m²] that was seen to be free.
    frontiers
        Lines of (n, 2) points [m], the longest first, component's frame.
    """

    explored: float
    frontiers: tuple[FloatArray, ...]


def coverage(lines: LineMap, parameters: CoverageParameters | None = None) -> Coverage:
    """Return what was searched, as `lines` tell by their walls and free space."""
    p = parameters or CoverageParameters()
    free = from_rings(lines.free_space)
    # Each by itself: GEOS takes ten times as long for the edge of thousands of lines at once.
    walls = shapely.union_all(shapely.buffer(_lines(lines.segments), p.reach))
    open_ends = shapely.line_merge(shapely.difference(shapely.boundary(free), walls))
    parts = [part for part in shapely.get_parts(open_ends) if part.length >= p.min_length]
    parts.sort(key=lambda part: -part.length)
    frontiers = tuple(np.array(part.coords, dtype=np.float64) for part in parts)
    return Coverage(float(free.area), frontiers)


def _lines(segments: FloatArray) -> NDArray[np.object_]:
    """Return (n,) the (n, 4) `segments` as lines."""
    return np.asarray(shapely.linestrings(segments.reshape(-1, 2, 2)))
