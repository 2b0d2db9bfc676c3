"""A line map as a raster, so that thousands of hypotheses are judged by look-up.

Each cell knows the nearest wall sample and how deep it lies in the free space that was seen.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import scipy
from pydantic import Field

from mapweave.geometry.arrays import BoolArray, Float32Array, FloatArray, Int32Array, IntArray
from mapweave.geometry.segments import lengths
from mapweave.maps import LineMap
from mapweave.parameters import StageParameters, derived
from mapweave.scan.points import OrientedPoints, points_on_lines


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


@dataclass(frozen=True, slots=True, eq=False)
class DistanceField:
    """A line map, sampled and rasterised.

    Attributes
    ----------
    surface
        (n,) oriented samples of the walls, map frame.
    weight
        (n,) metres of wall that each stands for.
    segment
        (n,) which segment of the map each is of.
    origin
        (2,) the raster's corner [m].
    cell
        [m].
    nearest
        (rows, columns) index of the sample nearest to each cell.
    distance
        (rows, columns) [m] to it.
    depth
        (rows, columns) [m] from the edge of the seen free space inwards; 0 outside of it.
    """

    oriented: OrientedPoints
    weight: FloatArray
    segment: IntArray
    origin: FloatArray
    cell: float
    nearest: Int32Array
    distance: Float32Array
    depth: Float32Array

    @classmethod
    def of(cls, line_map: LineMap, parameters: DistanceFieldParameters) -> "DistanceField":
        """Rasterise `line_map`, which has at least one segment."""
        p = parameters
        oriented, segment = points_on_lines(line_map, p.spacing)
        length = lengths(line_map.segments)
        counts = np.bincount(segment, minlength=len(length))
        trust = np.minimum(1.0, line_map.support / p.full_support)
        weight = (trust * length / np.maximum(counts, 1))[segment]
        low = oriented.points.min(axis=0) - p.border
        high = oriented.points.max(axis=0) + p.border
        cell = max(p.cell, float(np.sqrt(np.prod(high - low) / p.max_cells)))
        shape = np.ceil((high - low) / cell).astype(np.int64) + 1
        nearest, distance = _nearest_sample(oriented.points, low, cell, shape)
        free = fill_polygons(line_map.free_space, low, cell, shape)
        # The raster's rim is not free: what lies beyond was not looked at.
        padded = scipy.ndimage.distance_transform_edt(np.pad(free, 1))[1:-1, 1:-1]
        depth = (padded * cell).astype(np.float32)
        return cls(oriented, weight, segment, low, cell, nearest, distance, depth)

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

    Rows run along x and columns along y. In each row the outline crosses at some columns; between
    an odd and the next crossing is the inside.
    """
    filled = np.zeros(tuple(shape), dtype=np.bool_)
    for polygon in polygons:
        corners = (polygon - origin) / cell - 0.5  # cell centres at whole numbers
        low = np.clip(np.floor(corners.min(axis=0)), 0, shape).astype(np.int64)
        high = np.clip(np.ceil(corners.max(axis=0)) + 1, 0, shape).astype(np.int64)
        if (high > low).all():
            window = filled[low[0] : high[0], low[1] : high[1]]
            window |= _inside(corners - low, high - low)
    return filled


def _inside(corners: FloatArray, shape: IntArray) -> BoolArray:
    """Tell which whole numbers (row, column) of `shape` lie in the polygon of (k, 2) `corners`."""
    row, column = _crossings(corners, np.roll(corners, -1, axis=0), int(shape[0]))
    toggles = np.zeros((int(shape[0]), int(shape[1]) + 1), dtype=np.int32)
    np.add.at(toggles, (row, np.clip(np.ceil(column), 0, shape[1]).astype(np.int64)), 1)
    inside: BoolArray = np.cumsum(toggles, axis=1)[:, :-1] % 2 == 1
    return inside


def _crossings(start: FloatArray, end: FloatArray, rows: int) -> tuple[IntArray, FloatArray]:
    """Where edges from (k, 2) `start` to `end`, in cells, cross whole row numbers."""
    low = np.clip(np.ceil(np.minimum(start[:, 0], end[:, 0])), 0, rows).astype(np.int64)
    high = np.clip(np.ceil(np.maximum(start[:, 0], end[:, 0])), 0, rows).astype(np.int64)
    count = high - low
    edge = np.repeat(np.arange(len(start)), count)
    row = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + low[edge]
    run = end[edge] - start[edge]
    column = start[edge, 1] + (row - start[edge, 0]) / run[:, 0] * run[:, 1]
    return row, column


def _nearest_sample(
    points: FloatArray, origin: FloatArray, cell: float, shape: IntArray
) -> tuple[Int32Array, Float32Array]:
    """Index of, and distance [m] to, the sample nearest to each cell."""
    index = np.floor((points - origin) / cell).astype(np.int64)
    owner = np.full(tuple(shape), -1, dtype=np.int32)
    owner[index[:, 0], index[:, 1]] = np.arange(len(points))
    distance, (rows, columns) = scipy.ndimage.distance_transform_edt(owner < 0, return_indices=True)
    return owner[rows, columns], (distance * cell).astype(np.float32)
