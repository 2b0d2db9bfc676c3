"""Merging two segments in the context of a direction: its cost and its result (paper, VII).

The paper weighs a pair by the lengths l1, l2. Our extension lets the caller give other weights in
their place, such as the total length observed, so that a wall seen a hundred times does not move
half way to a single new sighting. Distances are distances whatever the weights.
"""

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict, Field

from mapweave.errors import ArgumentError
from mapweave.geometry.arguments import as_numbers, as_segments, as_values
from mapweave.geometry.arrays import ComplexArray, FloatArray
from mapweave.kernels.lines.merging_cost import (
    CostTerms,
    Pairs,
    collinearity,
    cost_terms,
    line_height,
    merged_segments,
    parallelism,
    proximity,
)

__all__ = [
    "CostTerms",
    "CostWeights",
    "Pairs",
    "collinearity",
    "cost_terms",
    "line_height",
    "merge_cost",
    "merged_segment",
    "merged_segments",
    "parallelism",
    "proximity",
]


class CostWeights(BaseModel):
    """The balance between the three parts of the merging cost; defaults from the paper, VII."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    parallelism: float = Field(default=2.0, ge=0, description="w1, of metres")
    collinearity: float = Field(default=0.25, ge=0, description="w2, of metres")
    proximity: float = Field(default=0.5, ge=0, description="w3, of metres")


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
    w = balance or CostWeights()
    terms = cost_terms(pairs, _direction_of(pairs, direction))
    return terms.total(w.parallelism, w.collinearity, w.proximity)


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
