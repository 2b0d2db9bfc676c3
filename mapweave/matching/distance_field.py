"""A line map as a raster, so that thousands of hypotheses are judged by look-up.

Each cell knows the nearest wall sample and how deep it lies in the free space that was seen.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from pydantic import Field

from mapweave.geometry.arrays import BoolArray, Float32Array, FloatArray, Int32Array, IntArray
from mapweave.kernels.matching import rasters
from mapweave.kernels.matching.fields import rasterised
from mapweave.kernels.matching.judging import Raster, Samples
from mapweave.maps import LineMap
from mapweave.parameters import StageParameters, derived
from mapweave.scan.points import OrientedPoints


class DistanceFieldParameters(StageParameters):
    """Sampling of walls and space."""

    cell: float = derived(lambda c: c.mapping.resolution, gt=0, description="[m] of the raster")
    spacing: float = derived(
        lambda c: 2 * c.mapping.resolution, gt=0, description="[m] between samples of a wall"
    )
    border: float = Field(1.0, gt=0, description="[m] around the map")
    full_support: int = Field(
        2, ge=1, description="scans that make a wall count in full; one may have seen a passer-by"
    )
    max_cells: int = Field(4_000_000, gt=0, description="a larger map gets coarser cells")
    same_wall: float = Field(
        0.0,
        ge=0,
        description="[m] around a sample within which wall that faces as it does is the same wall,"
        " drawn by another submap or drawn twice, and counts once; at 0 all counts",
    )
    min_cosine: float = Field(0.8, gt=0, le=1, description="of normals of the same wall: 37°")


@dataclass(frozen=True, eq=False)
class DistanceField:
    """A line map, sampled and rasterised.

    Attributes
    ----------
    oriented
        (n,) oriented samples of the walls, map frame.
    segment
        (n,) which segment of the map each is of.
    weight
        (n,) metres of wall that each stands for; a part of them where the wall is drawn again.
    facing
        (n,) where the normal of each points, in [0, 1) turns.
    own_depth
        (n,) how deep each lies in the free space of its own map [m].
    origin
        (2,) the raster's corner [m].
    cell
        [m].
    nearest
        (rows, columns) index of the sample nearest to each cell.
    distance
        (rows, columns) [m] to it.
    depth
        (rows, columns) [m] from the edge of the seen free space inwards; 0 outside of it. The rim
        is not free: what lies beyond was not looked at.
    codes
        (rows, columns) what cells say, by the limits that it hangs on; filled by what asks for it.
    missing
        (n,) what a metre of wall counts that is not there, by what it hangs on; filled likewise.
    """

    oriented: OrientedPoints
    segment: IntArray
    weight: FloatArray
    facing: FloatArray
    own_depth: Float32Array
    origin: FloatArray
    cell: float
    nearest: Int32Array
    distance: Float32Array
    depth: Float32Array
    codes: dict[tuple[float, float], rasters.Codes] = field(
        default_factory=dict, init=False, repr=False
    )
    missing: dict[tuple[float, float, float], FloatArray] = field(
        default_factory=dict, init=False, repr=False
    )

    @classmethod
    def of(cls, line_map: LineMap, parameters: DistanceFieldParameters) -> "DistanceField":
        """Rasterise `line_map`, which has at least one segment."""
        p = parameters
        made = rasterised(
            line_map.segments,
            line_map.support,
            line_map.free_space,
            p.spacing,
            p.full_support,
            *(p.same_wall, p.min_cosine, p.border, p.cell, p.max_cells),
        )
        polyline = line_map.polyline[made.segment]
        return cls(OrientedPoints(made.points, made.normals, polyline), *made[2:])

    @cached_property
    def samples(self) -> Samples:
        """Its walls, as they are looked up in the rasters of others."""
        return Samples(self.oriented.points, self.oriented.normals, self.own_depth)

    @cached_property
    def cells(self) -> Raster:
        """What the walls of others are looked up in."""
        return Raster(
            self.oriented.normals,
            *(self.nearest, self.distance, self.depth),
            *(self.origin, self.cell),
        )

    @cached_property
    def middle(self) -> FloatArray:
        """(2,) of its walls [m]."""
        return np.asarray(self.oriented.points.mean(axis=0))

    def look_up(self, points: FloatArray) -> tuple[Int32Array, Float32Array, Float32Array]:
        """Return nearest sample, distance and free depth at (..., 2) `points` [m], map frame.

        Outside the raster the distance is infinite and the depth 0.
        """
        index = np.floor((points - self.origin) / self.cell).astype(np.int32)
        rows, columns = self.distance.shape
        i, j = index[..., 0], index[..., 1]
        outside = (i < 0) | (j < 0) | (i >= rows) | (j >= columns)
        flat = np.where(outside, 0, i * columns + j)
        nearest = self.nearest.ravel()[flat]
        distance = self.distance.ravel()[flat]
        depth = self.depth.ravel()[flat]
        distance[outside] = np.inf
        depth[outside] = 0
        return nearest, distance, depth


def fill_polygons(
    polygons: Iterable[FloatArray], origin: FloatArray, cell: float, shape: IntArray
) -> BoolArray:
    """Return (rows, columns) which cells' centres lie in any of the simple `polygons` (k, 2) [m].

    Rows run along x and columns along y.
    """
    return rasters.filled_cells(list(polygons), origin, cell, int(shape[0]), int(shape[1]))
