"""Turn angles over arc length: shape similarity and shape complexity (paper, VIII-A, B).

T(P) is a step function: over the length of each segment of a polyline P it is the angle of that
segment with the x axis. Gaps between the segments of a generalized polyline are no arc length.
Neither position nor scale matters, and rotating P by α adds α to T(P).

The directions of the segments are known up to whole turns only. T(P) follows the curve by turn
angles in (-π, π] from its first segment on, so that only one multiple of 2π for all of P remains
open; the best rotation absorbs it. (A turn of exactly π could be to either side: it counts as a
left one.)

Derivation of the best rotation. With f = T(C) - T(D) over normalised arc length,

    s(Θ) = ∫₀¹ (f + Θ)² dt,    s'(Θ) = 2 ∫₀¹ f dt + 2Θ = 0
    Θ(C, D) = ∫₀¹ (T(D) - T(C)) dt = -mean(f)
    s(C, D) = ∫₀¹ f² dt - (∫₀¹ f dt)² = variance(f)

where the paper prints Θ = ∫ (T(C) T(D))² ds, which is not even zero for C = D. f is a step function
too, so both integrals are finite sums over the merged breakpoints of C and D.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mapweave.errors import MapweaveError
from mapweave.geometry.arguments import as_segments
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.geometry.se2 import wrap


class NoShapeError(MapweaveError):
    """A polyline without any length.

    Parameters
    ----------
    count
        How many segments it has.
    """

    def __init__(self, count: int) -> None:
        super().__init__(f"polyline of {count} segments: expected a total length above zero")
        self.count = count


@dataclass(frozen=True, slots=True, eq=False)
class TangentSpace:
    """T(P), the turn-angle representation of a polyline (paper, VIII-A).

    Attributes
    ----------
    length
        Of the polyline without its gaps [m].
    breaks
        (n + 1,) where its steps begin and end, in normalised arc length: from 0 to 1.
    angle
        (n,) of each step [rad], unwrapped along the curve.
    """

    length: float
    breaks: FloatArray
    angle: FloatArray

    def at(self, arc: FloatArray) -> FloatArray:
        """Return the angle [rad] at normalised arc lengths that are no breakpoints."""
        step = np.searchsorted(self.breaks, arc) - 1
        return self.angle[np.clip(step, 0, len(self.angle) - 1)]


def tangent_space(polyline: ArrayLike) -> TangentSpace:
    """Return T(P) of a generalized polyline (paper, VIII-A).

    Parameters
    ----------
    polyline
        (n, 4) x1 y1 x2 y2 [m] or (n, 2) vertices [m], any frame, in order. Segments without length
        have no direction and are passed over.

    Raises
    ------
    ArgumentError
        If it has another shape, or holds NaN or infinity.
    NoShapeError
        If no segment has any length.
    """
    return _tangent_space(as_segments("polyline", polyline))


def _tangent_space(polyline: FloatArray) -> TangentSpace:
    """Return T(P) of (n, 4) segments."""
    steps = polyline[:, 2:] - polyline[:, :2]
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    steps, lengths = steps[lengths > 0], lengths[lengths > 0]
    if not len(lengths):
        raise NoShapeError(len(polyline))
    direction = np.arctan2(steps[:, 1], steps[:, 0])
    turn = wrap(np.diff(direction))
    angle = direction[0] + np.concatenate([[0.0], np.cumsum(turn)])
    arc = np.concatenate([[0.0], np.cumsum(lengths)])
    return TangentSpace(float(arc[-1]), arc / arc[-1], angle)


def similarity(c: ArrayLike, d: ArrayLike) -> tuple[float, float]:
    """Return the shape similarity measure of two polylines and the best rotation (paper, VIII-A).

    Parameters
    ----------
    c, d
        (n, 4) and (m, 4) x1 y1 x2 y2 [m], or (n, 2) vertices [m], each in any frame.

    Returns
    -------
    s
        s(C, D) [rad²]: 0 for equal shapes, larger for less similar ones.
    theta
        Θ(C, D) [rad] in (-π, π]: turning C by it makes it most like D.

    Raises
    ------
    ArgumentError
        If one of them has another shape, or holds NaN or infinity.
    NoShapeError
        If one of them has no length.

    Examples
    --------
    >>> s, theta = similarity([[0, 0], [2, 0], [2, 2]], [[5, 5], [5, 8], [2, 8]])
    >>> round(s, 6), round(theta, 6)  # a corner, turned by a right angle
    (0.0, 1.570796)
    """
    first, second = _tangent_space(as_segments("c", c)), _tangent_space(as_segments("d", d))
    breaks = np.union1d(first.breaks, second.breaks)
    middle, width = (breaks[1:] + breaks[:-1]) / 2, np.diff(breaks)
    difference = first.at(middle) - second.at(middle)
    theta = -float(width @ difference)
    return float(width @ (difference + theta) ** 2), float(wrap(theta))


def complexity(polyline: ArrayLike) -> float:
    """Return the shape complexity sc(P) = s(P, L_P) [rad²] of a polyline (paper, VIII-B).

    L_P is a straight line of the same length. As T(L_P) is constant, sc(P) is the variance of
    T(P): 0 iff P is straight, (π/4)² for a right angle with equal legs.

    Parameters
    ----------
    polyline
        (n, 4) x1 y1 x2 y2 [m] or (n, 2) vertices [m], any frame.

    Raises
    ------
    ArgumentError
        If it has another shape, or holds NaN or infinity.
    NoShapeError
        If it has no length.

    Examples
    --------
    >>> complexity([[0, 0], [7, 0]])
    0.0
    >>> round(complexity([[0, 0], [2, 0], [2, 2]]), 6)  # (π/4)²
    0.61685
    """
    straight = np.array([[0.0, 0.0, tangent_space(polyline).length, 0.0]])
    return similarity(polyline, straight)[0]


def complexities(segments: FloatArray, polyline: IntArray) -> FloatArray:
    """Return sc(P) [rad²], as of `complexity`, of every polyline at once.

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], polyline by polyline, in order.
    polyline
        (n,) the polyline of each, ascending. One without any length has complexity 0.

    Returns
    -------
    FloatArray
        (k,) one for each name in `polyline`, ascending.
    """
    steps = segments[:, 2:] - segments[:, :2]
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    long = lengths > 0
    names, owner = np.unique(polyline, return_inverse=True)
    steps, lengths, owner = steps[long], lengths[long], owner[long]
    # Where one polyline follows another the turn is of no account: the variance is about the mean.
    direction = np.arctan2(steps[:, 1], steps[:, 0])
    angle = np.cumsum(np.concatenate([direction[:1], wrap(np.diff(direction))]))
    total = np.maximum(np.bincount(owner, lengths, len(names)), 1e-12)
    mean = np.bincount(owner, lengths * angle, len(names)) / total
    variance = np.bincount(owner, lengths * (angle - mean[owner]) ** 2, len(names)) / total
    return np.asarray(variance)
