"""Scan to line segments, directed so that the visible side is known (paper, V).

Split and merge: consecutive returns are cut into runs where the range jumps, each run is split
at its farthest point until it is straight, neighbouring pieces that one line explains are merged
again, and every piece is fitted by total least squares. Beams run counter-clockwise, so a segment
in beam order has the sensor, and with it the visible side, on its left.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from pydantic import Field

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.parameters import StageParameters, derived
from mapweave.scan.scan import Scan


class SegmentationParameters(StageParameters):
    """How returns become segments."""

    max_range: float = derived(
        lambda c: 1.2 * c.mapping.far_range,
        gt=0,
        description="[m] farther returns are left out: their spacing hides the shape",
    )
    max_jump: float = Field(
        0.25, gt=0, description="[m] between neighbouring returns of one surface, at close range"
    )
    grazing: float = Field(
        0.12,
        gt=0,
        description="[rad] flattest angle at which a beam still meets a surface: neighbouring"
        " returns of one surface lie at most range x spacing / sin(grazing) apart",
    )
    tolerance: float = derived(
        lambda c: 2 * c.sensor.range_sigma,
        gt=0,
        description="[m] largest deviation of a return from its segment (SICK: 1-2 cm)",
    )
    relative_tolerance: float = Field(
        0.004, ge=0, description="[m/m] what the tolerance grows with range"
    )
    min_points: int = Field(3, ge=2, description="fewest returns of a segment")
    min_length: float = Field(0.1, ge=0, description="[m] shortest segment")


@dataclass(frozen=True, slots=True, eq=False)
class ScanSegments:
    """The segments of a scan.

    Attributes
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], sensor frame, in beam order, visible side on the left.
    label
        (beams,) index of the segment that each beam's return belongs to; -1 for none.
    """

    segments: FloatArray
    label: IntArray


def extract_segments(scan: Scan, parameters: SegmentationParameters | None = None) -> ScanSegments:
    """Approximate the returns of `scan` by directed line segments (paper, V, first step).

    Parameters
    ----------
    scan
        The scan; beams that did not come back belong to no segment.
    parameters
        How returns become segments.

    Returns
    -------
    ScanSegments
        In the sensor's frame [m], in beam order, with the segment of each beam.

    Examples
    --------
    >>> angles = np.linspace(-0.5, 0.5, 60)
    >>> wall = Scan(2 / np.cos(angles), angles)  # 2 m ahead, seen from the origin
    >>> extract_segments(wall).segments.round(2)
    array([[ 2.  , -1.09,  2.  ,  1.09]])
    """
    p = parameters or SegmentationParameters()
    with np.errstate(invalid="ignore"):
        used = np.flatnonzero(scan.hits & (scan.ranges <= p.max_range))
    label = np.full(len(scan.ranges), -1)
    points = scan.points[used]
    tolerance = p.tolerance + p.relative_tolerance * scan.ranges[used]
    segments: list[FloatArray] = []
    for first, last in _runs(_breaks(scan, used, points, p), len(used)):
        pieces = _straight_pieces(points, tolerance, first, last)
        pieces = [(a, b) for a, b in pieces if b - a >= p.min_points]
        for a, b in _merged_pieces(points, tolerance, pieces):
            segment = fit_segment(points[a:b])
            if np.hypot(*(segment[2:] - segment[:2])) >= p.min_length:
                label[used[a:b]] = len(segments)
                segments.append(segment)
    return ScanSegments(np.array(segments).reshape(-1, 4), label)


def fit_segment(points: FloatArray) -> FloatArray:
    """Return the segment that fits points best by total least squares.

    Parameters
    ----------
    points
        (k, 2) [m], k at least 2, in beam order.

    Returns
    -------
    FloatArray
        (4,) x1 y1 x2 y2 [m], directed as the points come.
    """
    centre, direction = _fit_line(points)
    along = (points - centre) @ direction
    return np.concatenate([centre + along.min() * direction, centre + along.max() * direction])


def _fit_line(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Centre (2,) and unit direction (2,) of the line of least squares across `points`."""
    centre: FloatArray = points.sum(axis=0) / len(points)
    offsets = points - centre
    (xx, xy), (_, yy) = (offsets.T @ offsets).tolist()
    angle = 0.5 * math.atan2(2 * xy, xx - yy)  # the major axis of the scatter matrix
    direction = np.array([math.cos(angle), math.sin(angle)])
    return centre, -direction if direction @ (points[-1] - points[0]) < 0 else direction


def _breaks(scan: Scan, used: IntArray, points: FloatArray, p: SegmentationParameters) -> BoolArray:
    """(m - 1,) where one surface ends: consecutive used returns too far apart."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    turn = np.diff(scan.angles[used])
    nearer = np.minimum(scan.ranges[used][1:], scan.ranges[used][:-1])
    limit = np.maximum(p.max_jump, nearer * turn / np.sin(p.grazing))
    skipped = np.diff(used) > 3
    broken: BoolArray = (steps > np.minimum(limit, 4 * p.max_jump)) | skipped
    return broken


def _runs(breaks: BoolArray, count: int) -> list[tuple[int, int]]:
    """Half-open index ranges between breaks."""
    if count == 0:
        return []
    edges = [0, *(np.flatnonzero(breaks) + 1).tolist(), count]
    return list(pairwise(edges))


def _straight_pieces(
    points: FloatArray, tolerance: FloatArray, first: int, last: int
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
    points: FloatArray, tolerance: FloatArray, pieces: list[tuple[int, int]]
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


def _is_straight(points: FloatArray, tolerance: FloatArray) -> bool:
    """Whether all (k, 2) `points` lie within (k,) `tolerance` [m] of the line that fits best."""
    centre, (x, y) = _fit_line(points)
    return bool((np.abs((points - centre) @ np.array([-y, x])) <= tolerance).all())
