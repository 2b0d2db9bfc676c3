"""Walls that meet: ends moved to where two lines cross.

Noise leaves the ends of neighbouring walls some centimetres apart. Where one wall's end and the
next one's start are that close, both end where their lines meet, unless space that was seen
through lies between. The order is that of the visible side: going along a wall with what can be
seen on the left, the next wall begins where this one ends.
"""

from dataclasses import dataclass

import numpy as np
from pydantic import Field
from shapely.geometry.base import BaseGeometry

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.geometry.polygons import edges_of
from mapweave.geometry.segments import cross, units
from mapweave.kernels.lines.evidence import near_points
from mapweave.kernels.polygons import lengths_inside
from mapweave.parameters import StageParameters, derived


class JoiningParameters(StageParameters):
    """Which ends meet."""

    reach: float = Field(0.5, gt=0, description="[m] between ends that may meet")
    max_extension: float = Field(0.3, ge=0, description="[m] by which a wall may grow to meet")
    max_overhang: float = derived(
        lambda c: 6 * c.sensor.range_sigma,
        ge=0,
        description="[m] that an end may stand out of the other wall to be cut off",
    )
    min_angle: float = Field(
        np.deg2rad(3.0), gt=0, description="[rad] below it lines cross anywhere: ends meet halfway"
    )
    max_shift: float = derived(
        lambda c: 1.5 * c.sensor.range_sigma,
        ge=0,
        description="[m] by which an end may move sideways",
    )
    max_crossing: float = derived(
        lambda c: 5 * c.sensor.range_sigma,
        ge=0,
        description="[m] of free space that noise may explain",
    )
    min_length: float = Field(0.1, gt=0, description="[m] below which no wall is cut")


@dataclass(frozen=True, slots=True, eq=False)
class _Meetings:
    """Pairs of a segment and the one that follows, and where they meet; (k,), (k, 2), (k,)."""

    segment: IntArray
    follower: IntArray
    point: FloatArray
    cost: FloatArray


def join_corners(
    segments: FloatArray, free: BaseGeometry, parameters: JoiningParameters
) -> FloatArray:
    """Return (n, 4) `segments` [m] with ends that meet where they nearly did.

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], the visible side on the left.
    free
        What was seen through, the same frame [m]: no wall grows into it.
    parameters
        Which ends meet.
    """
    found = _meetings(segments, parameters)
    open_ = _is_open(segments, found, free, parameters.max_crossing)
    chosen = _cheapest(found, np.flatnonzero(open_))
    joined = segments.copy()
    joined[found.segment[chosen], 2:] = found.point[chosen]
    joined[found.follower[chosen], :2] = found.point[chosen]
    return joined


def _meetings(segments: FloatArray, p: JoiningParameters) -> _Meetings:
    """Return where the ends of segments could meet the starts of others."""
    a, b = neighbours(segments, p.reach)
    directions, lengths = units(segments)
    u, v = directions[a], directions[b]
    gap = segments[b, :2] - segments[a, 2:]
    sine = cross(u, v)
    crosses = np.abs(sine) >= np.sin(p.min_angle)
    safe = np.where(crosses, sine, 1.0)
    # How far the segment grows ahead, and the follower back, to where their lines cross.
    ahead, back = cross(gap, v) / safe, -cross(gap, u) / safe
    crosses &= _fits(ahead, sine, lengths[a], p) & _fits(back, sine, lengths[b], p)
    halfway = np.maximum(np.abs(cross(gap, u)), np.abs(cross(gap, v))) / 2 <= p.max_shift
    halfway &= (np.hypot(*gap.T) / 2 <= p.max_extension) & ((u * v).sum(axis=1) > 0)
    move = np.where(crosses[:, None], ahead[:, None] * u, gap / 2)
    cost = np.hypot(*move.T) + np.hypot(*(gap - move).T)
    kept = np.flatnonzero(crosses | halfway)
    return _Meetings(a[kept], b[kept], (segments[a, 2:] + move)[kept], cost[kept])


def _fits(
    grown: FloatArray, sine: FloatArray, length: FloatArray, p: JoiningParameters
) -> BoolArray:
    """Return (k,) whether an end may move by `grown` [m], the other wall turned by `sine`."""
    overhang = np.maximum(-grown, 0.0)
    fits = (grown <= p.max_extension) & (overhang * np.abs(sine) <= p.max_overhang)
    return np.asarray(fits & (overhang <= np.maximum(length - p.min_length, 0.0) / 2))


def _is_open(
    segments: FloatArray, found: _Meetings, free: BaseGeometry, max_crossing: float
) -> BoolArray:
    """Return (k,) whether nothing that was seen through lies between the ends."""
    path = np.stack(
        [segments[found.segment, 2:], found.point, segments[found.follower, :2]], axis=1
    )
    return np.asarray(length_inside(path, free) <= max_crossing)


def length_inside(paths: FloatArray, free: BaseGeometry) -> FloatArray:
    """Return how much of each path lies in `free`.

    Parameters
    ----------
    paths
        (k, j, 2) the vertices of k paths [m].
    free
        An area, the same frame [m].

    Returns
    -------
    FloatArray
        (k,) [m].
    """
    return lengths_inside(paths, edges_of(free)) if len(paths) else np.empty(0)


def _cheapest(found: _Meetings, allowed: IntArray) -> IntArray:
    """Return which meetings to make, each end once, the shortest way first."""
    ended: set[int] = set()
    begun: set[int] = set()
    chosen: list[int] = []
    for k in allowed[np.argsort(found.cost[allowed], kind="stable")].tolist():
        a, b = int(found.segment[k]), int(found.follower[k])
        if a not in ended and b not in begun:
            ended.add(a)
            begun.add(b)
            chosen.append(k)
    return np.array(chosen, dtype=np.int64)


def neighbours(segments: FloatArray, reach: float) -> tuple[IntArray, IntArray]:
    """Return pairs of segments, the end of the one close to the start of the other.

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m].
    reach
        [m] from the end to the start at most.

    Returns
    -------
    tuple of IntArray
        (k,) the segment that ends there, and (k,) that which starts.
    """
    a, b = near_points(segments[:, 2:], segments[:, :2], reach)
    return a[a != b], b[a != b]
