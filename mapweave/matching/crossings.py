"""Crossings: walls of one map across a passage of the other, such as where that has a door.

Free space contradicts a wall that lies deep in it. A door is too narrow for that: what is between
its jambs lies no deeper than a wall does that is a little off. But such a wall has its other face
nearby, and a wall across a passage has none. Shapes tell the two apart (paper, VIII): aligned
and dissimilar.
"""

import numpy as np
import scipy
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.matching.distance_field import DistanceField
from mapweave.matching.verification import VerificationParameters, coinciding, worth_of_missing

NEIGHBOURS = 32  # samples of walls around one: as many as two walls have within reach


class CrossingParameters(BaseModel):
    """When a wall lies across a passage, and how much of it tells."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    depth: float = Field(0.1, gt=0, description="[m] in free space, from which it was seen through")
    reach: float = Field(0.6, gt=0, description="[m] within which a wall has its other drawing")
    beside: float = Field(0.25, gt=0, description="[m] along the wall, by which that may be aside")
    min_cosine: float = Field(0.7, gt=0, le=1, description="of the angle between the two: 45°")
    near: float = Field(
        1.5, gt=0, description="[m] from wall in common: farther away, maps may be bent"
    )
    door: float = Field(
        0.8, gt=0, description="[m] of wall, of both maps, across passages: one door that is not"
    )


def crossed(
    reference: DistanceField,
    other: DistanceField,
    transform: FloatArray,
    verification: VerificationParameters,
    parameters: CrossingParameters,
) -> float:
    """Return the metres of wall, of both maps, that lie across a passage of the other.

    Parameters
    ----------
    transform
        (3,) from `other` to `reference` [m, m, rad].
    verification, parameters
        When walls coincide, and when one lies across a passage.
    """
    back = se2.inverse(transform)
    ways = (reference, other, transform), (other, reference, back)
    return sum(_one_way(*way, verification, parameters) for way in ways)


def _one_way(
    reference: DistanceField,
    other: DistanceField,
    transform: FloatArray,
    verification: VerificationParameters,
    p: CrossingParameters,
) -> float:
    """[m] of wall of `other` where `reference` saw through and has no such wall nearby."""
    on = coinciding(reference, other, transform, verification)
    walls = other.oriented.moved(transform)
    _, _, depth = reference.look_up(walls.points)
    fixed = worth_of_missing(other, verification) == 1
    asked = np.flatnonzero(~on & fixed & (depth > p.depth) & (other.own_depth < p.depth))
    if len(asked) == 0 or not on.any():
        return 0.0
    away, _ = scipy.spatial.KDTree(walls.points[on]).query(walls.points[asked])
    asked = asked[away <= p.near]
    known = reference.oriented
    tree = scipy.spatial.KDTree(known.points)
    count = min(NEIGHBOURS, len(known))
    apart, near = tree.query(walls.points[asked], range(1, count + 1), distance_upper_bound=p.reach)
    near = np.minimum(near, len(known) - 1)  # those beyond are told by their distance
    normal = walls.normals[asked][:, None]
    along = np.stack([-normal[..., 1], normal[..., 0]], axis=-1)
    between = known.points[near] - walls.points[asked][:, None]
    drawn = np.isfinite(apart) & ((known.normals[near] * normal).sum(axis=-1) > p.min_cosine)
    drawn &= np.abs((between * along).sum(axis=-1)) < p.beside
    return float(other.weight[asked][~drawn.any(axis=1)].sum())
