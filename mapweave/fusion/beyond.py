"""Beyond a place: what two maps say of an alignment where they may be bent.

Where both looked an alignment is exact, and a wall where the other saw through contradicts it. At
a distance from there a wall may be off by what maps are bent by, and lie in what the other saw to
be free although both are right. Only what lies deeper in it is a contradiction.
"""

import math

import numpy as np
import scipy

from mapweave.fusion.extrapolation import ExtrapolationParameters
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.matching.distance_field import DistanceField
from mapweave.matching.verification import VerificationParameters, contradicting, worth_of_missing

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
    if len(shared) == 0:
        return math.inf
    there = se2.transform_points(transform, shared)
    ways = (
        (reference, other, transform, shared),
        (other, reference, se2.inverse(transform), there),
    )
    return sum(_one_way(*way, verification, parameters) for way in ways)


def _one_way(
    reference: DistanceField,
    other: DistanceField,
    transform: FloatArray,
    shared: FloatArray,
    v: VerificationParameters,
    p: ExtrapolationParameters,
) -> float:
    """[m] of wall of `other` that `reference` saw through; `shared` (n, 2) in the other's frame."""
    against = contradicting(reference, other, transform, v)
    points = other.oriented.points[against]
    apart, _ = scipy.spatial.KDTree(shared).query(points)
    _, _, depth = reference.look_up(se2.transform_points(transform, points))
    deep = depth > v.clearance + LIKELY * p.bend * np.minimum(apart, p.most)
    metres = other.weight * worth_of_missing(other, v)
    return float(metres[against][deep].sum())
