"""What was seen near segments, and which segments explain it: the loops of choosing a map."""

from typing import cast

import numpy as np
import scipy

from mapweave.kernels.lines.sampling import sample_parts_numpy
from mapweave.kernels.loading import COMPILED
from mapweave.kernels.point_map import Bools, Floats, Ints

Near = tuple[Ints, Ints, Floats, Floats, Floats, Floats]
Gathered = tuple[Floats, Floats, Floats]
Shared = tuple[Ints, Ints, Floats, Floats]


def near_pairs_numpy(segments: Floats, points: Floats, directions: Floats, reach: float) -> Near:
    """Twin of `near_pairs`."""
    run = segments[:, 2:] - segments[:, :2]
    lengths = np.hypot(run[:, 0], run[:, 1])
    own = run / np.maximum(lengths, 1e-12)[:, None]
    if not len(segments) or not len(points):
        return (*np.empty((2, 0), dtype=np.int64), *np.empty((4, 0)))
    around = scipy.spatial.KDTree(points).query_ball_point(
        (segments[:, :2] + segments[:, 2:]) / 2, lengths / 2 + 2 * reach, return_sorted=True
    )
    segment = np.repeat(np.arange(len(segments)), [len(found) for found in around])
    sample = np.concatenate([np.asarray(found, dtype=np.int64) for found in around])
    (u, v), (x, y) = own[segment].T, (points[sample] - segments[segment, :2]).T
    along, across = u * x + v * y, u * y - v * x
    beyond = np.maximum(np.maximum(-along, along - lengths[segment]), 0.0)
    beyond = np.where(lengths[segment] > 0, beyond, np.hypot(x, y))
    near = np.flatnonzero(across**2 + beyond**2 <= reach**2)
    cosine = (own[segment[near]] * directions[sample[near]]).sum(axis=1)
    distance = np.hypot(across, beyond)[near]
    return segment[near], sample[near], along[near], across[near], distance, cosine


def find_shared_numpy(
    segments: Floats, others: Floats, spacing: float, reach: float, least_cosine: float
) -> Shared:
    """Twin of `find_shared`."""
    points, directions, lengths, owner = sample_parts_numpy(others, spacing)
    segment, sample, *_, cosine = near_pairs_numpy(segments, points, directions, reach)
    segment, sample = segment[cosine >= least_cosine], sample[cosine >= least_cosine]
    pairs, place = np.unique(np.column_stack([segment, owner[sample]]), axis=0, return_inverse=True)
    shared = np.bincount(place.ravel(), lengths[sample], len(pairs)).astype(np.float64)
    known = np.zeros(len(points), dtype=np.bool_)
    known[sample] = True
    total, covered = (
        np.bincount(owner, weights, minlength=len(others)) for weights in (lengths, lengths * known)
    )
    share = np.divide(covered, total, out=np.ones(len(others)), where=total > 0)
    first, second = pairs.T.astype(np.int64)
    return first, second, shared, np.asarray(share)


def take_greedily_numpy(
    count: int, segment: Ints, sample: Ints, explains: Bools, weights: Floats, price: float
) -> Ints:
    """Twin of `take_greedily`."""
    sign, left = np.where(explains, 1.0, -1.0), weights.copy()
    gain = np.bincount(segment, sign * left[sample], minlength=count).astype(np.float64)
    chosen: list[int] = []
    while len(gain) and gain[best := int(np.argmax(gain))] > price:
        chosen.append(best)
        settled = np.zeros(len(weights), dtype=np.bool_)
        settled[sample[segment == best]] = True
        lost = np.flatnonzero(settled[sample])
        gain -= np.bincount(segment[lost], sign[lost] * left[sample[lost]], minlength=count)
        left[settled] = 0.0
        gain[best] = -np.inf  # nothing of it is left
    return np.array(chosen, dtype=np.int64)


def gather_numpy(
    points: Floats, directions: Floats, weights: Floats, cell: float, bins: int
) -> Gathered:
    """Twin of `gather`."""
    turn = np.arctan2(directions[:, 1], directions[:, 0]) / (2 * np.pi)
    rows = np.column_stack([np.floor(points / cell), np.floor(turn * bins) % bins])
    _, group = np.unique(rows.astype(np.int64), axis=0, return_inverse=True)
    total = np.bincount(group.ravel(), weights).astype(np.float64)
    place, facing = (
        np.column_stack([np.bincount(group.ravel(), weights * x) / total for x in values.T])
        for values in (points, directions)
    )
    facing /= np.hypot(facing[:, 0], facing[:, 1])[:, None]
    return place, facing, total


def near_pairs(segments: Floats, points: Floats, directions: Floats, reach: float) -> Near:
    """Pair segments with the points within `reach` [m] of them; by segment, then by point.

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m].
    points, directions
        (m, 2) [m] and (m, 2) unit vectors, the same frame.

    Returns
    -------
    segment, point
        (k,) indices.
    along, across
        (k,) the point's place along the segment from its start, and to its left [m].
    distance
        (k,) from the segment [m].
    cosine
        (k,) of the angle between both directions.

    Raises
    ------
    ValueError
        Where shapes do not agree or a number is not finite.
    """
    compute = near_pairs_numpy if COMPILED is None else COMPILED.near_pairs
    return cast("Near", compute(segments, points, directions, reach))


def find_shared(
    segments: Floats, others: Floats, spacing: float, reach: float, least_cosine: float
) -> Shared:
    """Return how much of each of `others` lies along each of `segments`, pair by pair.

    Parameters
    ----------
    segments, others
        (n, 4) and (m, 4) x1 y1 x2 y2 [m], the same frame.
    spacing
        [m] between the places of the others that are looked at, at most.
    reach
        [m] within which such a place lies along a segment…
    least_cosine
        …if that of the angle between both is no less.

    Returns
    -------
    segment, other
        (k,) indices of each pair that shares anything, ascending.
    shared
        (k,) of the other, along the segment [m].
    covered
        (m,) the share of each of the others that lies along any segment, in [0, 1].

    Raises
    ------
    ValueError
        Where a number is not finite.
    """
    compute = find_shared_numpy if COMPILED is None else COMPILED.find_shared
    return cast(
        "Shared",
        compute(
            np.ascontiguousarray(segments),
            np.ascontiguousarray(others),
            spacing,
            reach,
            least_cosine,
        ),
    )


def near_points(first: Floats, second: Floats, reach: float) -> tuple[Ints, Ints]:
    """Pair points (n, 2) with those of (m, 2) within `reach` [m]; by the first, then the other."""
    alone = np.hstack([first, first])
    one, other, *_ = near_pairs(alone, np.ascontiguousarray(second), np.zeros(second.shape), reach)
    return one, other


def take_greedily(
    count: int, segment: Ints, sample: Ints, explains: Bools, weights: Floats, price: float
) -> Ints:
    """Return which of `count` segments to take: always the one of most worth, until `price`.

    What a segment settles is settled for all others. Of equal ones the first is taken.

    Parameters
    ----------
    segment, sample
        (k,) pairs of a segment and a sample that it settles.
    explains
        (k,) whether it explains it, or denies it: then it counts against it.
    weights
        (m,) of the samples.
    price
        Worth above which a segment is taken.

    Raises
    ------
    ValueError
        Where lengths do not agree or a number is out of range.
    """
    compute = take_greedily_numpy if COMPILED is None else COMPILED.take_greedily
    return cast("Ints", compute(count, segment, sample, explains, weights, price))


def gather(points: Floats, directions: Floats, weights: Floats, cell: float, bins: int) -> Gathered:
    """Return the weighted means of samples in one cell and of one direction, and their weights.

    Parameters
    ----------
    points, directions, weights
        (n, 2) [m], (n, 2) unit vectors, (n,) above 0.
    cell
        [m] of the grid.
    bins
        Of a full turn.

    Raises
    ------
    ValueError
        Where lengths do not agree.
    """
    compute = gather_numpy if COMPILED is None else COMPILED.gather
    return cast("Gathered", compute(points, directions, weights, cell, bins))
