"""Polygons as their edges, which is what points and paths are looked up in."""

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from mapweave.geometry.arrays import FloatArray


def edges_of(polygons: BaseGeometry) -> FloatArray:
    """Return (k, 4) x1 y1 x2 y2 of all rings of `polygons`, of holes as well."""
    parts = shapely.get_parts(polygons)
    rings = shapely.get_rings(parts[shapely.get_type_id(parts) == shapely.GeometryType.POLYGON])
    points, ring = shapely.get_coordinates(rings, return_index=True)
    edges: FloatArray = np.hstack([points[:-1], points[1:]])[np.diff(ring) == 0]
    return np.ascontiguousarray(edges)
