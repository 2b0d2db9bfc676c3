"""The free space that was seen: polygons in which no wall can be.

Matched wall alone accepts look-alike corridors; a wall of one map inside what the other saw
through refutes them. So a map carries its free space.
"""

from collections.abc import Iterable

import numpy as np
import shapely
from pydantic import Field
from shapely.geometry import MultiPolygon, Polygon, box
from shapely.geometry.base import BaseGeometry

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.parameters import StageParameters, derived
from mapweave.scan.scan import Scan
from mapweave.scan.visibility import clear_ranges


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
    simplification: float = Field(
        0.1, gt=0, description="[m] by which outlines may deviate; below the margin"
    )
    min_width: float = Field(0.25, ge=0, description="[m] narrower streaks are left out")
    min_area: float = Field(0.1, ge=0, description="[m²] smaller pieces are not worth sending")


def scan_free_space(scan: Scan, pose: FloatArray, parameters: FreeSpaceParameters) -> BaseGeometry:
    """Return what a scan saw to be free.

    Parameters
    ----------
    scan
        One sweep.
    pose
        (3,) of the sensor [m, m, rad].
    parameters
        How far and how surely a scan clears space.

    Returns
    -------
    BaseGeometry
        An area [m] in the frame that `pose` is given in; empty where nothing was cleared.
    """
    reach = np.maximum(clear_ranges(scan, parameters.sight) - parameters.margin, 0.0)
    rim = reach[:, None] * np.column_stack([np.cos(scan.angles), np.sin(scan.angles)])
    fans = [
        Polygon(np.vstack([np.zeros(2), rim[first:last]]))
        for first, last in _positive_runs(reach)
        if last - first >= 2
    ]
    sight = shapely.union_all(shapely.make_valid(fans)) if fans else Polygon()
    placed = shapely.transform(sight, lambda points: se2.transform_points(pose, points))
    return shapely.simplify(placed, parameters.simplification / 2)


def unite(pieces: Iterable[BaseGeometry], parameters: FreeSpaceParameters) -> BaseGeometry:
    """Return the union of `pieces`, its outline simplified, crumbs left out.

    Parameters
    ----------
    pieces
        Areas in one frame [m], such as those of several scans.
    parameters
        How much an outline is simplified, and what is a crumb.
    """
    union = shapely.union_all(list(pieces))
    # Opened: a view through a crack clears nothing that would matter, and costs many vertices.
    if union.is_empty:
        return union
    width = parameters.min_width / 2
    with np.errstate(invalid="ignore", divide="ignore"):  # GEOS mitres corners of no width at all
        opened = union.buffer(-width, join_style="mitre").buffer(width, join_style="mitre")
    union = shapely.simplify(opened, parameters.simplification)
    return MultiPolygon([p for p in _polygons(union) if p.area >= parameters.min_area])


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
    return shapely.union_all(shapely.make_valid(polygons)) if polygons else Polygon()


def _positive_runs(reach: FloatArray) -> list[tuple[int, int]]:
    """Half-open ranges of consecutive beams that cleared anything."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], reach > 0, [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _polygons(geometry: BaseGeometry) -> list[Polygon]:
    """The polygons in `geometry`; what has no area, as stray points and lines, is left out."""
    parts = shapely.get_parts(geometry)
    return [p for p in parts if isinstance(p, Polygon) and not p.is_empty]


def _without_holes(polygon: Polygon) -> list[Polygon]:
    """Cut `polygon` through its first hole until no piece has one."""
    if not polygon.interiors:
        return [polygon]
    left, bottom, right, top = polygon.bounds
    hole_left, _, hole_right, _ = polygon.interiors[0].bounds
    middle = (hole_left + hole_right) / 2
    halves = (box(left, bottom, middle, top), box(middle, bottom, right, top))
    cut = [part for half in halves for part in _polygons(shapely.intersection(polygon, half))]
    return [piece for part in cut for piece in _without_holes(part)]
