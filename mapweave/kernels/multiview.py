"""Multi-view ICP: what the points of all scans say of all their poses, as normal equations."""

from typing import cast

import numpy as np
import scipy

from mapweave.kernels.loading import COMPILED
from mapweave.kernels.point_map import Floats, Ints

STAYS = -1  # the owner of points that do not move


def normal_equations_numpy(
    points: Floats,
    normals: Floats,
    owner: Ints,
    poses: Floats,
    walls: Floats,
    wall_normals: Floats,
    normal_weight: float,
    partners: int,
    scale: float,
) -> tuple[Floats, Floats]:
    """Twin of `normal_equations`."""
    matrix, pull = np.zeros((3 * len(poses), 3 * len(poses))), np.zeros(3 * len(poses))
    if not len(points):
        return matrix, pull
    c, s = np.cos(poses[owner, 2]), np.sin(poses[owner, 2])
    placed, turned = (
        np.column_stack([c * x - s * y, s * x + c * y]) for x, y in (points.T, normals.T)
    )
    places = np.concatenate([placed + poses[owner, :2], walls])
    facing = np.concatenate([turned, wall_normals])
    whose = np.concatenate([owner, np.full(len(walls), STAYS)])
    features = np.hstack([places, normal_weight * facing])
    distance, index = scipy.spatial.KDTree(features, balanced_tree=False).query(
        features[: len(points)], k=partners + 1, distance_upper_bound=3 * scale
    )
    point, rank = np.nonzero(np.isfinite(distance))
    partner, near = np.asarray(index)[point, rank], np.asarray(distance)[point, rank]
    other = whose[partner] != owner[point]
    point, partner, near = point[other], partner[other], near[other]
    weight = 1 / (1 + (near / scale) ** 2) ** 2  # Geman-McClure
    # However many partners a point has, it was seen once.
    weight /= np.maximum(np.bincount(point, weight, len(points)), 1.0)[point]
    residual = (facing[partner] * (places[point] - places[partner])).sum(axis=1)
    rows = np.zeros((len(point), 3 * len(poses)))
    for sign, ends in ((1.0, owner[point]), (-1.0, whose[partner])):
        moves = np.flatnonzero(ends != STAYS)
        (u, v), (x, y) = facing[partner[moves]].T, (places[point] - poses[ends, :2])[moves].T
        column = 3 * ends[moves, None] + np.arange(3)
        rows[moves[:, None], column] += sign * np.column_stack([u, v, v * x - u * y])
    return rows.T @ (weight[:, None] * rows), rows.T @ (weight * residual)


def normal_equations(
    points: Floats,
    normals: Floats,
    owner: Ints,
    poses: Floats,
    walls: Floats,
    wall_normals: Floats,
    normal_weight: float,
    partners: int,
    scale: float,
) -> tuple[Floats, Floats]:
    """Return the (3n, 3n) matrix and (3n,) pull of the point-to-line residuals of n scans.

    Each point is drawn to its nearest partners, of place and normal at once; those in its own scan
    do not count.

    Parameters
    ----------
    points, normals, owner
        (m, 2) [m] and (m, 2) unit vectors in the frame of the scan (m,) that each is of.
    poses
        (n, 3) of the scans [m, m, rad].
    walls, wall_normals
        (w, 2) and (w, 2) what stays, in the frame of the poses.
    normal_weight
        [m] how far apart opposite normals hold two points, halved.
    partners
        How many a point is drawn to at the most.
    scale
        [m] residual at which a pair's weight has quartered; partners are within three times that.

    Raises
    ------
    ValueError
        Where lengths do not agree or a number is out of range.
    """
    compute = normal_equations_numpy if COMPILED is None else COMPILED.normal_equations
    found = compute(
        points, normals, owner, poses, walls, wall_normals, normal_weight, partners, scale
    )
    return cast("tuple[Floats, Floats]", found)


def solve_positive(matrix: Floats, right: Floats) -> Floats:
    """Return the (n,) solution of a symmetric, positive definite (n, n) system.

    In one thread: a library's threads cost more than they save on some hundred unknowns.

    Raises
    ------
    ValueError
        Where lengths do not agree, or the matrix is not positive definite.
    """
    if COMPILED is None:
        return scipy.linalg.cho_solve(scipy.linalg.cho_factor(matrix), right)
    return cast("Floats", COMPILED.solve_positive(matrix, right))
