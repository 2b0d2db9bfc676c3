"""What samples of one map's walls find in the raster of another: walls, or space seen through."""

from typing import cast

import numpy as np

from mapweave.kernels.arrays import BoolArray, Float32Array, FloatArray, Int32Array
from mapweave.kernels.loading import COMPILED


def judge_samples_numpy(
    points: FloatArray,
    normals: FloatArray,
    pose: FloatArray,
    facing: FloatArray,
    nearest: Int32Array,
    distance: Float32Array,
    depth: Float32Array,
    origin: FloatArray,
    cell: float,
    closeness: float,
    min_cosine: float,
    clearance: float,
) -> tuple[BoolArray, BoolArray, Float32Array]:
    """Twin of `judge_samples`."""
    if not points.shape == normals.shape == (len(points), 2):
        raise ValueError("points and normals: (n, 2) each expected")
    c, s = np.cos(pose[2]), np.sin(pose[2])
    turn = np.array([[c, s], [-s, c]])
    index = np.floor((points @ turn + pose[:2] - origin) / cell)
    inside = ((index >= 0) & (index < nearest.shape)).all(axis=1)
    i, j = np.where(inside[:, None], index, 0).astype(np.int64).T
    apart = np.where(inside, distance[i, j], np.float32(np.inf))
    near = apart < closeness
    cosine = ((normals @ turn) * facing[nearest[i, j]]).sum(axis=1)
    return near & (cosine > min_cosine), inside & ~near & (depth[i, j] > clearance), apart


def judge_samples(
    points: FloatArray,
    normals: FloatArray,
    pose: FloatArray,
    facing: FloatArray,
    nearest: Int32Array,
    distance: Float32Array,
    depth: Float32Array,
    origin: FloatArray,
    cell: float,
    closeness: float,
    min_cosine: float,
    clearance: float,
) -> tuple[BoolArray, BoolArray, Float32Array]:
    """Return (n,) which samples coincide with walls, which were seen through, how far walls are.

    The distance is infinite outside of the raster.

    Parameters
    ----------
    points, normals
        (n, 2) samples [m], and where they face.
    pose
        (3,) takes them into the raster's frame [m, m, rad].
    facing
        (m, 2) where the samples of the raster's walls face.
    nearest, distance, depth
        (rows, columns) the sample nearest to each cell, how far it is [m], and how deep in free
        space the cell lies [m].
    origin, cell
        (2,) the raster's corner [m]; the cells' size [m].
    closeness, min_cosine
        [m] within which, and of the normals above which, a sample coincides.
    clearance
        [m] of free space beyond which a sample that is not so near was seen through.

    Raises
    ------
    ValueError
        Where lengths do not agree.
    """
    compute = judge_samples_numpy if COMPILED is None else COMPILED.judge_samples
    coincides, through, apart = compute(
        *(points, normals, pose, facing, nearest, distance, depth),
        *(origin, cell, closeness, min_cosine, clearance),
    )
    found = coincides.view(np.bool_), through.view(np.bool_), apart
    return cast("tuple[BoolArray, BoolArray, Float32Array]", found)
