"""Samples along lines, evenly spread on each."""

from typing import NamedTuple

import numpy as np

from mapweave.kernels.arrays import FloatArray, IntArray
from mapweave.kernels.loading import COMPILED


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
