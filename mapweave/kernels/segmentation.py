"""A scan's returns to line segments, and to oriented points on the surfaces that they are of."""

import math
from itertools import pairwise
from typing import NamedTuple, cast

import numpy as np

from mapweave.kernels.loading import COMPILED
from mapweave.kernels.point_map import Bools, Floats, Ints

Oriented = tuple[Floats, Floats, Ints]  # (n, 2) points, (n, 2) normals, (n,) segments or -1


class SegmentationSettings(NamedTuple):
    """See `mapweave.scan.segmentation.SegmentationParameters`, in the same order."""

    max_range: float
    max_jump: float
    grazing: float
    tolerance: float
    relative_tolerance: float
    min_points: int
    min_length: float


def extract_segments(
    angles: Floats, ranges: Floats, settings: SegmentationSettings
) -> tuple[Floats, Ints]:
    """Return (n, 4) segments [m], sensor frame, in beam order, and (beams,) whose each return is.

    Parameters
    ----------
    angles
        (beams,) ascending [rad].
    ranges
        (beams,) [m]; NaN where nothing came back.
    """
    if COMPILED is None:
        return extract_segments_numpy(angles, ranges, settings)
    chosen = COMPILED.SegmentationSettings(*settings)
    return cast("tuple[Floats, Ints]", COMPILED.extract_segments(angles, ranges, chosen))


def orient(
    angles: Floats,
    ranges: Floats,
    segments: Floats,
    label: Ints,
    max_range: float,
    max_gap: float,
    spacing: float,
) -> tuple[Oriented, Oriented]:
    """Return the oriented points of the returns, and those between them on each segment.

    A return on a segment takes the segment's normal; another, its neighbours'. Returns without
    a neighbour near enough have no direction and are left out.

    Parameters
    ----------
    angles, ranges
        As of `extract_segments`.
    segments, label
        (n, 4) and (beams,), what that returns.
    max_range
        [m] farther returns are left out.
    max_gap
        [m] two returns farther apart do not tell a surface's direction.
    spacing
        [m] that two neighbouring points on a segment are apart at the most, returns included.
    """
    compute = orient_numpy if COMPILED is None else COMPILED.orient
    found = compute(angles, ranges, segments, label, max_range, max_gap, spacing)
    return cast("tuple[Oriented, Oriented]", found)


def extract_segments_numpy(
    angles: Floats, ranges: Floats, settings: SegmentationSettings
) -> tuple[Floats, Ints]:
    """Twin of `extract_segments`: split and merge."""
    p = settings
    if len(angles) != len(ranges):
        raise ValueError("angles and ranges: as many of each expected")
    with np.errstate(invalid="ignore"):
        used = np.flatnonzero(np.isfinite(ranges) & (ranges <= p.max_range))
    points = _ends(angles[used], ranges[used])
    label = np.full(len(ranges), -1)
    tolerance = p.tolerance + p.relative_tolerance * ranges[used]
    segments: list[Floats] = []
    for first, last in _runs(_breaks(angles[used], ranges[used], used, points, p), len(used)):
        pieces = _straight_pieces(points, tolerance, first, last)
        pieces = [(a, b) for a, b in pieces if b - a >= p.min_points]
        for a, b in _merged_pieces(points, tolerance, pieces):
            segment = fit_segment(points[a:b])
            if np.hypot(*(segment[2:] - segment[:2])) >= p.min_length:
                label[used[a:b]] = len(segments)
                segments.append(segment)
    return np.array(segments).reshape(-1, 4), label


def fit_segment(points: Floats) -> Floats:
    """Return the (4,) total-least-squares segment of (k, 2) `points`, along their order."""
    centre, direction = _fit_line(points)
    along = (points - centre) @ direction
    return np.concatenate([centre + along.min() * direction, centre + along.max() * direction])


def orient_numpy(
    angles: Floats,
    ranges: Floats,
    segments: Floats,
    label: Ints,
    max_range: float,
    max_gap: float,
    spacing: float,
) -> tuple[Oriented, Oriented]:
    """Twin of `orient`."""
    if not len(angles) == len(ranges) == len(label):
        raise ValueError("angles, ranges and label: as many of each, segments (n, 4) expected")
    with np.errstate(invalid="ignore"):
        used = np.flatnonzero(np.isfinite(ranges) & (ranges <= max_range))
    points, on = _ends(angles[used], ranges[used]), label[used]
    along = segments[:, 2:] - segments[:, :2]
    return _of_returns(points, on, along, max_gap), _between(points, on, along, spacing)


def _of_returns(points: Floats, on: Ints, along: Floats, max_gap: float) -> Oriented:
    if len(points) < 2:
        return np.empty((0, 2)), np.empty((0, 2)), np.empty(0, dtype=np.int64)
    forward = np.vstack([np.diff(points, axis=0), np.zeros((1, 2))])
    forward[np.hypot(*forward.T) > max_gap] = 0
    directions = forward + np.vstack([np.zeros((1, 2)), forward[:-1]])
    directions[on >= 0] = along[on[on >= 0]]
    told = np.hypot(*directions.T) > 0
    return points[told], _left(directions[told]), on[told]


def _between(points: Floats, on: Ints, along: Floats, spacing: float) -> Oriented:
    points, on = points[on >= 0], on[on >= 0]
    step = np.diff(points, axis=0)
    count = np.maximum(0, np.ceil(np.hypot(*step.T) / spacing).astype(np.int64) - 1)
    count[on[1:] != on[:-1]] = 0
    owner = np.repeat(np.arange(len(count)), count)
    rank = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    fraction = (rank + 1) / (count[owner] + 1)
    return points[owner] + fraction[:, None] * step[owner], _left(along[on[owner]]), on[owner]


def _left(directions: Floats) -> Floats:
    """Return (n, 2) unit normals on the left, the visible side, of (n, 2) `directions`."""
    lengths = np.maximum(np.hypot(directions[:, 0], directions[:, 1]), 1e-12)
    return np.asarray(np.column_stack([-directions[:, 1], directions[:, 0]]) / lengths[:, None])


def _ends(angles: Floats, ranges: Floats) -> Floats:
    """(n, 2) where beams ended [m]."""
    return np.asarray(ranges[:, None] * np.column_stack([np.cos(angles), np.sin(angles)]))


def _fit_line(points: Floats) -> tuple[Floats, Floats]:
    """Centre (2,) and unit direction (2,) of the line of least squares across `points`."""
    centre: Floats = points.sum(axis=0) / len(points)
    offsets = points - centre
    (xx, xy), (_, yy) = (offsets.T @ offsets).tolist()
    angle = 0.5 * math.atan2(2 * xy, xx - yy)  # the major axis of the scatter matrix
    direction = np.array([math.cos(angle), math.sin(angle)])
    return centre, -direction if direction @ (points[-1] - points[0]) < 0 else direction


def _breaks(
    angles: Floats, ranges: Floats, beam: Ints, points: Floats, p: SegmentationSettings
) -> Bools:
    """(m - 1,) where one surface ends: consecutive returns too far apart."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    nearer = np.minimum(ranges[1:], ranges[:-1])
    limit = np.maximum(p.max_jump, nearer * np.diff(angles) / np.sin(p.grazing))
    far = steps > np.minimum(limit, 4 * p.max_jump)
    return np.asarray(far | (np.diff(beam) > 3), dtype=np.bool_)


def _runs(breaks: Bools, count: int) -> list[tuple[int, int]]:
    """Half-open index ranges between breaks."""
    if count == 0:
        return []
    edges = [0, *(np.flatnonzero(breaks) + 1).tolist(), count]
    return list(pairwise(edges))


def _straight_pieces(
    points: Floats, tolerance: Floats, first: int, last: int
) -> list[tuple[int, int]]:
    """Split [first, last) at the return farthest from the chord until all are straight."""
    pieces: list[tuple[int, int]] = []
    stack = [(first, last)]
    while stack:
        a, b = stack.pop()
        if b - a <= 2:
            pieces.append((a, b))
            continue
        chord = points[b - 1] - points[a]
        offsets = points[a:b] - points[a]
        length = max(float(np.hypot(*chord)), 1e-9)
        deviation = np.abs(chord[0] * offsets[:, 1] - chord[1] * offsets[:, 0]) / length
        excess = deviation / tolerance[a:b]
        worst = int(excess.argmax())
        if excess[worst] <= 1 or worst in (0, b - a - 1):
            pieces.append((a, b))
        else:
            # The corner belongs to both sides, so that polylines stay connected there.
            stack.append((a + worst, b))
            stack.append((a, a + worst + 1))
    return sorted(pieces)


def _merged_pieces(
    points: Floats, tolerance: Floats, pieces: list[tuple[int, int]]
) -> list[tuple[int, int]]:
    """Merge pieces that share a corner and are straight together.

    A chord runs between two single returns; with those in error a straight wall was split.
    """
    merged = pieces[:1]
    for a, b in pieces[1:]:
        first = merged[-1][0]
        touches = a < merged[-1][1]
        if touches and _is_straight(points[first:b], tolerance[first:b]):
            merged[-1] = (first, b)
        else:
            merged.append((a, b))
    return merged


def _is_straight(points: Floats, tolerance: Floats) -> bool:
    """Whether all (k, 2) `points` lie within (k,) `tolerance` [m] of the line that fits best."""
    centre, (x, y) = _fit_line(points)
    return bool((np.abs((points - centre) @ np.array([-y, x])) <= tolerance).all())
