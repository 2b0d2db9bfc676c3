"""Beyond a place: what two maps say of an alignment where they may be bent.

Where both looked an alignment is exact, and a wall where the other saw through contradicts it. At
a distance from there a wall may be off by what maps are bent by, and lie in what the other saw to
be free although both are right. Only what lies deeper in it is a contradiction.
"""

import math

import numpy as np

from mapweave.fusion.extrapolation import ExtrapolationParameters
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.kernels.matching.nearness import nearest_distances
from mapweave.matching.distance_field import DistanceField
from mapweave.matching.verification import (
    VerificationParameters,
    coinciding,
    contradicting,
    worth_of_missing,
)

LIKELY = 1.64  # standard deviations towards the free space, of which 19 of 20 are no more


def contradicted_beyond(
    reference: DistanceField,
    other: DistanceField,
    transform: FloatArray,
    shared: FloatArray,
    verification: VerificationParameters,
    parameters: ExtrapolationParameters,
) -> float:
    """Return the metres of wall, of both maps, that the other saw through, whatever is bent.

    Parameters
    ----------
    reference, other
        The two maps.
    transform
        (3,) from `other` to `reference` [m, m, rad].
    shared
        (n, 2) points on the wall in common, frame of `other` [m].
    verification, parameters
        When walls contradict, and what maps are bent by.
    """
    found = judged_around(reference, other, transform, shared, verification, parameters)
    return found[1]


def judged_around(
    reference: DistanceField,
    other: DistanceField,
    transform: FloatArray,
    shared: FloatArray,
    verification: VerificationParameters,
    parameters: ExtrapolationParameters,
    within: float = math.inf,
) -> tuple[float, float]:
    """Return metres of wall in common and, whatever is bent, contradicted, about some places.

    Parameters
    ----------
    shared
        (n, 2) where the two are known to lie on each other, frame of `other` [m].
    within
        [m] from there, to which walls count.
    """
    if len(shared) == 0:
        return 0.0, math.inf
    there = se2.transform_points(transform, shared)
    ways = (
        (reference, other, transform, shared),
        (other, reference, se2.inverse(transform), there),
    )
    found = [_one_way(*way, verification, parameters, within) for way in ways]
    return min(common for common, _ in found), sum(against for _, against in found)


def _one_way(
    reference: DistanceField,
    other: DistanceField,
    transform: FloatArray,
    shared: FloatArray,
    v: VerificationParameters,
    p: ExtrapolationParameters,
    within: float,
) -> tuple[float, float]:
    """[m] of wall of `other` on walls of `reference`, and where that saw through."""
    on = coinciding(reference, other, transform, v)
    against = contradicting(reference, other, transform, v)
    points = other.oriented.points
    apart = nearest_distances(shared, points)
    _, _, depth = reference.look_up(se2.transform_points(transform, points))
    deep = depth > v.clearance + LIKELY * p.bend * np.minimum(apart, p.most)
    near = apart <= within
    missing = other.weight * worth_of_missing(other, v)
    common, gone = other.weight[on & near].sum(), missing[against & deep & near].sum()
    return float(common), float(gone)
