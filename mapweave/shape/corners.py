"""Corners: what shapes have in common where polylines are broken.

Two walls that are not parallel and near each other fix a frame: the point where their lines
meet, and the first one's direction. The pair need not touch, nor lie on one polyline: a corner
behind a door, or a gap between polylines, is one as well. Every corner of one map that meets at
the same angle as one of the other proposes a transform; those that many corners propose are
hypotheses.
"""

from dataclasses import dataclass

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry.arrays import FloatArray
from mapweave.kernels.matching import corners as kernel


class CornerParameters(BaseModel):
    """Which pairs of walls make a corner, and how proposals are counted."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    max_walls: int = Field(150, ge=2, description="the longest of a map")
    min_length: float = Field(0.4, gt=0, description="[m] of a wall, for a direction worth using")
    max_gap: float = Field(3.0, gt=0, description="[m] between the walls")
    min_angle: float = Field(0.6, gt=0, description="[rad] between them: 35°")
    max_corners: int = Field(400, ge=1, description="of a map, the weightiest")
    angle_tolerance: float = Field(0.09, gt=0, description="[rad] between like corners: 5°")
    vote_cell: float = Field(0.4, gt=0, description="[m] within which proposals agree")
    vote_turn: float = Field(0.09, gt=0, description="[rad] within which they agree: 5°")
    hypotheses: int = Field(300, ge=1, description="handed on, the most proposed")


@dataclass(frozen=True, slots=True, eq=False)
class Corners:
    """Frames fixed by pairs of walls.

    Attributes
    ----------
    frame
        (k, 3) the point where the lines of the two walls meet, and the first wall's direction
        [m, m, rad].
    angle
        (k,) from the first wall's direction to the second's [rad].
    weight
        (k,) [m] of the shorter wall.
    """

    frame: FloatArray
    angle: FloatArray
    weight: FloatArray


def find_corners(segments: FloatArray, parameters: CornerParameters) -> Corners:
    """Return the corners of a map: pairs of walls that fix a frame.

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], the visible side on the left.
    parameters
        Which pairs make a corner.
    """
    p = parameters
    vectors = segments[:, 2:] - segments[:, :2]
    lengths = np.hypot(vectors[:, 0], vectors[:, 1])
    used = np.argsort(-lengths)[: p.max_walls]
    used = used[lengths[used] >= p.min_length]
    walls, vectors, lengths = segments[used], vectors[used], lengths[used]
    i, j, angle = kernel.corner_pairs(walls, p.max_gap, p.min_angle)
    weight = np.minimum(lengths[i], lengths[j])
    best = np.argsort(-weight, kind="stable")[: p.max_corners]
    i, j, angle = i[best], j[best], angle[best]
    point = _meeting_points(walls[i], vectors[i], walls[j], vectors[j])
    direction = np.arctan2(vectors[i, 1], vectors[i, 0])
    return Corners(np.column_stack([point, direction]), angle, weight[best])


def propose(reference: Corners, other: Corners, parameters: CornerParameters) -> FloatArray:
    """Return the transforms that lay like corners of two maps on each other.

    Parameters
    ----------
    reference, other
        Corners of two maps, each in its own frame.
    parameters
        Which corners are alike, and which proposals are counted as one.

    Returns
    -------
    FloatArray
        (k, 3) from the frame of `other` to that of `reference` [m, m, rad], the most proposed
        first.
    """
    p = parameters
    ours, theirs = (kernel.Frames(c.frame, c.angle, c.weight) for c in (reference, other))
    limits = p.angle_tolerance, p.vote_cell, p.vote_turn, p.hypotheses
    return kernel.most_proposed(ours, theirs, *limits)


def _meeting_points(
    first: FloatArray, u: FloatArray, second: FloatArray, v: FloatArray
) -> FloatArray:
    """(k, 2) where the lines through walls (k, 4) with vectors (k, 2) meet."""
    between = second[:, :2] - first[:, :2]
    cross = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    along = (between[:, 0] * v[:, 1] - between[:, 1] * v[:, 0]) / cross
    return first[:, :2] + along[:, None] * u
