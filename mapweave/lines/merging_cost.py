"""Merging two segments in the context of a direction: its cost and its result (paper, VII).

Points are complex numbers in here: ``conj(p) * q`` has the scalar product of p and q as its real
part and their cross product as its imaginary part, and ``|p|`` is a length.

The paper weighs a pair by the lengths l1, l2. Our extension lets the caller give other weights in
their place, such as the total length observed, so that a wall seen a hundred times does not move
half way to a single new sighting. Distances are distances whatever the weights.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict, Field

from mapweave.errors import ArgumentError
from mapweave.geometry.arguments import as_numbers, as_segments, as_values
from mapweave.geometry.arrays import BoolArray, ComplexArray, FloatArray

_ORTHOGONAL = 1e-9  # cosines below count as zero: sqrt of the rounding of a product


class CostWeights(BaseModel):
    """The balance between the three parts of the merging cost; defaults from the paper, VII."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    parallelism: float = Field(default=2.0, ge=0, description="w1, of metres")
    collinearity: float = Field(default=0.25, ge=0, description="w2, of metres")
    proximity: float = Field(default=0.5, ge=0, description="w3, of metres")


@dataclass(frozen=True, slots=True, eq=False)
class Pairs:
    """Pairs of segments L1 = AB and L2 = CD, oriented alike: <AB, CD> >= 0 (paper, VII).

    Attributes
    ----------
    ends
        (4, k) A, B, C, D [m].
    vectors
        (2, k) AB and CD [m].
    lengths
        (2, k) l1 and l2 [m].
    shares
        (2, k) l1 / (l1 + l2) and l2 / (l1 + l2), or of the weights that stand for the lengths.
    cosines
        (k,) of the angles between L1 and L2; 0 where a length is zero.
    mean_direction
        (k,) unit vectors: the weighted average direction, that of AB + CD.
    turned
        (k,) whether L2 had to be turned round to be oriented as L1.
    """

    ends: ComplexArray
    vectors: ComplexArray
    lengths: FloatArray
    shares: FloatArray
    cosines: FloatArray
    mean_direction: ComplexArray
    turned: BoolArray

    @classmethod
    def of(
        cls,
        first: FloatArray,
        second: FloatArray,
        first_weight: ArrayLike | None = None,
        second_weight: ArrayLike | None = None,
    ) -> "Pairs":
        """Pair segments; L2 is turned round where it is not oriented as L1.

        Parameters
        ----------
        first, second
            L1 and L2, (k, 4) x1 y1 x2 y2 [m] each, one frame; `first` may be one (1, 4) for all.
        first_weight, second_weight
            (k,) or one for all [m]: in place of the lengths where the paper weighs the two.
        """
        ends = np.empty((4, len(second)), dtype=np.complex128)
        ends[:2] = _end_points(first)
        c, d = _end_points(second)
        turned = ((ends[1] - ends[0]).conj() * (d - c)).real < 0
        ends[2:] = np.where(turned, (d, c), (c, d))
        vectors = ends[1::2] - ends[::2]
        lengths = np.abs(vectors)
        units = vectors / np.where(lengths > 0, lengths, 1.0)
        weights = lengths.copy()
        for row, given in enumerate((first_weight, second_weight)):
            if given is not None:
                weights[row] = given
        total = weights.sum(axis=0)
        shares = weights / np.where(total > 0, total, 1.0)
        mean = (units * shares).sum(axis=0)  # at most a right angle apart: not zero by cancelling
        size = np.abs(mean)
        return cls(
            ends=ends,
            vectors=vectors,
            lengths=lengths,
            shares=shares,
            cosines=(units[0].conj() * units[1]).real,
            mean_direction=mean / np.where(size > 0, size, 1.0),
            turned=turned,
        )


class CostTerms(NamedTuple):
    """The parts of the merging cost, each (k,) [m] (paper, VII)."""

    parallelism: FloatArray
    collinearity: FloatArray
    proximity: FloatArray

    def total(self, balance: CostWeights) -> FloatArray:
        """Return (k,) C = w1 parC + w2 colC + w3 proxC [m], `balance` being w1 to w3."""
        return np.asarray(
            balance.parallelism * self.parallelism
            + balance.collinearity * self.collinearity
            + balance.proximity * self.proximity
        )


def cost_terms(pairs: Pairs, direction: ComplexArray) -> CostTerms:
    """Return the parts of C(L1, L2, ad) (paper, VII).

    Parameters
    ----------
    pairs
        k pairs of segments L1, L2.
    direction
        (k,) ad, unit vectors.
    """
    return CostTerms(parallelism(pairs, direction), collinearity(pairs), proximity(pairs))


def parallelism(pairs: Pairs, direction: ComplexArray) -> FloatArray:
    """Return (k,) parC [m] for the unit vectors `direction` (paper, VII).

    B' lies on the line of direction ad through A and on the perpendicular to L1 through B, so
    that A, B and B' have their right angle at B: ``d(B, B') = l1 |tan α|``, α the angle between
    L1 and ad.

    Parameters
    ----------
    pairs
        k pairs of segments.
    direction
        (k,) ad, unit vectors.

    Returns
    -------
    FloatArray
        (k,) [m]; infinite where ad is orthogonal to one of the two.
    """
    product = pairs.vectors.conj() * direction
    along, across = np.abs(product.real), np.abs(product.imag)
    orthogonal = along <= _ORTHOGONAL * pairs.lengths
    opening = pairs.lengths * across / np.where(orthogonal, 1.0, along)
    weighed = (pairs.shares * opening).sum(axis=0)
    return np.asarray(np.where(orthogonal.any(axis=0), np.inf, weighed))


def collinearity(pairs: Pairs) -> FloatArray:
    """Return (k,) colC [m]: the largest distances of both to the line lwa, summed (paper, VII).

    The line lwa has the weighted average direction.
    """
    direction = pairs.mean_direction
    away = np.abs(_heights(pairs.ends, direction) - line_height(pairs, direction))
    return np.asarray(np.maximum(away[0], away[1]) + np.maximum(away[2], away[3]))


def proximity(pairs: Pairs) -> FloatArray:
    """Return (k,) proxC [m]: the smallest distance of an end to the other segment (paper, VII)."""
    origin = pairs.ends[[2, 2, 0, 0]]
    vector = pairs.vectors[[1, 1, 0, 0]]
    squared = pairs.lengths[[1, 1, 0, 0]] ** 2
    offset = pairs.ends - origin
    share = (vector.conj() * offset).real / np.where(squared > 0, squared, 1.0)
    return np.asarray(np.abs(offset - np.clip(share, 0.0, 1.0) * vector).min(axis=0))


def line_height(pairs: Pairs, direction: ComplexArray) -> FloatArray:
    """Return (k,) the heights [m] of the lines ld of `direction` with d1 l1 = d2 l2 (paper, VII).

    The height of a line is its signed distance from the origin, to the left of its direction; the
    equation holds for the weighted mean of the heights of the two midpoints.
    """
    middles = (pairs.ends[::2] + pairs.ends[1::2]) / 2
    return np.asarray((pairs.shares * _heights(middles, direction)).sum(axis=0))


def merged_segments(pairs: Pairs, direction: ComplexArray, end_noise: float = 0.0) -> FloatArray:
    """Return (k, 4) ms(L1, L2, ad): the hull of both projections on the line ld (paper, VII).

    Directed as L1 is, whichever way `direction` points. Our extension: two ends at most
    `end_noise` [m] apart along the line are sightings of one end, and averaged by weight; a hull
    of many sightings would stick out as far as the noisiest of them.
    """
    ahead = np.where((pairs.vectors[0].conj() * direction).real < 0, -direction, direction)
    along = (ahead.conj() * pairs.ends).real
    low = _outer_end(np.minimum(along[::2], along[1::2]), pairs.shares, end_noise, np.minimum)
    high = _outer_end(np.maximum(along[::2], along[1::2]), pairs.shares, end_noise, np.maximum)
    foot = 1j * ahead * line_height(pairs, ahead)
    return np.ascontiguousarray(np.stack([foot + low * ahead, foot + high * ahead], axis=-1)).view(
        np.float64
    )


def merge_cost(
    first: ArrayLike,
    second: ArrayLike,
    direction: ArrayLike | None = None,
    *,
    first_weight: ArrayLike | None = None,
    second_weight: ArrayLike | None = None,
    balance: CostWeights | None = None,
) -> FloatArray:
    """Return the cost C(L1, L2, ad) of merging each pair of segments (paper, VII).

    Parameters
    ----------
    first, second
        (k, 4) x1 y1 x2 y2 [m], or (4,) for one; `first` may be one for all. The way they are
        directed does not matter.
    direction
        (k,) or one: the direction ad [rad] that the merged segment shall have; by default the
        weighted average direction.
    first_weight, second_weight
        (k,) or one: in place of the lengths where the paper weighs the two (our extension).
    balance
        w1, w2, w3.

    Returns
    -------
    FloatArray
        (k,) [m]; infinite where `direction` is orthogonal to one of the segments.

    Raises
    ------
    ArgumentError
        If segments have another shape, or are not as many, or anything given is NaN or infinite.

    Examples
    --------
    >>> merge_cost([[0, 0, 3, 0]], [[0, 0.1, 3, 0.1]])  # w2 · 0.1 m + w3 · 0.1 m
    array([0.075])
    """
    pairs = _given_pairs(first, second, first_weight, second_weight)
    return cost_terms(pairs, _direction_of(pairs, direction)).total(balance or CostWeights())


def merged_segment(
    first: ArrayLike,
    second: ArrayLike,
    direction: ArrayLike | None = None,
    *,
    first_weight: ArrayLike | None = None,
    second_weight: ArrayLike | None = None,
) -> FloatArray:
    """Return the (k, 4) merged segments ms(L1, L2, ad) [m], directed as `first` (paper, VII).

    Parameters and errors as for `merge_cost`.

    Examples
    --------
    >>> merged_segment([[0, 0, 3, 0]], [[2, 0.2, 5, 0.2]]).round(6)
    array([[0. , 0.1, 5. , 0.1]])
    """
    pairs = _given_pairs(first, second, first_weight, second_weight)
    return merged_segments(pairs, _direction_of(pairs, direction))


def _given_pairs(
    first: ArrayLike,
    second: ArrayLike,
    first_weight: ArrayLike | None,
    second_weight: ArrayLike | None,
) -> Pairs:
    """Return pairs of what a caller gives; ArgumentError if it is no pairs of segments."""
    ours, theirs = (
        as_segments(name, np.atleast_2d(as_numbers(name, value, "expected (k, 4) segments [m]")))
        for name, value in (("first", first), ("second", second))
    )
    if len(ours) not in (1, len(theirs)):
        raise ArgumentError("second", f"expected {len(ours)}, as many as first, got {len(theirs)}")
    weights = (
        None if value is None else _one_each(name, value, len(theirs))
        for name, value in (("first_weight", first_weight), ("second_weight", second_weight))
    )
    return Pairs.of(ours, theirs, *weights)


def _one_each(argument: str, value: ArrayLike, count: int) -> FloatArray:
    """Return (count,) of what may be given as one for all."""
    given = as_numbers(argument, value, f"expected ({count},) numbers, or one")
    return as_values(argument, np.full(count, given) if given.ndim == 0 else given, count, "pair")


def _direction_of(pairs: Pairs, direction: ArrayLike | None) -> ComplexArray:
    if direction is None:
        return pairs.mean_direction
    return np.asarray(np.exp(1j * _one_each("direction", direction, len(pairs.cosines))))


def _end_points(segments: FloatArray) -> ComplexArray:
    """Return the (2, k) ends of (k, 4) segments as complex numbers."""
    return np.ascontiguousarray(segments, dtype=float).view(np.complex128).T


def _heights(points: ComplexArray, direction: ComplexArray) -> FloatArray:
    """Return the heights [m] of `points` to the left of the line through the origin."""
    return np.asarray((direction.conj() * points).imag)


def _outer_end(
    ends: FloatArray, shares: FloatArray, end_noise: float, outer: np.ufunc
) -> FloatArray:
    """Return (k,) the outer one of (2, k) ends along a line, their mean where they coincide."""
    same = np.abs(ends[0] - ends[1]) <= end_noise
    return np.asarray(np.where(same, (ends * shares).sum(axis=0), outer(ends[0], ends[1])))
