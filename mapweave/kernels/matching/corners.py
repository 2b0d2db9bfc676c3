"""Corners: pairs of walls, and the transforms that most pairs of like corners propose."""

from typing import NamedTuple, cast

import numpy as np

from mapweave.kernels.arrays import FloatArray, IntArray
from mapweave.kernels.loading import COMPILED


class Frames(NamedTuple):
    """Corners: (k, 3) frames [m, m, rad], (k,) angles [rad] and (k,) weights [m]."""

    frame: FloatArray
    angle: FloatArray
    weight: FloatArray


def corner_pairs_numpy(
    walls: FloatArray, max_gap: float, min_angle: float
) -> tuple[IntArray, IntArray, FloatArray]:
    """Twin of `corner_pairs`."""
    vectors = walls[:, 2:] - walls[:, :2]
    direction = np.arctan2(vectors[:, 1], vectors[:, 0])
    angle = _wrap(direction[None, :] - direction[:, None])
    turned = (np.abs(np.sin(angle)) >= np.sin(min_angle)) & (angle > 0)
    i, j = np.nonzero(turned & (_end_gaps(walls) <= max_gap))
    return i, j, angle[i, j]


def corner_pairs(
    walls: FloatArray, max_gap: float, min_angle: float
) -> tuple[IntArray, IntArray, FloatArray]:
    """Return which pairs of walls (n, 4) [m] make a corner, and their angles [rad] above 0.

    Parameters
    ----------
    max_gap
        [m] between their ends.
    min_angle
        [rad] between both, and between the second and the first turned back.
    """
    compute = corner_pairs_numpy if COMPILED is None else COMPILED.corner_pairs
    return cast("tuple[IntArray, IntArray, FloatArray]", compute(walls, max_gap, min_angle))


def most_proposed_numpy(
    reference: Frames,
    other: Frames,
    tolerance: float,
    vote_cell: float,
    vote_turn: float,
    count: int,
) -> FloatArray:
    """Twin of `most_proposed`."""
    apart = _wrap(reference.angle[:, None] - other.angle[None, :])
    i, j = np.nonzero(np.abs(apart) <= tolerance)
    if len(i) == 0:
        return np.empty((0, 3))
    # Both walls' directions vote for the rotation: the second's differs by the angles' difference.
    turn = reference.frame[i, 2] - other.frame[j, 2] + 0.5 * apart[i, j]
    c, s = np.cos(turn), np.sin(turn)
    x, y = other.frame[j, 0], other.frame[j, 1]
    proposals = np.column_stack(
        [reference.frame[i, 0] - c * x + s * y, reference.frame[i, 1] - s * x - c * y, turn]
    )
    weight = np.minimum(reference.weight[i], other.weight[j])
    member, votes = _counted(proposals, weight, vote_cell, vote_turn)
    best: IntArray = np.argsort(-votes, kind="stable")[:count]
    return _cell_means(proposals, weight, member, votes, best)


def most_proposed(
    reference: Frames,
    other: Frames,
    tolerance: float,
    vote_cell: float,
    vote_turn: float,
    count: int,
) -> FloatArray:
    """Return (k, 3) transforms that lay corners of `other` on like ones, the most proposed first.

    Proposals are counted in cells, each with the weight of its lesser corner, and averaged there;
    of cells with as many votes, the lower one first.

    Parameters
    ----------
    tolerance
        [rad] between the angles of like corners.
    vote_cell, vote_turn
        [m], [rad] the size of a cell.
    count
        How many at most.
    """
    if COMPILED is None:
        return most_proposed_numpy(reference, other, tolerance, vote_cell, vote_turn, count)
    found = COMPILED.most_proposed(*reference, *other, tolerance, vote_cell, vote_turn, count)
    return cast("FloatArray", found)


def _wrap(angle: FloatArray) -> FloatArray:
    return np.asarray(np.pi - np.mod(np.pi - angle, 2 * np.pi))


def _end_gaps(walls: FloatArray) -> FloatArray:
    """(n, n) smallest distance between ends of two walls [m]."""
    ends = walls.reshape(-1, 2, 2)
    difference = ends[:, None, :, None] - ends[None, :, None, :]
    gaps: FloatArray = np.sqrt((difference**2).sum(axis=-1).min(axis=(2, 3)))
    return gaps


def _counted(
    proposals: FloatArray, weight: FloatArray, vote_cell: float, vote_turn: float
) -> tuple[IntArray, FloatArray]:
    """(p,) the cell of each proposal, and (k,) the votes of each cell."""
    turns = round(2 * np.pi / vote_turn)
    scaled = proposals / np.array([vote_cell, vote_cell, vote_turn])
    scaled[:, 2] = (_wrap(proposals[:, 2]) + np.pi) / (2 * np.pi) * turns
    key = np.floor(scaled).astype(np.int64)
    key[:, 2] %= turns
    low = key.min(axis=0)
    span = key.max(axis=0) - low + 1
    flat = ((key[:, 0] - low[0]) * span[1] + key[:, 1] - low[1]) * turns + key[:, 2]
    cell, inverse = np.unique(flat, return_inverse=True)
    member: IntArray = inverse.astype(np.int64)
    votes: FloatArray = np.bincount(member, weights=weight, minlength=len(cell)).astype(np.float64)
    return member, votes


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
