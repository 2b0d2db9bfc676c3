"""Samples along lines, evenly spread on each."""

from typing import NamedTuple

import numpy as np

from mapweave.kernels.arrays import FloatArray, IntArray
from mapweave.kernels.loading import COMPILED


class PartSamples(NamedTuple):
    """Points in the middle of equal parts of segments, segment by segment.

    Attributes
    ----------
    points, directions
        (n, 2) [m], and unit vectors along the segment; zero where that has no length.
    lengths
        (n,) how much of it each stands for [m].
    owner
        (n,) its index.
    """

    points: FloatArray
    directions: FloatArray
    lengths: FloatArray
    owner: IntArray


class LineSamples(NamedTuple):
    """Samples, line by line.

    Attributes
    ----------
    points, normals
        (n, 2) [m], and unit vectors to the left of the line, where it is seen from.
    owner
        (n,) the line that each is on.
    metres
        (n,) [m] of it that each stands for.
    """

    points: FloatArray
    normals: FloatArray
    owner: IntArray
    metres: FloatArray


def sample_lines_numpy(segments: FloatArray, spacing: float) -> LineSamples:
    """Twin of `sample_lines`."""
    directions = segments[:, 2:] - segments[:, :2]
    lengths = np.hypot(directions[:, 0], directions[:, 1])
    counts = np.maximum(1, np.round(lengths / spacing)).astype(np.int64)
    owner = np.repeat(np.arange(len(segments)), counts)
    rank = np.arange(len(owner)) - (np.cumsum(counts) - counts)[owner]
    fraction = (rank + 0.5) / counts[owner]
    points = segments[owner, :2] + fraction[:, None] * directions[owner]
    left = np.column_stack([-directions[:, 1], directions[:, 0]])
    normals = left / np.maximum(lengths, 1e-12)[:, None]
    return LineSamples(points, normals[owner], owner, (lengths / counts)[owner])


def sample_lines(segments: FloatArray, spacing: float) -> LineSamples:
    """Return samples of (k, 4) `segments` [m], about `spacing` [m] apart, of each one at least.

    Raises
    ------
    ValueError
        Where segments are not finite, compiled.
    """
    if COMPILED is None:
        return sample_lines_numpy(segments, spacing)
    return LineSamples(*COMPILED.sample_lines(np.ascontiguousarray(segments), spacing))


def sample_parts_numpy(segments: FloatArray, spacing: float) -> PartSamples:
    """Twin of `sample_parts`."""
    along = segments[:, 2:] - segments[:, :2]
    length = np.hypot(along[:, 0], along[:, 1])
    directions = along / np.maximum(length, 1e-12)[:, None]
    counts = np.maximum(1, np.ceil(length / spacing)).astype(np.int64)
    owner = np.repeat(np.arange(len(segments)), counts)
    rank = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    part = (length / counts)[owner]
    points = segments[owner, :2] + ((rank + 0.5) * part)[:, None] * directions[owner]
    return PartSamples(points, directions[owner], part, owner)


def sample_parts(segments: FloatArray, spacing: float) -> PartSamples:
    """Return the middles of equal parts, `spacing` [m] long at most, of (k, 4) `segments` [m].

    Raises
    ------
    ValueError
        Where segments have no end or samples are too many, compiled.
    """
    if COMPILED is None:
        return sample_parts_numpy(segments, spacing)
    return PartSamples(*COMPILED.sample_parts(np.ascontiguousarray(segments), spacing))
