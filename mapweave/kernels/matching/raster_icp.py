"""ICP of many starts at once, by look-up in a raster: a sample's partner is its cell's."""

from typing import cast

import numpy as np

from mapweave.kernels.arrays import BoolArray, FloatArray, Int32Array
from mapweave.kernels.loading import COMPILED


def align_on_raster_numpy(
    points: FloatArray,
    normals: FloatArray,
    most: int,
    poses: FloatArray,
    scales: FloatArray,
    walls: FloatArray,
    facing: FloatArray,
    nearest: Int32Array,
    origin: FloatArray,
    cell: float,
    min_cosine: float,
    held: float,
) -> FloatArray:
    """Twin of `align_on_raster`: all poses at once."""
    if not points.shape == normals.shape == (len(points), 2):
        raise ValueError("points and normals: (n, 2) each expected")
    stride = 1 + max(len(points) - 1, 0) // most
    middle = points[::stride].mean(axis=0) if len(points) else np.zeros(2)
    points, normals = points[::stride] - middle, normals[::stride]
    damping, (u, v) = held * max(len(points), 1) * np.eye(3), normals.T
    poses = _about(poses, middle)
    for scale in scales:
        c, s = np.cos(poses[:, 2, None]), np.sin(poses[:, 2, None])
        x, y = points.T
        arm = np.stack([c * x - s * y, s * x + c * y], axis=-1)
        placed = arm + poses[:, None, :2]
        partner, inside = _partners(placed, nearest, origin, cell)
        apart, there = placed - walls[partner], facing[partner]
        cosine = (c * u - s * v) * there[..., 0] + (s * u + c * v) * there[..., 1]
        squared = (apart**2).sum(axis=-1)
        weight = 1 / (1 + squared / scale**2) ** 2  # Geman-McClure
        weight[~inside | (cosine < min_cosine) | (squared > 9 * scale**2)] = 0
        residual = (there * apart).sum(axis=-1)
        lever = there[..., 1] * arm[..., 0] - there[..., 0] * arm[..., 1]
        jacobian = np.concatenate([there, lever[..., None]], axis=-1)
        weighted = (jacobian * weight[..., None]).transpose(0, 2, 1)
        gradient = weighted @ residual[..., None]
        poses = poses - np.linalg.solve(weighted @ jacobian + damping, gradient)[..., 0]
    return _about(poses, -middle)


def align_on_raster(
    points: FloatArray,
    normals: FloatArray,
    most: int,
    poses: FloatArray,
    scales: FloatArray,
    walls: FloatArray,
    facing: FloatArray,
    nearest: Int32Array,
    origin: FloatArray,
    cell: float,
    min_cosine: float,
    held: float,
) -> FloatArray:
    """Return (k, 3) `poses` after one Gauss-Newton step of the robust cost at each scale.

    Parameters
    ----------
    points, normals
        (n, 2) the moving samples [m], and where they face.
    most
        How many of these, at the most, are looked at.
    poses
        (k, 3) where each alignment starts [m, m, rad].
    scales
        (s,) residual at which a pair's weight is a quarter [m], one an iteration.
    walls, facing
        (m, 2) samples of walls in the raster [m], and where they face.
    nearest
        (rows, columns) which of those is nearest to each cell. Outside no sample has a partner.
    origin, cell
        (2,) the raster's corner [m]; the cells' size [m].
    min_cosine
        Of the normals of a pair.
    held
        Share of the samples by whose weight is held what the walls leave open.

    Raises
    ------
    ValueError
        Where lengths do not agree.
    """
    compute = align_on_raster_numpy if COMPILED is None else COMPILED.align_on_raster
    moved = compute(
        *(points, normals, most, poses, scales, walls, facing),
        *(nearest, origin, cell, min_cosine, held),
    )
    return cast("FloatArray", moved)


def _partners(
    points: FloatArray, nearest: Int32Array, origin: FloatArray, cell: float
) -> tuple[Int32Array, BoolArray]:
    """The sample nearest to the cell of each of (..., 2) `points`, and whether there is a cell."""
    index = np.floor((points - origin) / cell)
    inside: BoolArray = np.all((index >= 0) & (index < nearest.shape), axis=-1)
    index = np.where(inside[..., None], index, 0).astype(np.int64)
    return nearest[index[..., 0], index[..., 1]], inside


def _about(poses: FloatArray, middle: FloatArray) -> FloatArray:
    """(k, 3) the same motions of coordinates less `middle` (2,): turns and shifts apart."""
    (x, y), turn = middle, poses[:, 2]
    c, s = np.cos(turn), np.sin(turn)
    wrapped = np.pi - np.mod(np.pi - turn, 2 * np.pi)
    return np.column_stack([poses[:, 0] + c * x - s * y, poses[:, 1] + s * x + c * y, wrapped])
