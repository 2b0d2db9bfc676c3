"""Directed line segments as (n, 4) arrays x1, y1, x2, y2 [m], and vectors in the plane."""

import numpy as np

from mapweave.geometry.arrays import FloatArray


def lengths(segments: FloatArray) -> FloatArray:
    """Return (n,) lengths [m] of (n, 4) `segments`."""
    return np.asarray(np.hypot(*(segments[:, 2:] - segments[:, :2]).T))


def units(segments: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (n, 2) unit directions and (n,) lengths [m] of (n, 4) `segments`.

    The direction of a segment without length is (0, 0).
    """
    length = lengths(segments)
    return (segments[:, 2:] - segments[:, :2]) / np.maximum(length, 1e-12)[:, None], length


def cross(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return (k,) cross products of (k, 2) vectors."""
    return np.asarray(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])


def near_intervals(
    segments: FloatArray, walls: FloatArray, reach: float
) -> tuple[FloatArray, FloatArray]:
    """Return where each of (k, 4) `segments` is within `reach` [m] of the wall of its row.

    What is within reach of a wall is convex, a rectangle with a half disc at both ends: of a
    straight line it holds one interval.

    Returns
    -------
    tuple of FloatArray
        (k,) first and last share of the segment's length in [0, 1]; first > last where it is
        nowhere so near.
    """
    start, along = segments[:, :2], segments[:, 2:] - segments[:, :2]
    beside = _beside(start - walls[:, :2], along, walls, reach)
    ends = [_disc(start - end, along, reach) for end in (walls[:, :2], walls[:, 2:])]
    parts = [
        (np.where(first <= last, first, np.inf), np.where(first <= last, last, -np.inf))
        for first, last in (beside, *ends)
    ]
    first = np.minimum.reduce([part[0] for part in parts])
    last = np.maximum.reduce([part[1] for part in parts])
    return np.maximum(first, 0.0), np.minimum(last, 1.0)


def _beside(
    offset: FloatArray, along: FloatArray, walls: FloatArray, reach: float
) -> tuple[FloatArray, FloatArray]:
    """Return where lines are in the rectangle of `reach` on both sides of a wall."""
    direction, length = units(walls)
    normal = np.column_stack([-direction[:, 1], direction[:, 0]])
    over = _slab(offset, along, direction, np.zeros(len(walls)), length)
    near = _slab(offset, along, normal, np.full(len(walls), -reach), np.full(len(walls), reach))
    first, last = np.maximum(over[0], near[0]), np.minimum(over[1], near[1])
    return np.where(length > 0, first, np.inf), np.where(length > 0, last, -np.inf)


def _slab(
    offset: FloatArray, along: FloatArray, axis: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return where lines are between `low` and `high` [m] along the unit vectors `axis`."""
    position, speed = np.einsum("ij,ij->i", offset, axis), np.einsum("ij,ij->i", along, axis)
    # Along a line that hardly nears the slab it is infinitely far.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        one, other = (low - position) / speed, (high - position) / speed
    still = speed == 0
    inside = (low <= position) & (position <= high)
    first = np.where(still, np.where(inside, -np.inf, np.inf), np.minimum(one, other))
    last = np.where(still, np.where(inside, np.inf, -np.inf), np.maximum(one, other))
    return first, last


def _disc(offset: FloatArray, along: FloatArray, radius: float) -> tuple[FloatArray, FloatArray]:
    """Return where lines are within `radius` [m] of a point; `offset`: of their start from it."""
    a = np.einsum("ij,ij->i", along, along)
    b, c = np.einsum("ij,ij->i", offset, along), np.einsum("ij,ij->i", offset, offset) - radius**2
    root = np.sqrt(np.maximum(b**2 - a * c, 0.0))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        first, last = (-b - root) / a, (-b + root) / a
    hit = (a > 0) & (b**2 > a * c)
    return np.where(hit, first, np.inf), np.where(hit, last, -np.inf)
