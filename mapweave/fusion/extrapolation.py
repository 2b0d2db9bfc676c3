"""Reach: how far two maps go on beyond the wall that they share, and what that leaves of a join.

Where both looked an alignment is exact. Maps are bent, though: what lies beyond is off by a part of
the way there, so an alignment of the right places may be wrong for maps as wholes.
"""

import math

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.kernels.matching.nearness import nearest_distances
from mapweave.matching.distance_field import DistanceField
from mapweave.matching.verification import VerificationParameters, coinciding


class ExtrapolationParameters(BaseModel):
    """How much maps are bent.

    Fitted to the joins between stretches of logs: the bend is 0.0075 for Seattle, 0.010 for
    Freiburg 079, 0.011 for CSAIL, 0.012 for Intel; 0.022 for Killian Court, whose poses are less
    exact.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    tolerance: float = Field(
        0.5, gt=0, description="[m] by which a map may be off at the median, to be joined right"
    )
    exact: float = Field(
        0.045, gt=0, description="[m] standard deviation along x and y, where both looked"
    )
    bend: float = Field(
        0.0115,
        gt=0,
        description="the same for each metre beyond: a map whose middle is 20 m from there is off"
        " by 0.28 m at the median",
    )
    most: float = Field(60.0, gt=0, description="[m] of reach that others allow for in cycles")


def reach(
    first: DistanceField,
    second: DistanceField,
    transform: FloatArray,
    parameters: VerificationParameters,
) -> float:
    """Return how far the two maps go on beyond the wall that they share [m].

    For each map the median, over its wall, of the distance to the nearest wall in common; together
    the root of the sum of their squares, as bends of two maps add up. Infinite where nothing is
    shared.

    Parameters
    ----------
    transform
        (3,) from `second` to `first`.
    """
    ways = (first, second, transform), (second, first, se2.inverse(transform))
    return math.hypot(*(_beyond(*way, parameters) for way in ways))


def _beyond(
    reference: DistanceField, other: DistanceField, transform: FloatArray, p: VerificationParameters
) -> float:
    """[m] median distance of the wall of `other` from that of it which coincides."""
    shared = coinciding(reference, other, transform, p)
    if not shared.any():
        return math.inf
    points = other.oriented.points
    return float(np.median(nearest_distances(points[shared], points)))


def holds(reach: float, parameters: ExtrapolationParameters) -> float:
    """Return the probability that maps that reach this far [m] are within the tolerance.

    What they are off by is taken to be normal, along x as along y; they turn by less than 5° before
    that.
    """
    p = parameters
    spread = math.hypot(p.exact, p.bend * reach)
    return -math.expm1(-(p.tolerance**2) / (2 * spread**2))


def bend(reach: float, parameters: ExtrapolationParameters) -> float:
    """Return the standard deviation [m] along x and y that maps which reach this far have beyond.

    What others say of the reach is bounded, for what may be off by any amount is never refuted;
    what is no number is none.
    """
    p = parameters
    return p.bend * min(max(reach, 0.0), p.most) if math.isfinite(reach) else 0.0
