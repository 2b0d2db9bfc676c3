"""Where a segment lies best: on the evidence around it, and no farther than that reaches.

Merging averages what it merges (paper, VII). Here segments are fitted to all that was seen about
them at once, by least squares, and cut where the same face is rather somewhere else, close by: a
wall that is bent, or was seen twice at different places.
"""

import numpy as np
from pydantic import Field
from shapely.geometry.base import BaseGeometry

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.geometry.polygons import edges_of
from mapweave.geometry.segments import units
from mapweave.kernels.polygons import depths
from mapweave.lines.directions import line_difference, nearest_direction
from mapweave.lines.sightings import Nearness, Sightings
from mapweave.parameters import StageParameters, derived


class FittingParameters(StageParameters):
    """What belongs to a segment, and where it ends."""

    tolerance: float = derived(
        lambda c: 4.5 * c.sensor.range_sigma,
        gt=0,
        description="[m] to either side, what is of the segment's surface",
    )
    shadow: float = Field(0.3, gt=0, description="[m] to either side, where it might be instead")
    parallel: float = Field(
        np.deg2rad(30.0), gt=0, description="[rad] within which the same face is meant"
    )
    reach: float = Field(0.3, ge=0, description="[m] beyond its ends, what a fit may take up")
    station: float = Field(0.1, gt=0, description="[m] of a segment that is kept or cut as one")
    max_hole: float = derived(
        lambda c: 0.5 * c.mapping.door,
        ge=0,
        description="[m] without evidence that a segment bridges; half a narrow door",
    )
    rounds: int = Field(1, ge=0, description="of fitting")
    opening_depth: float = Field(
        0.15, gt=0, description="[m] inside what was seen through, where a wall is doubted"
    )
    opening_share: float = Field(
        0.2,
        ge=0,
        le=1,
        description="of what a segment shows at its median; with less, what was seen through is"
        " an opening",
    )


def fit(segments: FloatArray, evidence: Sightings, parameters: FittingParameters) -> FloatArray:
    """Return `segments` where the evidence about them is, by least squares across.

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], the visible side on the left.
    evidence
        What was seen, the same frame.
    parameters
        What of it belongs to a segment.

    Returns
    -------
    FloatArray
        (n, 4) [m], in the order given; one without evidence stays where it was.
    """
    for _ in range(parameters.rounds):
        segments = _fit_once(segments, evidence, parameters)
    return segments


def follow(
    segments: FloatArray, directions: FloatArray, tolerance: float, max_shift: float
) -> FloatArray:
    """Return (n, 4) `segments` [m] turned about their middle to the main direction (paper, VI-A).

    An oblique wall stays oblique.

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m].
    directions
        (k,) the main directions [rad], modulo pi.
    tolerance
        [rad] by which a segment may be turned.
    max_shift
        [m] by which that may move its ends.
    """
    ahead, lengths = units(segments)
    angle = np.arctan2(ahead[:, 1], ahead[:, 0])
    turn = line_difference(nearest_direction(angle, directions, tolerance), angle)
    followed = lengths / 2 * np.abs(np.sin(turn)) <= max_shift  # never where there is none: NaN
    new = angle + np.where(followed, turn, 0.0)
    half = (lengths / 2)[:, None] * np.column_stack([np.cos(new), np.sin(new)])
    middle = (segments[:, :2] + segments[:, 2:]) / 2
    return np.where(followed[:, None], np.hstack([middle - half, middle + half]), segments)


def cut(
    segments: FloatArray, evidence: Sightings, free: BaseGeometry, parameters: FittingParameters
) -> FloatArray:
    """Return (m, 4) the parts of `segments` [m] on which more evidence lies than close beside.

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], the visible side on the left.
    evidence
        What was seen, the same frame.
    free
        What was seen through [m]; there little evidence is none: an open door.
    parameters
        What belongs to a segment, and where it ends.
    """
    p = parameters
    near = Nearness.of(segments, evidence.points, evidence.directions, p.shadow)
    same = _same_face(near, segments, 0.0, p)
    first = _first_stations(segments, p)
    place = (first[near.segment] + np.floor(near.along / p.station).astype(np.int64))[same]
    on = np.abs(near.across[same]) <= p.tolerance
    weight = evidence.weights[near.sample[same]]
    balance = np.bincount(place, np.where(on, weight, -weight), minlength=first[-1])
    shown = np.bincount(place, np.where(on, weight, 0.0), minlength=first[-1]).astype(np.float64)
    found = np.flatnonzero(balance > 0)
    segment = np.searchsorted(first, found, side="right") - 1
    station = found - first[segment]
    wall = ~_is_opening(segments, segment, station, shown[found], free, p)
    return _runs(segments, segment[wall], station[wall], p)


def _first_stations(segments: FloatArray, p: FittingParameters) -> IntArray:
    """(n + 1,) the number of the first station of each of (n, 4) `segments`, and of all."""
    counts = np.floor(units(segments)[1] / p.station).astype(np.int64) + 1
    return np.concatenate([[0], np.cumsum(counts)])


def trim(
    segments: FloatArray,
    near: Nearness,
    explains: BoolArray,
    settles: BoolArray,
    evidence: Sightings,
) -> FloatArray:
    """Return (n, 4) `segments` [m] without the ends on which nothing lies that is theirs alone.

    What several settle is the first one's.

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m].
    near
        k pairs of these segments and samples of the evidence.
    explains, settles
        (k,) which pairs are of a segment and what it explains, or what it leaves nothing to
        explain of.
    evidence
        What was seen, the same frame.
    """
    first = np.full(len(evidence), len(segments))
    np.minimum.at(first, near.sample[settles], near.segment[settles])
    own = explains & (first[near.sample] == near.segment)
    along, owner = near.along[own], near.segment[own]
    directions, lengths = units(segments)
    low, high = np.full(len(segments), np.inf), np.full(len(segments), -np.inf)
    np.minimum.at(low, owner, along - evidence.spacing / 2)
    np.maximum.at(high, owner, along + evidence.spacing / 2)
    low = np.clip(low, 0.0, lengths)[:, None]
    high = np.maximum(np.clip(high, 0.0, lengths)[:, None], low)
    start = segments[:, :2]
    return np.hstack([start + low * directions, start + high * directions])


def _is_opening(
    segments: FloatArray,
    segment: IntArray,
    station: IntArray,
    shown: FloatArray,
    free: BaseGeometry,
    p: FittingParameters,
) -> BoolArray:
    """Return (k,) at which stations there is a hole: seen through, and little is `shown` there.

    Far along a wall the returns are so far apart that a scan draws the wall across an open door.
    """
    weak = shown < p.opening_share * _medians(segment, shown)[segment]
    directions, _ = units(segments[segment[weak]])
    places = segments[segment[weak], :2] + ((station[weak] + 0.5) * p.station)[:, None] * directions
    opening = np.zeros(len(segment), dtype=np.bool_)
    opening[weak] = depths(places, edges_of(free), 2 * p.opening_depth) > p.opening_depth
    return opening


def _medians(group: IntArray, values: FloatArray) -> FloatArray:
    """(g,) the median of the (n,) `values` of each (n,) `group`; 0 for one without."""
    ascending = values[np.lexsort((values, group))]
    count = np.bincount(group)
    start, known = np.cumsum(count) - count, np.flatnonzero(count)
    medians = np.zeros(len(count))
    low, high = (start + half for half in ((count - 1) // 2, count // 2))
    medians[known] = (ascending[low[known]] + ascending[high[known]]) / 2
    return medians


def _runs(
    segments: FloatArray, segment: IntArray, station: IntArray, p: FittingParameters
) -> FloatArray:
    """Return the parts of `segments` with kept stations, ascending, and no wide hole."""
    if not len(segment):
        return np.empty((0, 4))
    holes = (np.diff(station) - 1) * p.station > p.max_hole + 1e-9
    first = np.concatenate([[True], (np.diff(segment) > 0) | holes])
    last = np.concatenate([first[1:], [True]])
    owner = segment[first]
    directions, lengths = units(segments[owner])
    low = station[first] * p.station
    high = np.minimum((station[last] + 1) * p.station, lengths)
    start = segments[owner, :2]
    return np.hstack([start + low[:, None] * directions, start + high[:, None] * directions])


def _fit_once(segments: FloatArray, evidence: Sightings, p: FittingParameters) -> FloatArray:
    near = Nearness.of(segments, evidence.points, evidence.directions, max(p.tolerance, p.reach))
    used = _same_face(near, segments, p.reach, p) & (np.abs(near.across) <= p.tolerance)
    owner, points = near.segment[used], evidence.points[near.sample[used]]
    weight = evidence.weights[near.sample[used]]
    n = len(segments)
    mass = np.bincount(owner, weight, minlength=n)
    known = mass > 0
    total = np.where(known, mass, 1.0)
    sums = np.column_stack([np.bincount(owner, weight * x, minlength=n) for x in points.T])
    middle = sums / total[:, None]
    direction = _major_axes(points - middle[owner], weight, owner, segments)
    along = ((points - middle[owner]) * direction[owner]).sum(axis=1)
    low, high = np.full(n, np.inf), np.full(n, -np.inf)
    np.minimum.at(low, owner, along)
    np.maximum.at(high, owner, along)
    seen = high > low
    low, high = np.where(seen, low, 0.0)[:, None], np.where(seen, high, 0.0)[:, None]
    half = evidence.spacing / 2
    ends = [middle + (low - half) * direction, middle + (high + half) * direction]
    return np.where((seen & known)[:, None], np.hstack(ends), segments)


def _major_axes(
    offsets: FloatArray, weight: FloatArray, owner: IntArray, segments: FloatArray
) -> FloatArray:
    """Return (n, 2) unit vectors of the most scatter, directed as `segments`."""
    n = len(segments)
    (x, y) = offsets.T
    xx, xy, yy = (np.bincount(owner, weight * s, minlength=n) for s in (x * x, x * y, y * y))
    angle = 0.5 * np.arctan2(2 * xy, xx - yy)
    axis = np.column_stack([np.cos(angle), np.sin(angle)])
    directions, _ = units(segments)
    return np.where((axis * directions).sum(axis=1)[:, None] < 0, -axis, axis)


def _same_face(
    near: Nearness, segments: FloatArray, reach: float, p: FittingParameters
) -> BoolArray:
    """Return (k,) which samples lie beside the segment or at most `reach` [m] beyond its ends."""
    _, lengths = units(segments)
    beside = (near.along >= -reach) & (near.along <= lengths[near.segment] + reach)
    return np.asarray(beside & (near.cosine >= np.cos(p.parallel)))
