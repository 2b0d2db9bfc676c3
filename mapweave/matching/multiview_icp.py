"""Refining a finished submap: its scans fit each other, and the older walls that they saw again.

Tracking places each scan by what was seen before it, so what is seen later cannot put it right,
and its errors add up along a submap. Here all scans of a submap move at once (multi-view ICP): a
point is drawn to its like in the other scans, and to the walls of other submaps, which stay.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.parameters import StageParameters, derived
from mapweave.scan.points import OrientedPoints, join_points

STAYS = -1  # the owner of points that do not move


class MultiviewIcpParameters(StageParameters):
    """How scans of a submap pull at each other, and what holds them."""

    max_points: int = Field(60, ge=10, description="of a scan")
    partners: int = Field(6, ge=1, description="places that a point is drawn to, the nearest")
    normal_weight: float = Field(
        0.4, gt=0, description="[m] how far apart opposite normals hold two points, halved"
    )
    scales: tuple[float, ...] = derived(
        lambda c: tuple(f * c.sensor.range_sigma for f in (7.5, 5.0, 3.0, 2.0, 2.0)),
        description="[m] residual at which a pair's weight has quartered, in each iteration",
    )
    noise: float = derived(
        lambda c: c.sensor.residual_sigma,
        gt=0,
        description="[m] of a point's residual: neighbouring returns err alike",
    )
    step_sigma: float = Field(0.05, gt=0, description="[m] of a tracked step between two scans")
    turn_sigma: float = Field(0.02, gt=0, description="[rad] the same for its turn")
    start_sigma: float = Field(0.03, gt=0, description="[m] of the first scan")
    start_turn: float = Field(0.01, gt=0, description="[rad] of the first scan")


@dataclass(frozen=True, slots=True, eq=False)
class _Pairs:
    """Points and what they are drawn to.

    Attributes
    ----------
    scan, other
        (k,) whose the point is, and whose its partner, which may be `STAYS`.
    normal
        (k, 2) at the partner.
    point
        (k, 2) [m].
    residual
        (k,) [m] from the partner's surface.
    weight
        (k,) share of the pair.
    """

    scan: IntArray
    other: IntArray
    normal: FloatArray
    point: FloatArray
    residual: FloatArray
    weight: FloatArray


def refine(
    oriented: Sequence[OrientedPoints],
    poses: FloatArray,
    walls: OrientedPoints,
    parameters: MultiviewIcpParameters | None = None,
) -> FloatArray:
    """Return the (n, 3) poses at which n scans fit each other and what stays.

    Parameters
    ----------
    surfaces
        Oriented points of each scan, sensor frame.
    poses
        (n, 3) where tracking put them, in the order they were taken [m, m, rad].
    walls
        Oriented points that stay, in the frame of the poses; there may be none.
    """
    p = parameters or MultiviewIcpParameters()
    thinned = [s.at(slice(None, None, 1 + len(s) // (p.max_points + 1))) for s in oriented]
    moving = join_points(thinned)
    owner = np.repeat(np.arange(len(poses)), [len(s) for s in thinned])
    held, tracked = _tracking(len(poses), p), np.array(poses, dtype=float)
    refined = tracked.copy()
    for scale in p.scales:
        pairs = _pair(_placed(moving, refined[owner]), owner, walls, scale, p)
        off = refined - tracked
        off[:, 2] = se2.wrap(off[:, 2])
        refined = refined + _step(pairs, refined, held, off, p)
        refined[:, 2] = se2.wrap(refined[:, 2])
    return refined


def _placed(oriented: OrientedPoints, poses: FloatArray) -> OrientedPoints:
    """Return `surface`, each point at a pose of its own, (n, 3)."""
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])

    def turned(vectors: FloatArray) -> FloatArray:
        x, y = vectors.T
        return np.column_stack([c * x - s * y, s * x + c * y])

    return OrientedPoints(
        turned(oriented.points) + poses[:, :2], turned(oriented.normals), oriented.polyline
    )


def _pair(
    moving: OrientedPoints,
    owner: IntArray,
    walls: OrientedPoints,
    scale: float,
    p: MultiviewIcpParameters,
) -> _Pairs:
    """Find what each point is drawn to: its like in other scans and in what stays."""
    known = join_points([moving, walls])
    whose = np.concatenate([owner, np.full(len(walls), STAYS)])
    features = np.hstack([known.points, p.normal_weight * known.normals])
    distance, index = scipy.spatial.KDTree(features, balanced_tree=False).query(
        features[: len(moving)], k=p.partners + 1, distance_upper_bound=3 * scale
    )
    point, rank = np.nonzero(np.isfinite(distance))
    partner, near = np.asarray(index)[point, rank], np.asarray(distance)[point, rank]
    other = whose[partner] != owner[point]
    point, partner, near = point[other], partner[other], near[other]
    weight = 1 / (1 + (near / scale) ** 2) ** 2  # Geman-McClure
    # However many partners a point has, it was seen once.
    weight /= np.maximum(np.bincount(point, weight, len(moving)), 1.0)[point]
    normal, place = known.normals[partner], moving.points[point]
    residual = np.einsum("ij,ij->i", normal, place - known.points[partner])
    return _Pairs(owner[point], whose[partner], normal, place, residual, weight)


def _step(
    pairs: _Pairs,
    poses: FloatArray,
    held: "scipy.sparse.csc_array",
    off: FloatArray,
    p: MultiviewIcpParameters,
) -> FloatArray:
    """(n, 3) by which the poses move: a Gauss-Newton step.

    `off` (n, 3) is how far they are from where tracking, of normal matrix `held`, put them.
    """
    jacobian = _derivatives(pairs, pairs.scan, poses) - _derivatives(pairs, pairs.other, poses)
    weighted = jacobian.T @ scipy.sparse.diags_array(pairs.weight / p.noise**2)
    pull = weighted @ pairs.residual + held @ off.ravel()
    step = scipy.sparse.linalg.spsolve(scipy.sparse.csc_array(weighted @ jacobian + held), -pull)
    return np.asarray(step).reshape(-1, 3)


def _derivatives(pairs: _Pairs, whose: IntArray, poses: FloatArray) -> "scipy.sparse.csc_array":
    """(k, 3n) of the residuals by the poses of `whose` (k,) points move; what stays has none."""
    moves = np.flatnonzero(whose != STAYS)
    arm = pairs.point[moves] - poses[whose[moves], :2]
    normal = pairs.normal[moves]
    turning = normal[:, 1] * arm[:, 0] - normal[:, 0] * arm[:, 1]
    value = np.column_stack([normal, turning])
    column = 3 * whose[moves, None] + np.arange(3)
    entries = value.ravel(), (np.repeat(moves, 3), column.ravel())
    return scipy.sparse.csc_array(
        scipy.sparse.coo_array(entries, shape=(len(whose), 3 * len(poses)))
    )


def _tracking(n: int, p: MultiviewIcpParameters) -> "scipy.sparse.csc_array":
    """(3n, 3n) normal matrix of the n - 1 tracked steps and of the first pose.

    Of small corrections in the common frame: neighbours move and turn alike.
    """
    steps = scipy.sparse.eye_array(n) - scipy.sparse.eye_array(n, k=-1)
    sigmas = np.tile([p.step_sigma, p.step_sigma, p.turn_sigma], (n, 1))
    sigmas[0] = [p.start_sigma, p.start_sigma, p.start_turn]
    difference = scipy.sparse.csc_array(scipy.sparse.kron(steps, scipy.sparse.eye_array(3)))
    return scipy.sparse.csc_array(
        difference.T @ scipy.sparse.diags_array(sigmas.ravel() ** -2) @ difference
    )
