"""Directed line segments as (n, 4) arrays x1, y1, x2, y2 [m], and vectors in the plane."""

from typing import NamedTuple

import numpy as np

from mapweave.geometry.arrays import FloatArray, IntArray


class Samples(NamedTuple):
    """Points along segments.

    Attributes
    ----------
    points
        (m, 2) [m].
    directions
        (m, 2) unit vectors: of the segment that each lies on.
    lengths
        (m,) how much of it each stands for [m].
    owner
        (m,) its index.
    """

    points: FloatArray
    directions: FloatArray
    lengths: FloatArray
    owner: IntArray


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


def sample(segments: FloatArray, spacing: float) -> Samples:
    """Return points in the middle of equal parts, `spacing` [m] at most, of (n, 4) `segments`."""
    directions, length = units(segments)
    counts = np.maximum(1, np.ceil(length / spacing)).astype(np.int64)
    owner = np.repeat(np.arange(len(segments)), counts)
    rank = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    part = (length / counts)[owner]
    points = segments[owner, :2] + ((rank + 0.5) * part)[:, None] * directions[owner]
    return Samples(points, directions[owner], part, owner)
