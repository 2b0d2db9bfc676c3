"""The best match of a part within a polyline (paper, VIII: H2 over parts, as V asks for).

A part slides along a polyline; at each place it is compared with the stretch of its own length by
the similarity s (VIII-A). Between two places where steps of the one pass steps of the other, the
integrals of f and of f², for f = T(part) - T(stretch), are linear in the place, so
s = ∫ f² - (∫ f)² is concave there: it is least at an end of such an interval. So the finitely
many places where a breakpoint of the part lies on one of the polyline, and the two ends, hold the
exact best match.
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
"""Share of its length that a part may be longer than the polyline, by rounding."""


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
    spare = large.length - small.length
    if spare < -_ROUNDING * small.length:
        raise ArgumentError(
            "part",
            f"expected at most the polyline's length, {large.length:g} m, got {small.length:g} m",
        )
    starts = _starts(small, large, max(spare, 0.0))
    compared = [_compare(small, large, start) for start in starts.tolist()]
    k = int(np.argmin(np.round([s for s, _ in compared], 12)))
    s, theta = compared[k]
    return PartialMatch(float(starts[k]), float(starts[k]) + small.length, s, theta)


def _starts(part: TangentSpace, whole: TangentSpace, spare: float) -> FloatArray:
    """Return [m], ascending, where the part may begin: breakpoints meet, or it is at an end."""
    meeting = (whole.breaks[:, None] * whole.length - part.breaks * part.length).ravel()
    inside = meeting[(meeting > 0) & (meeting < spare)]
    return np.unique(np.concatenate([[0.0], inside, [spare]]))


def _compare(part: TangentSpace, whole: TangentSpace, start: float) -> tuple[float, float]:
    """Return s and Θ of the part and the stretch of its length from `start` [m] on (VIII-A)."""
    beginning, scale = start / whole.length, part.length / whole.length
    within = (whole.breaks - beginning) / scale
    breaks = np.union1d(part.breaks, within[(within > 0) & (within < 1)])
    middle, width = (breaks[1:] + breaks[:-1]) / 2, np.diff(breaks)
    difference = part.at(middle) - whole.at(beginning + middle * scale)
    theta = -float(width @ difference)
    return float(width @ (difference + theta) ** 2), float(wrap(theta))
