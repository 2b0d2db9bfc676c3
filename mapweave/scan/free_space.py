"""The free space that was seen: polygons in which no wall can be.

Matched wall alone accepts look-alike corridors; a wall of one map inside what the other saw
through refutes them. So a map carries its free space.
"""

from collections.abc import Iterable, Sequence

import numpy as np
import shapely
from pydantic import Field
from shapely.geometry import LinearRing, MultiPolygon, Polygon, box
from shapely.geometry.base import BaseGeometry

from mapweave.geometry.arrays import BoolArray, FloatArray
from mapweave.geometry.polygons import edges_of
from mapweave.kernels.clearing import (
    Floats32,
    Grid,
    Sights,
    clear_cells,
    from_core,
    outlines,
)
from mapweave.kernels.lines.evidence import near_pairs
from mapweave.kernels.matching.rasters import filled_cells
from mapweave.parameters import StageParameters, derived

ROUNDING = 1e-9  # of a tolerance, which a corner may be off by exactly


class FreeSpaceParameters(StageParameters):
    """How far and how surely a scan clears space."""

    sight: float = derived(
        lambda c: c.mapping.free_range,
        gt=0,
        description="[m] beyond, neighbouring beams are too far apart to prove much",
    )
    margin: float = derived(
        lambda c: 0.5 * c.mapping.clearance, ge=0, description="[m] kept from what the beams hit"
    )
    cell: float = derived(
        lambda c: 0.5 * c.mapping.resolution,
        gt=0,
        description="[m] of the raster in which it is drawn",
    )
    max_cells: int = Field(4_000_000, gt=0, description="of the raster; larger ones get coarser")
    simplification: float = derived(
        lambda c: min(0.1, 0.4 * c.mapping.clearance),
        gt=0,
        description="[m] by which outlines may deviate; below the margin",
    )
    min_width: float = Field(0.25, ge=0, description="[m] narrower streaks are left out")
    min_area: float = Field(0.1, ge=0, description="[m²] smaller pieces are not worth sending")


def seen_free(sights: Sights, parameters: FreeSpaceParameters) -> BaseGeometry:
    """Return what scans saw to be free: polygons in the frame of their poses.

    Drawn into a raster, opened there, and outlined: a view through a crack clears nothing that
    would matter, and costs many vertices.
    """
    p = parameters
    bounds = _seen_bounds(sights, p.margin)
    if bounds is None:
        return MultiPolygon()
    low, high = bounds
    cell = max(p.cell, float(np.sqrt(np.prod(high - low) / p.max_cells)))
    rows, columns = (np.ceil((high - low) / cell).astype(np.int64) + 1).tolist()
    free = clear_cells(sights, p.margin, Grid(low, cell, rows, columns))
    depth = _depth(cell, p)
    level = max(depth - 1.0, 0.5)  # half a cell inside of where it ends
    corners, start = outlines(from_core(free, depth), level)
    found = _with_holes(np.split(low + cell * (corners - 0.5), start[1:-1]) if len(corners) else [])
    # What was opened has no neck so narrow that thinning its outline would close it.
    left = max(p.simplification - cell / 2, 0.0)  # what the raster has not taken already
    simpler = shapely.simplify(found, left, preserve_topology=False)
    whole = shapely.union_all(shapely.make_valid(simpler))
    return MultiPolygon([q for q in _polygons(whole) if q.area >= p.min_area])


def _depth(cell: float, p: FreeSpaceParameters) -> int:
    """Return half the least width, in cells between one's middle and another's edge."""
    return max(1, round(p.min_width / 2 / cell + 0.5))


def _seen_bounds(sights: Sights, margin: float) -> tuple[FloatArray, FloatArray] | None:
    """Return the least and the greatest x and y [m] of what was seen through; None of nothing."""
    reach = np.maximum(sights.clear - margin, 0.0)
    if not (reach > 0).any():
        return None
    x, y, turn = (np.repeat(values, np.diff(sights.start)) for values in sights.poses.T)
    angle = turn + sights.angles
    places = x, x + reach * np.cos(angle), y, y + reach * np.sin(angle)
    low, high = ([ends(values) for values in places] for ends in (np.min, np.max))
    return np.minimum(low[::2], low[1::2]), np.maximum(high[::2], high[1::2])


def _with_holes(outlines: list[FloatArray]) -> list[Polygon]:
    """Return polygons of rings (k, 2): those that turn right are holes in the least around them."""
    polygons = [Polygon(ring) for ring in outlines if len(ring) >= 3]
    outer = sorted((q for q in polygons if q.exterior.is_ccw), key=lambda q: q.area)
    holes: list[list[FloatArray]] = [[] for _ in outer]
    for hole in (q.exterior for q in polygons if not q.exterior.is_ccw):
        around = next((k for k, q in enumerate(outer) if q.contains(hole)), None)
        if around is not None:
            holes[around].append(np.array(hole.coords))
    return [Polygon(q.exterior, inside) for q, inside in zip(outer, holes, strict=True)]


def unite(pieces: Sequence[FloatArray], parameters: FreeSpaceParameters) -> BaseGeometry:
    """Return the union of `pieces`, its outline simplified, streaks and crumbs left out.

    Drawn into a raster, as what scans saw is: what it costs grows with the area, and not with how
    often that was seen. Only where the area is too large for that, polygons are united.

    Parameters
    ----------
    pieces
        Simple polygons (k, 2) in one frame [m], as maps hold them.
    parameters
        How much an outline is simplified, and what is a crumb.
    """
    p = parameters
    if not any(len(ring) >= 3 for ring in pieces):
        return MultiPolygon()
    corners = np.concatenate(pieces)
    low, high = corners.min(axis=0), corners.max(axis=0)
    rows, columns = (int(n) for n in np.ceil((high - low) / p.cell) + 1)
    if rows * columns > p.max_cells:
        return _opened(from_rings(pieces), p)
    grid = Grid(low, p.cell, rows, columns)
    return _opened_cells(filled_cells(pieces, *grid), grid, p)


def free_cells(free: BoolArray, cell: float, parameters: FreeSpaceParameters) -> BaseGeometry:
    """Return what the (rows, columns) cells that are `free` cover, as `unite` does.

    Parameters
    ----------
    cell
        [m]; the first cell of the first row has its corner at the origin, and rows go along y.
    """
    along_x: BoolArray = np.ascontiguousarray(free.T)
    return _opened_cells(along_x, Grid(np.zeros(2), cell, *along_x.shape), parameters)


def _opened_cells(free: BoolArray, grid: Grid, p: FreeSpaceParameters) -> BaseGeometry:
    """Return what the cells that are `free` cover, its outline simplified, streaks left out."""
    depth = _depth(grid.cell, p)
    wide: BoolArray = from_core(free.view(np.uint8), depth)[1:-1, 1:-1] < depth
    return _without_crumbs(_outlined(wide, grid), p)


def _outlined(free: BoolArray, grid: Grid) -> BaseGeometry:
    """Return what the cells that are `free` cover: the steps of its edge made straight."""
    taken: Floats32 = np.ones((grid.rows + 2, grid.columns + 2), dtype=np.float32)
    taken[1:-1, 1:-1] -= free
    corners, start = outlines(taken, 0.5)
    places = grid.origin + grid.cell * (corners - 0.5)
    found = _with_holes(np.split(places, start[1:-1]) if len(corners) else [])
    smooth = shapely.simplify(found, 0.75 * grid.cell, preserve_topology=False)
    return shapely.union_all(shapely.make_valid(smooth))


def _opened(free: BaseGeometry, p: FreeSpaceParameters) -> BaseGeometry:
    """Return what of `free` is wide enough, its outline simplified."""
    # A view through a crack clears nothing that would matter, and costs many vertices. Corners
    # become round: where free space tapers a mitre goes on to a tip that nobody saw.
    width = p.min_width / 2
    opened = free.buffer(-width, quad_segs=4).buffer(width, quad_segs=4)
    return _without_crumbs(opened, p)


def _without_crumbs(free: BaseGeometry, p: FreeSpaceParameters) -> BaseGeometry:
    """Return `free`, its outline simplified, without what is not worth sending."""
    simpler = simplified(free, p.simplification)
    return MultiPolygon([q for q in _polygons(simpler) if q.area >= p.min_area])


def simplified(area: BaseGeometry, tolerance: float) -> BaseGeometry:
    """Return `area`, its outlines simplified, none of their corners left out by more than allowed.

    Parameters
    ----------
    area
        In any unit; what of it is no polygon does not count.
    tolerance
        By which an outline may deviate, in that unit.
    """
    simpler = shapely.simplify(area, tolerance)
    if _follows(simpler, area, tolerance):
        return simpler
    # GEOS takes the first corner of an outline away last, though others were measured against
    # lines that ended in it: what both are off by adds up, to less than twice the tolerance.
    simpler = shapely.simplify(_begun_far_out(area), tolerance)
    if _follows(simpler, area, tolerance):
        return simpler
    return shapely.simplify(area, tolerance / 2)


def _begun_far_out(area: BaseGeometry) -> BaseGeometry:
    """Return `area`, its outlines begun at the corner farthest out, which mostly stays."""

    def begun(ring: LinearRing) -> FloatArray:
        corners = np.array(ring.coords)[:-1]
        far = np.linalg.norm(corners - corners.mean(axis=0), axis=1).argmax()
        return np.roll(corners, -far, axis=0)

    return MultiPolygon(
        [Polygon(begun(q.exterior), [begun(h) for h in q.interiors]) for q in _polygons(area)]
    )


def _follows(simpler: BaseGeometry, area: BaseGeometry, tolerance: float) -> bool:
    """Whether each corner of `area` has an outline of `simpler` within `tolerance`."""
    corners = shapely.get_coordinates(shapely.get_rings(shapely.get_parts(area)))
    nothing, reach = np.zeros(corners.shape), tolerance * (1 + ROUNDING)
    _, near, *_ = near_pairs(edges_of(simpler), corners, nothing, reach)
    return len(np.unique(near)) == len(corners)


def rings(free_space: BaseGeometry) -> tuple[FloatArray, ...]:
    """Return simple polygons without holes that cover `free_space`, as maps hold them.

    Parameters
    ----------
    free_space
        An area [m]; its holes are cut through.

    Returns
    -------
    tuple of FloatArray
        (k, 2) the vertices of each [m], the first one not repeated.
    """
    return tuple(
        np.array(piece.exterior.coords)[:-1]
        for polygon in _polygons(free_space)
        for piece in _without_holes(polygon)
    )


def from_rings(outlines: Iterable[FloatArray]) -> BaseGeometry:
    """Return the union of simple polygons; the inverse of `rings`.

    Parameters
    ----------
    outlines
        (k, 2) the vertices of each [m], one frame; those of fewer than three are no area.
    """
    polygons = [Polygon(ring) for ring in outlines if len(ring) >= 3]
    if not polygons:
        return Polygon()
    # By its lines: the structure of an outline that runs back along itself is told by rounding.
    parts = shapely.get_parts(shapely.get_parts(shapely.make_valid(polygons)))
    return shapely.union_all(parts[shapely.get_dimensions(parts) == 2])  # a line is no area


def _polygons(geometry: BaseGeometry) -> list[Polygon]:
    """The polygons in `geometry`; what has no area, as stray points and lines, is left out."""
    parts = shapely.get_parts(geometry)
    return [p for p in parts if isinstance(p, Polygon) and not p.is_empty]


def _without_holes(polygon: Polygon) -> list[Polygon]:
    """Cut `polygon` through its holes, the middle one first, until no piece has one."""
    if not polygon.interiors:
        return [polygon]
    left, bottom, right, top = polygon.bounds
    middles = sorted((hole.bounds[0] + hole.bounds[2]) / 2 for hole in polygon.interiors)
    middle = middles[len(middles) // 2]
    # Not clip_by_rect, which is faster: it leaves pieces that touch themselves.
    halves = (box(left, bottom, middle, top), box(middle, bottom, right, top))
    cut = [part for half in halves for part in _polygons(shapely.intersection(polygon, half))]
    return [piece for part in cut for piece in _without_holes(part)]
