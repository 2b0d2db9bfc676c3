"""The arithmetic of merging two segments: its cost and its result (paper, VII).

Points are complex numbers in here: ``conj(p) * q`` has the scalar product of p and q as its real
part and their cross product as its imaginary part, and |p| is a length.

The paper weighs a pair by the lengths l1, l2. Our extension lets the caller give other weights in
their place, such as the total length observed, so that a wall seen a hundred times does not move
half way to a single new sighting. Distances are distances whatever the weights.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mapweave.kernels.arrays import BoolArray, ComplexArray, FloatArray

_ORTHOGONAL = 1e-9  # cosines below count as zero: sqrt of the rounding of a product


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
        """Pair (k, 4) `second` [m] with as many `first`, or with one (1, 4) for all.

        Weights are (k,) or one for all, and default to the lengths.
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

    def total(self, parallelism: float, collinearity: float, proximity: float) -> FloatArray:
        """Return C = w1 parC + w2 colC + w3 proxC."""
        return np.asarray(
            parallelism * self.parallelism
            + collinearity * self.collinearity
            + proximity * self.proximity
        )


def cost_terms(pairs: Pairs, direction: ComplexArray) -> CostTerms:
    """Return the parts of C(L1, L2, ad) for the unit vectors `direction`."""
    return CostTerms(parallelism(pairs, direction), collinearity(pairs), proximity(pairs))


def parallelism(pairs: Pairs, direction: ComplexArray) -> FloatArray:
    """Return (k,) parC [m] for the unit vectors `direction` (paper, VII).

    B' lies on the line of direction ad through A and on the perpendicular to L1 through B, so
    that A, B and B' have their right angle at B: d(B, B') = l1 |tan(angle between L1 and ad)|.
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
