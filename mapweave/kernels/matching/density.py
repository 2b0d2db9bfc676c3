"""How many times wall is drawn: what several submaps saw is drawn once in each."""

from typing import cast

import numpy as np
import scipy

from mapweave.kernels.arrays import FloatArray
from mapweave.kernels.loading import COMPILED

BITS = 64  # parts of the wall around a sample, each covered or not


def times_drawn_numpy(
    points: FloatArray, normals: FloatArray, length: FloatArray, radius: float, min_cosine: float
) -> FloatArray:
    """Twin of `times_drawn`."""
    if not points.shape == normals.shape == (len(length), 2):
        raise ValueError("points and normals: (n, 2) each expected, with n lengths")
    near = scipy.spatial.cKDTree(points).query_pairs(radius, output_type="ndarray")
    alone = np.arange(len(points))
    first = np.concatenate([alone, near[:, 0], near[:, 1]])
    other = np.concatenate([alone, near[:, 1], near[:, 0]])
    alike = (normals[first] * normals[other]).sum(axis=1) > min_cosine
    first, other = first[alike], other[alike]
    away, facing = points[other] - points[first], normals[first]
    along = away[:, 0] * facing[:, 1] - away[:, 1] * facing[:, 0]
    ends = along[:, None] + length[other, None] * [-0.5, 0.5]
    low, high = np.clip(np.floor((ends / radius + 1) * (BITS // 2)), 0, BITS).astype(np.int64).T
    covered = np.zeros((len(points), BITS), dtype=np.bool_)
    bit = np.arange(BITS)
    part = (bit >= low[:, None]) & (bit < high[:, None])
    np.logical_or.at(covered, first, part)
    drawn = np.bincount(first, part.sum(axis=1), len(points))
    count = covered.sum(axis=1)
    return np.where(count > 0, drawn / np.maximum(count, 1), 1.0)


def times_drawn(
    points: FloatArray, normals: FloatArray, length: FloatArray, radius: float, min_cosine: float
) -> FloatArray:
    """Return (n,) how many times the wall around each sample is drawn, on the mean: 1 or more.

    Of the wall that faces as the sample does, within `radius` along it: its length over the length
    that it covers.

    Parameters
    ----------
    points, normals
        (n, 2) samples [m], and where they face, unit vectors.
    length
        (n,) metres of wall that each stands for.
    radius
        [m] around a sample.
    min_cosine
        Of the angle between two normals, above which they face alike.

    Raises
    ------
    ValueError
        Where lengths do not agree, or a point is not finite.
    """
    compute = times_drawn_numpy if COMPILED is None else COMPILED.times_drawn
    return cast("FloatArray", compute(points, normals, length, radius, min_cosine))
