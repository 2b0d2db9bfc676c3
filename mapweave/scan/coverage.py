"""What of the region was searched, and where it goes on: explored area, and frontiers.

A frontier is where free space ends, no wall is near, and a robot would fit in what lies beyond:
there nobody has looked. Shadows of chairs and cracks between cupboards are none. All of it follows
from a line map alone, so whoever has the map has it.
"""

from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray
from pydantic import Field
from shapely.geometry.base import BaseGeometry

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.geometry.segments import near_intervals
from mapweave.maps import LineMap
from mapweave.parameters import StageParameters, derived
from mapweave.scan.free_space import from_rings

Lines: TypeAlias = NDArray[np.object_]  # of shapely
MOST_STOPS = 2000  # along one frontier, however far a map that came in says it goes
STOPS = 8  # of a disc that rolls along an edge, on its diameter's length


class CoverageParameters(StageParameters):
    """What counts as a wall's edge, and what as a way on."""

    reach: float = derived(
        lambda c: 0.5 * c.mapping.clearance + 0.1 + c.mapping.resolution,
        gt=0,
        description="[m] from a wall within which free space ends because of it: what is kept from"
        " walls, by what outlines are simplified, and a cell",
    )
    min_width: float = Field(
        0.8,
        gt=0,
        description="[m] that a way on has at least, from wall to wall or from free to free, as a"
        " narrow door and what drives through it",
    )
    tolerance: float = derived(
        lambda c: c.mapping.resolution,
        ge=0,
        description="[m] by which walls and outlines may lie too near for that: a cell",
    )


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


class _Edges(NamedTuple):
    """The edges of free space, outline by outline in their order.

    Attributes
    ----------
    segments
        (n, 4) [m].
    outline
        (n,) of which outline each is.
    """

    segments: FloatArray
    outline: IntArray


class _Pieces(NamedTuple):
    """Parts of edges, in their order.

    Attributes
    ----------
    edge
        (k,) of which edge.
    first, last
        (k,) where on it each begins and ends: shares of its length.
    """

    edge: IntArray
    first: FloatArray
    last: FloatArray


def coverage(lines: LineMap, parameters: CoverageParameters | None = None) -> Coverage:
    """Return what was searched, as `lines` tell by their walls and free space."""
    p = parameters or CoverageParameters()
    free = from_rings(lines.free_space)
    edges = _edges(free)
    open_ends = _chains(edges, _away_from(lines.segments, edges.segments, p.reach))
    merged = shapely.get_parts(shapely.line_merge(shapely.MultiLineString(open_ends)))
    obstacles = shapely.linestrings(np.vstack([lines.segments, edges.segments]).reshape(-1, 2, 2))
    wide = merged[_widths(merged, p.reach) >= p.min_width]
    ways_on = wide[_fits_beyond(wide, free, shapely.STRtree(obstacles), p)]
    longest_first = ways_on[np.argsort(-shapely.length(ways_on), kind="stable")]
    frontiers = tuple(shapely.get_coordinates(way) for way in longest_first)
    return Coverage(float(free.area), frontiers)


def _widths(parts: Lines, reach: float) -> FloatArray:
    """[m] of the openings in which frontiers are: to the walls by which both their ends are."""
    length: FloatArray = shapely.length(parts)
    return length + np.where(shapely.is_closed(parts), 0.0, 2 * reach)


def _fits_beyond(
    parts: Lines, free: BaseGeometry, obstacles: shapely.STRtree, p: CoverageParameters
) -> BoolArray:
    """Return (k,) for each of `parts` of outlines whether a disc as wide as a way fits beyond it.

    It rolls along the part, on the side that is not `free`, and must meet no obstacle.
    """
    apart = np.maximum(p.min_width / STOPS, shapely.length(parts) / MOST_STOPS)
    stops = shapely.segmentize(parts, apart)
    corners, owner = shapely.get_coordinates(stops, return_index=True)
    step, touched = np.diff(corners, axis=0), (corners[1:] + corners[:-1]) / 2
    length = np.hypot(*step.T)
    rolls = (owner[1:] == owner[:-1]) & (length > 0)
    owner, touched = owner[1:][rolls], touched[rolls]
    aside = np.column_stack([-step[:, 1], step[:, 0]])[rolls] / length[rolls, None]
    fits = np.zeros(len(parts), dtype=bool)
    for radius in (-p.min_width / 2, p.min_width / 2):
        middle = touched + radius * aside
        stands = ~shapely.contains_xy(free, *middle.T)
        discs = shapely.points(middle)
        met, _ = obstacles.query(discs, predicate="dwithin", distance=abs(radius) - p.tolerance)
        stands[met] = False
        fits[owner[stands]] = True
    return fits


def _edges(free: BaseGeometry) -> _Edges:
    outlines = shapely.get_parts(shapely.boundary(free))
    corners, outline = shapely.get_coordinates(outlines, return_index=True)
    within = outline[1:] == outline[:-1]
    segments = np.hstack([corners[:-1], corners[1:]])[within]
    return _Edges(segments, outline[1:][within])


def _away_from(walls: FloatArray, edges: FloatArray, reach: float) -> _Pieces:
    """Return what of (n, 4) `edges` is farther than `reach` [m] from every wall.

    On a straight edge, what is within reach of a wall is an interval: sorted, they leave gaps.
    """
    low, high = np.minimum(edges[:, :2], edges[:, 2:]), np.maximum(edges[:, :2], edges[:, 2:])
    around = shapely.box(*(low - reach).T, *(high + reach).T)
    tree = shapely.STRtree(shapely.linestrings(walls.reshape(-1, 2, 2)))
    edge, wall = tree.query(around)
    first, last = near_intervals(edges[edge], walls[wall], reach)
    found = first <= last
    return _gaps(len(edges), edge[found], first[found], last[found])


def _gaps(count: int, edge: IntArray, first: FloatArray, last: FloatArray) -> _Pieces:
    """Return what intervals leave of `count` edges, each from 0 to 1.

    All edges are laid on one line, edge k from 2 k to 2 k + 1.
    """
    ends = 2.0 * np.arange(count)
    begins = np.concatenate([ends, ends + 1, 2 * edge + first])
    stops = np.concatenate([ends, ends + 1, 2 * edge + last])
    order = np.argsort(begins, kind="stable")
    covered = np.maximum.accumulate(stops[order])[:-1]
    following = begins[order][1:]
    owner = (covered // 2).astype(np.int64)
    left = (following > covered) & (owner == following // 2)
    owner, covered, following = owner[left], covered[left], following[left]
    return _Pieces(owner, covered - 2 * owner, following - 2 * owner)


def _chains(edges: _Edges, pieces: _Pieces) -> list[BaseGeometry]:
    """Return `pieces` as lines, those that follow each other round an outline as one."""
    start, end = np.split(edges.segments[pieces.edge], 2, axis=1)
    first, last = pieces.first[:, None], pieces.last[:, None]
    # A piece that ends where its edge does ends at exactly the corner where the next one begins.
    stops = np.where(last == 1, end, start + last * (end - start))
    points = np.stack([start + first * (end - start), stops], axis=1).reshape(-1, 2)
    begins = ~_goes_on(edges, pieces)
    chain = np.repeat(np.cumsum(begins) - 1, 2)
    kept = np.column_stack([begins, np.ones(len(begins), dtype=bool)]).ravel()
    return list(shapely.linestrings(points[kept], indices=chain[kept]))


def _goes_on(edges: _Edges, pieces: _Pieces) -> BoolArray:
    """Return for each of `pieces` whether it begins where the one before it ends."""
    follows = np.zeros(len(pieces.edge), dtype=bool)
    before, after = pieces.edge[:-1], pieces.edge[1:]
    touch = (pieces.last[:-1] == 1) & (pieces.first[1:] == 0) & (after == before + 1)
    follows[1:] = touch & (edges.outline[before] == edges.outline[after])
    return follows
