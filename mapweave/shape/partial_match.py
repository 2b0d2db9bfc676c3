"""The best match of a part within a polyline (paper, VIII, H2 and VIII-C).

The paper slides a window along the list of line segments. Here it slides along the arc length, and
no step is chosen: let the part, of length l, lie on the stretch of the polyline that starts at arc
length t, and f = T(part) - T(stretch). Between two offsets at which a breakpoint of the one meets
a breakpoint of the other, the widths of the steps of f are linear in t and their heights do not
change. So of

    s(t) = ∫₀¹ f² dt - (∫₀¹ f dt)²        (tangent_space.py)

the first term is linear and the second one the square of something linear: s is concave there, and
least at an end. The least s of all offsets is therefore found among at most (n + 1) (m + 1) of
them, for a part of n segments and a polyline of m: exactly, also where the part starts or ends in
the middle of a segment.

The stretch is as long as the part, as both maps are in metres; s itself knows no scale.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mapweave.errors import ArgumentError
from mapweave.geometry.arguments import as_segments
from mapweave.geometry.arrays import FloatArray
from mapweave.geometry.se2 import wrap
from mapweave.shape.tangent_space import TangentSpace, tangent_space

_ROUNDING = 1e-9
"""Share of a length that sums of lengths may differ by."""


@dataclass(frozen=True, slots=True)
class PartialMatch:
    """Where on a polyline a part fits best.

    Attributes
    ----------
    start, end
        The stretch, in arc length from the polyline's beginning, its gaps left out [m].
    similarity
        s(part, stretch) [rad²]: 0 for equal shapes.
    rotation
        Θ [rad] in (-π, π]: turning the part by it makes it most like the stretch.
    """

    start: float
    end: float
    similarity: float
    rotation: float


def best_match(part: ArrayLike, polyline: ArrayLike) -> PartialMatch:
    """Return the stretch of `polyline`, as long as `part`, that is most like it (paper, V, VIII).

    Neither position nor direction matters; scale does, unlike in `similarity`: what is compared is
    as long as the part. Of equally good stretches the first.

    Parameters
    ----------
    part, polyline
        (n, 4) x1 y1 x2 y2 [m] or (n, 2) vertices [m], each in any frame, in order.

    Raises
    ------
    ArgumentError
        If one has another shape, or holds NaN or infinity, or the part is longer than the polyline.
    NoShapeError
        If one of them has no length.

    Examples
    --------
    >>> corner = [[0, 0], [1, 0], [1, 1]]
    >>> found = best_match(corner, [[0, 0], [0, 5], [-5, 5]])
    >>> round(found.start, 6), round(found.end, 6), round(found.similarity, 6)
    (4.0, 6.0, 0.0)
    """
    small = tangent_space(as_segments("part", part))
    large = tangent_space(as_segments("polyline", polyline))
    if small.length > large.length * (1 + _ROUNDING):
        raise ArgumentError(
            "part",
            f"expected at most the polyline's length, {large.length:g} m, got {small.length:g} m",
        )
    starts = _starts(small, large)
    s, mean = _variances(small, large, starts)
    best = int(np.argmin(np.round(s, 12)))  # rounded, so that the first of equals is the first
    start = float(starts[best])
    return PartialMatch(start, start + small.length, float(s[best]), float(wrap(-mean[best])))


def _starts(part: TangentSpace, polyline: TangentSpace) -> FloatArray:
    """(k,) ascending arc lengths [m] where breakpoints meet and the part is on the polyline."""
    room = max(polyline.length - part.length, 0.0)
    meeting = polyline.length * polyline.breaks[:, None] - part.length * part.breaks
    rounding = _ROUNDING * polyline.length
    inside = meeting[(meeting >= -rounding) & (meeting <= room + rounding)]
    return np.unique(np.clip(inside, 0.0, room))


def _variances(
    part: TangentSpace, polyline: TangentSpace, starts: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return (k,) variance and mean of T(part) - T(stretch) for stretches that begin at `starts`.

    All at once: breakpoints of both, of one row for each stretch, in order.
    """
    ours = part.length * part.breaks + starts[:, None]
    theirs = np.broadcast_to(polyline.length * polyline.breaks, (len(starts), len(polyline.breaks)))
    theirs = np.clip(theirs, ours[:, :1], ours[:, -1:])  # what lies outside has no width
    breaks = np.sort(np.hstack([ours, theirs]), axis=1)
    width = np.diff(breaks, axis=1) / part.length
    middle = (breaks[:, 1:] + breaks[:, :-1]) / 2
    difference = part.at((middle - starts[:, None]) / part.length) - polyline.at(
        middle / polyline.length
    )
    mean = (width * difference).sum(axis=1)
    return (width * (difference - mean[:, None]) ** 2).sum(axis=1), mean
