"""Areas with holes: straightened and snapped to a grid, and cut open; what loads shapely."""

from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.scan.free_space import from_rings, rings, simplified

FINE = 1e-6  # of the unit of the polygons


def straightened(
    outlines: Sequence[FloatArray], depth: float, deviation: float
) -> tuple[tuple[IntArray, ...], ...]:
    """Return the areas that simple polygons (k, 2) cover, their corners on whole numbers.

    Parameters
    ----------
    depth
        What is nowhere that deep is left out, such as a tongue between two beams.
    deviation
        By which an outline may be straightened, in the unit of the polygons.

    Returns
    -------
    tuple of tuple of IntArray
        Of each area the outside, then its holes, each (k, 2).
    """
    area = from_rings(outlines)
    # GEOS divides by nothing at some corners of a mitre, and goes on with what is right.
    with np.errstate(invalid="ignore", divide="ignore"):
        deep = shapely.buffer(area, -depth, join_style="mitre")
        sharp = shapely.buffer(deep, depth, join_style="mitre", mitre_limit=2.0)
    # Where it tapers, a mitre goes beyond it. On a grid: without one GEOS 3.14.1 fills, of areas
    # that share most of their outline, a hole here and there, and each is valid.
    wide = shapely.intersection(_valid(sharp), area, grid_size=FINE)
    simple = _valid(simplified(wide, deviation))
    whole = shapely.simplify(shapely.set_precision(simple, 1.0), 0.0)
    areas = [p for p in shapely.get_parts(whole) if isinstance(p, Polygon) and not p.is_empty]
    return tuple(
        tuple(_corners(ring) for ring in (area.exterior, *area.interiors)) for area in areas
    )


def cut_open(outside: IntArray, holes: Sequence[IntArray]) -> tuple[FloatArray, ...]:
    """Return simple polygons without holes that cover an area (k, 2) without its `holes`.

    Raises
    ------
    ValueError
        If it is no area: its outlines cross.
    """
    area = Polygon(outside, holes)
    if not area.is_valid:
        raise ValueError("an area whose outlines cross")
    return rings(area)


def _valid(areas: BaseGeometry) -> BaseGeometry:
    """Return `areas`; what lies twice in them, as mitred or simplified parts may, only once."""
    if areas.is_valid:
        return areas
    return shapely.make_valid(areas, method="structure", keep_collapsed=False)


def _corners(ring: shapely.LinearRing) -> IntArray:
    return np.asarray(np.rint(np.array(ring.coords)[:-1]), dtype=np.int64)
