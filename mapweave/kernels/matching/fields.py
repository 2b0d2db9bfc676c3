"""A line map, sampled and rasterised: what most of comparing maps looks things up in.

What several submaps saw is drawn once in each, and counts once.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy

from mapweave.kernels.arrays import Float32Array, FloatArray, Int32Array, IntArray
from mapweave.kernels.lines.sampling import sample_lines_numpy
from mapweave.kernels.loading import COMPILED
from mapweave.kernels.matching.rasters import depths_numpy, nearest_samples_numpy

BITS = 64  # parts of the wall around a sample, each covered or not


class Rasterised(NamedTuple):
    """Samples of walls, and cells around them; rows run along x and columns along y.

    Attributes
    ----------
    points, normals
        (n, 2) samples [m], and unit vectors to the left of their line, where it is seen from.
    segment
        (n,) which segment each is of.
    weight
        (n,) metres of wall that each stands for; a part of them where the wall is drawn again.
    facing
        (n,) where the normal of each points, in [0, 1) turns.
    own_depth
        (n,) how deep each lies in the free space [m].
    origin, cell
        (2,) the corner of the cells [m]; their size [m].
    nearest, distance
        (rows, columns) which sample is nearest to each cell, and how far it is [m].
    depth
        (rows, columns) how deep each cell lies in the free space [m], 0 outside.
    """

    points: FloatArray
    normals: FloatArray
    segment: IntArray
    weight: FloatArray
    facing: FloatArray
    own_depth: Float32Array
    origin: FloatArray
    cell: float
    nearest: Int32Array
    distance: Float32Array
    depth: Float32Array


def rasterised_numpy(
    segments: FloatArray,
    support: IntArray,
    free_space: Sequence[FloatArray],
    spacing: float,
    full_support: int,
    same_wall: float,
    min_cosine: float,
    border: float,
    cell: float,
    max_cells: float,
) -> Rasterised:
    """Twin of `rasterised`; of samples equally near a cell it may choose another."""
    points, normals, segment, step = sample_lines_numpy(segments, spacing)
    weight = np.minimum(1.0, support / full_support)[segment] * step
    if same_wall > 0:
        weight = weight / times_drawn_numpy(points, normals, step, same_wall, min_cosine)
    low, high = points.min(axis=0) - border, points.max(axis=0) + border
    cell = max(cell, float(np.sqrt(np.prod(high - low) / max_cells)))
    rows, columns = (int(n) for n in np.ceil((high - low) / cell) + 1)
    nearest, distance = nearest_samples_numpy(points, low, cell, rows, columns)
    depth = depths_numpy(free_space, low, cell, rows, columns)
    i, j = ((points - low) / cell).astype(np.int64).T
    facing = np.arctan2(normals[:, 1], normals[:, 0]) / (2 * np.pi) % 1.0
    samples = points, normals, segment, weight, facing, depth[i, j]
    return Rasterised(*samples, low, cell, nearest, distance, depth)


def rasterised(
    segments: FloatArray,
    support: IntArray,
    free_space: Sequence[FloatArray],
    spacing: float,
    full_support: int,
    same_wall: float,
    min_cosine: float,
    border: float,
    cell: float,
    max_cells: float,
) -> Rasterised:
    """Return samples and cells of (k, 4) `segments` [m], one at least.

    Parameters
    ----------
    support, full_support
        (k,) how many scans saw each; how many make it count in full.
    free_space
        Simple polygons (m, 2) [m]. What lies beyond the cells is not in them.
    spacing
        [m] between samples.
    same_wall, min_cosine
        [m] around a sample within which wall counts once; of normals of such wall. At 0 all counts.
    border
        [m] around the samples.
    cell, max_cells
        [m], or more, so that there are no more than so many.

    Raises
    ------
    ValueError
        Where lengths do not agree, or, compiled, a number is not finite.
    """
    asked = spacing, full_support, same_wall, min_cosine, border, cell, max_cells
    if COMPILED is None:
        return rasterised_numpy(segments, support, free_space, *asked)
    return Rasterised(*COMPILED.rasterised(segments, support, free_space, *asked))


def times_drawn_numpy(
    points: FloatArray, normals: FloatArray, length: FloatArray, radius: float, min_cosine: float
) -> FloatArray:
    """Return (n,) how many times the wall around each sample is drawn, on the mean: 1 or more.

    Of the wall that faces as the sample does, within `radius` [m] along it: its length, each sample
    standing for (n,) `length` [m], over the length that it covers.
    """
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
