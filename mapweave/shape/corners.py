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

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray


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
    direction = np.arctan2(vectors[:, 1], vectors[:, 0])
    angle = se2.wrap(direction[None, :] - direction[:, None])
    turned = (np.abs(np.sin(angle)) >= np.sin(p.min_angle)) & (angle > 0)
    i, j = np.nonzero(turned & (_end_gaps(walls) <= p.max_gap))
    weight = np.minimum(lengths[i], lengths[j])
    best = np.argsort(-weight, kind="stable")[: p.max_corners]
    i, j = i[best], j[best]
    point = _meeting_points(walls[i], vectors[i], walls[j], vectors[j])
    return Corners(np.column_stack([point, direction[i]]), angle[i, j], weight[best])


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
    apart = se2.wrap(reference.angle[:, None] - other.angle[None, :])
    i, j = np.nonzero(np.abs(apart) <= p.angle_tolerance)
    if len(i) == 0:
        return np.empty((0, 3))
    # Both walls' directions vote for the rotation: the second's differs by the angles' difference.
    turn = reference.frame[i, 2] - other.frame[j, 2] + 0.5 * apart[i, j]
    c, s = np.cos(turn), np.sin(turn)
    x, y = other.frame[j, 0], other.frame[j, 1]
    proposals = np.column_stack(
        [reference.frame[i, 0] - c * x + s * y, reference.frame[i, 1] - s * x - c * y, turn]
    )
    return _most_proposed(proposals, np.minimum(reference.weight[i], other.weight[j]), p)


def _end_gaps(walls: FloatArray) -> FloatArray:
    """(n, n) smallest distance between ends of two walls [m]."""
    ends = walls.reshape(-1, 2, 2)
    difference = ends[:, None, :, None] - ends[None, :, None, :]
    gaps: FloatArray = np.sqrt((difference**2).sum(axis=-1).min(axis=(2, 3)))
    return gaps


def _meeting_points(
    first: FloatArray, u: FloatArray, second: FloatArray, v: FloatArray
) -> FloatArray:
    """(k, 2) where the lines through walls (k, 4) with vectors (k, 2) meet."""
    between = second[:, :2] - first[:, :2]
    cross = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    along = (between[:, 0] * v[:, 1] - between[:, 1] * v[:, 0]) / cross
    return first[:, :2] + along[:, None] * u


def _most_proposed(proposals: FloatArray, weight: FloatArray, p: CornerParameters) -> FloatArray:
    """Count proposals in cells, each in all cells it is at the edge of, and average the best."""
    cells = np.array([p.vote_cell, p.vote_cell, p.vote_turn])
    turns = round(2 * np.pi / p.vote_turn)
    scaled = proposals / cells
    scaled[:, 2] = (se2.wrap(proposals[:, 2]) + np.pi) / (2 * np.pi) * turns
    key = np.floor(scaled).astype(np.int64)
    key[:, 2] %= turns
    low = key.min(axis=0)
    span = key.max(axis=0) - low + 1
    flat = ((key[:, 0] - low[0]) * span[1] + key[:, 1] - low[1]) * turns + key[:, 2]
    cell, inverse = np.unique(flat, return_inverse=True)
    member: IntArray = inverse.astype(np.int64)
    votes: FloatArray = np.bincount(member, weights=weight, minlength=len(cell)).astype(np.float64)
    best: IntArray = np.argsort(-votes, kind="stable")[: p.hypotheses]
    return _cell_means(proposals, weight, member, votes, best)


def _cell_means(
    proposals: FloatArray, weight: FloatArray, member: IntArray, votes: FloatArray, best: IntArray
) -> FloatArray:
    """(k, 3) weighted mean proposal of each of the `best` cells."""
    x, y = (np.bincount(member, weights=weight * proposals[:, k])[best] for k in (0, 1))
    phase = (
        np.bincount(member, weights=weight * np.cos(proposals[:, 2]))[best]
        + 1j * (np.bincount(member, weights=weight * np.sin(proposals[:, 2]))[best])
    )
    total = votes[best]
    return np.column_stack([x / total, y / total, np.angle(phase)])
