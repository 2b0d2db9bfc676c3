"""Scan to line segments, directed so that the visible side is known (paper, V).

Split and merge: consecutive returns are cut into runs where the range jumps, each run is split
at its farthest point until it is straight, and every straight piece is fitted by total least
squares. Beams run counter-clockwise, so a segment in beam order has the sensor, and with it the
visible side, on its left.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave.arrays import BoolArray, FloatArray, IntArray
from mapweave.scan import Scan


class SegmentParameters(BaseModel):
    """How returns become segments."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    max_range: float = Field(
        30.0, gt=0, description="[m] farther returns are left out: their spacing hides the shape"
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
    tolerance: float = Field(
        0.04, gt=0, description="[m] largest deviation of a return from its segment (SICK: 1-2 cm)"
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


def extract_segments(scan: Scan, parameters: SegmentParameters | None = None) -> ScanSegments:
    """Approximate the returns of `scan` by directed line segments (paper, V, first step)."""
    p = parameters or SegmentParameters()
    with np.errstate(invalid="ignore"):
        used = np.flatnonzero(scan.hits & (scan.ranges <= p.max_range))
    label = np.full(len(scan.ranges), -1)
    points = scan.points[used]
    tolerance = p.tolerance + p.relative_tolerance * scan.ranges[used]
    segments: list[FloatArray] = []
    for first, last in _runs(_breaks(scan, used, points, p), len(used)):
        for a, b in _straight_pieces(points, tolerance, first, last):
            if b - a < p.min_points:
                continue
            segment = fit_segment(points[a:b])
            if np.hypot(*(segment[2:] - segment[:2])) >= p.min_length:
                label[used[a:b]] = len(segments)
                segments.append(segment)
    return ScanSegments(np.array(segments).reshape(-1, 4), label)


def fit_segment(points: FloatArray) -> FloatArray:
    """Return the (4,) total-least-squares segment of (k, 2) `points`, along their order."""
    centre = points.mean(axis=0)
    offsets = points - centre
    (xx, xy), (_, yy) = offsets.T @ offsets
    angle = 0.5 * np.arctan2(2 * xy, xx - yy)  # the major axis of the scatter matrix
    direction = np.array([np.cos(angle), np.sin(angle)])
    if direction @ (points[-1] - points[0]) < 0:
        direction = -direction
    along = offsets @ direction
    return np.concatenate([centre + along.min() * direction, centre + along.max() * direction])


def _breaks(scan: Scan, used: IntArray, points: FloatArray, p: SegmentParameters) -> BoolArray:
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
