"""Walls that end at another wall: where a partition reaches the wall behind, it ends at its face.

Corners join ends with ends. An end that meets none, and that stops just short of another wall's
face or goes through it by no more than noise, is moved along its own line to that face.
"""

import numpy as np
import shapely
from pydantic import Field
from shapely.geometry.base import BaseGeometry

from mapweave.geometry.arrays import BoolArray, FloatArray
from mapweave.geometry.segments import cross, units
from mapweave.kernels.lines.evidence import near_points
from mapweave.lines.corner_junctions import length_inside
from mapweave.parameters import StageParameters, derived


class WallEndParameters(StageParameters):
    """Which ends are at a wall."""

    max_extension: float = Field(0.2, ge=0, description="[m] by which a wall may grow to another")
    max_overhang: float = derived(
        lambda c: 6 * c.sensor.range_sigma,
        ge=0,
        description="[m] of it behind the other to be cut off",
    )
    min_angle: float = Field(
        np.deg2rad(30.0), gt=0, description="[rad] between both; flatter, no face is met"
    )
    max_crossing: float = derived(
        lambda c: 5 * c.sensor.range_sigma,
        ge=0,
        description="[m] of free space that noise may explain",
    )
    meeting: float = Field(1e-6, gt=0, description="[m] within which an end has met another end")


def meet_walls(
    segments: FloatArray, free: BaseGeometry, parameters: WallEndParameters
) -> FloatArray:
    """Return (n, 4) `segments` [m] with their loose ends at the walls that they nearly reach.

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], the visible side on the left.
    free
        What was seen through, the same frame [m]: no wall grows into it.
    parameters
        Which ends are at a wall.
    """
    if len(segments) < 2:
        return segments
    p = parameters
    ends = segments.reshape(-1, 2)
    directions, lengths = units(segments)
    reach = max(p.max_extension, p.max_overhang)
    tree = shapely.STRtree(shapely.linestrings(segments.reshape(-1, 2, 2)))
    end, wall = tree.query(shapely.points(ends), predicate="dwithin", distance=reach)
    outward = np.stack([-directions, directions], axis=1).reshape(-1, 2)[end]
    gap = segments[wall, :2] - ends[end]
    sine = cross(outward, directions[wall])
    steep = np.abs(sine) >= np.sin(p.min_angle)
    safe = np.where(steep, sine, 1.0)
    grown, place = cross(gap, directions[wall]) / safe, cross(gap, outward) / safe
    possible = steep & _is_loose(ends, p.meeting)[end] & (end // 2 != wall)
    possible &= (place >= 0) & (place <= lengths[wall]) & (grown <= p.max_extension)
    possible &= (-grown <= p.max_overhang) & (-grown <= lengths[end // 2] / 2)
    point = ends[end] + grown[:, None] * outward
    possible[possible] = (
        length_inside(np.stack([ends[end], point], axis=1)[possible], free) <= p.max_crossing
    )
    kept = np.flatnonzero(possible)
    kept = kept[np.argsort(-np.abs(grown[kept]), kind="stable")]  # of several, the nearest is last
    moved = ends.copy()
    moved[end[kept]] = point[kept]
    return moved.reshape(-1, 4)


def _is_loose(ends: FloatArray, meeting: float) -> BoolArray:
    """Return (k,) which of the ends meet no other end."""
    end, _ = near_points(ends, ends, meeting)
    return np.asarray(np.bincount(end, minlength=len(ends)) == 1)  # itself
