"""Alignment: the Iterative Closest Point algorithm on oriented points (paper, V, Alignment).

The paper extends ICP [5] to respect the correspondence of polylines. Here a point finds its
partner among points with a like normal, seen from the same side, which rules out partners
around corners and behind walls; and, where corresponding polylines are known, a pair on two
that do not correspond does not pull. They are known where shapes have proposed the start, in
tracking; fusion, loops and the predicted pose go by normals alone. Distances are measured along the
partner's normal, because a wall holds a point across it and not along it.
"""

from dataclasses import dataclass

import numpy as np
import scipy
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.parameters import StageParameters, derived
from mapweave.scan.points import OrientedPoints, join_points


class IcpParameters(StageParameters):
    """How far points look for partners and how strongly they pull."""

    normal_weight: float = Field(
        0.4, gt=0, description="[m] how far apart opposite normals hold two points, halved"
    )
    start_scale: float = Field(
        0.35,
        gt=0,
        description="[m] residual at which a pair's weight is a quarter, first iteration",
    )
    end_scale: float = derived(
        lambda c: 2 * c.sensor.range_sigma,
        gt=0,
        description="[m] the same at the end: some 2 sigma (SICK)",
    )
    shrink: float = Field(0.75, gt=0, lt=1, description="of the scale, each iteration")
    max_iterations: int = Field(25, ge=1)
    converged: float = Field(
        2e-4, gt=0, description="[m, rad] smallest step worth another iteration"
    )
    noise: float = derived(
        lambda c: c.sensor.residual_sigma,
        gt=0,
        description="[m] of a residual against the prior; above the sensor's, because neighbouring"
        " returns err alike",
    )


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """What is aligned to: oriented points, searchable.

    Attributes
    ----------
    surface
        Oriented points in the target's frame.
    tree
        Over (n, 4) points and weighted normals.
    """

    oriented: OrientedPoints
    tree: "scipy.spatial.KDTree"

    @classmethod
    def of(cls, oriented: OrientedPoints, parameters: IcpParameters) -> "Target":
        """Index `surface`."""
        return cls(
            oriented, scipy.spatial.KDTree(_features(oriented, parameters), balanced_tree=False)
        )


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Where ICP ended.

    Attributes
    ----------
    pose
        (3,) of the moving surface in the target's frame [m, m, rad].
    information
        (3, 3) of the pairs at the end: weighted sum of the squared derivatives of the residuals,
        each in units of one point; its eigenvectors tell which direction is held.
    """

    pose: FloatArray
    information: FloatArray


def align(
    moving: OrientedPoints,
    target: Target,
    start: FloatArray,
    parameters: IcpParameters,
    prior: FloatArray | None = None,
    corresponding: BoolArray | None = None,
) -> Fit:
    """Move `moving` from `start` (3,) until it lies on `target`; see `align_all`."""
    return align_all(moving, target, start[None], parameters, prior, corresponding)[0]


def align_all(
    moving: OrientedPoints,
    target: Target,
    starts: FloatArray,
    parameters: IcpParameters,
    prior: FloatArray | None = None,
    corresponding: BoolArray | None = None,
) -> list[Fit]:
    """Move `moving` from each of `starts` (k, 3) until it lies on `target`.

    All at once, because one question to the tree about many points is much faster than many.

    Parameters
    ----------
    prior
        (3, 3) information [1/m², 1/rad²] that holds a pose at its start; decides the directions
        that the surfaces leave open.
    corresponding
        (target's polylines, moving one's polylines) which pairs of polylines may pull. A point's
        partner is its nearest of all; where the polylines of the two do not correspond, or
        either is on none, the pair is left out, and no farther partner is looked for. Without
        it all pairs pull.
    """
    poses = np.array(starts, dtype=float)
    information = np.zeros((len(poses), 3, 3))
    weakest = np.diag([1e-6, 1e-6, 1e-6])  # [1/m², 1/rad²] so that a start without pairs stays
    held = weakest if prior is None else prior + weakest
    scale = parameters.start_scale
    moves = np.arange(len(poses))  # those that have not settled
    for _ in range(parameters.max_iterations):
        pairs = _pairs(moving, target, poses[moves], scale, parameters, corresponding)
        information[moves], gradient = _linearise(pairs, poses[moves], scale)
        error = poses[moves] - starts[moves]
        error[:, 2] = se2.wrap(error[:, 2])
        system = information[moves] / parameters.noise**2 + held
        force = gradient / parameters.noise**2 + error @ held
        step = -np.linalg.solve(system, force[..., None])[..., 0]
        poses[moves] += step
        if scale <= parameters.end_scale:
            moves = moves[np.abs(step).max(axis=1) >= parameters.converged]
            if len(moves) == 0:
                break
        scale = max(parameters.end_scale, scale * parameters.shrink)
    poses[:, 2] = se2.wrap(poses[:, 2])
    return [Fit(pose, held_by) for pose, held_by in zip(poses, information, strict=True)]


def partners(
    moving: OrientedPoints, target: Target, parameters: IcpParameters, reach: float
) -> tuple[FloatArray, IntArray]:
    """Return each moving point's distance to its partner and the partner's index.

    `moving` is in the target's frame. Without a partner within `reach` [m] the distance is
    infinite and the index ``len(target.surface)``.
    """
    distance, index = target.tree.query(_features(moving, parameters), distance_upper_bound=reach)
    return np.asarray(distance, dtype=np.float64), np.asarray(index, dtype=np.int64)


def _features(oriented: OrientedPoints, parameters: IcpParameters) -> FloatArray:
    """(n, 4): nearness in place and in normal at once."""
    return np.hstack([oriented.points, parameters.normal_weight * oriented.normals])


@dataclass(frozen=True, slots=True, eq=False)
class _Pairs:
    """Points and their partners, n for each of k poses; those without a partner weigh nothing.

    Attributes
    ----------
    points
        (k, n, 2) moving points, target's frame [m].
    distance
        (k, n) to the partner, in place and in normal [m]; infinite without one.
    residual
        (k, n) across the partner's surface [m].
    normals
        (k, n, 2) of the partners.
    """

    points: FloatArray
    distance: FloatArray
    residual: FloatArray
    normals: FloatArray


def _pairs(
    moving: OrientedPoints,
    target: Target,
    poses: FloatArray,
    scale: float,
    parameters: IcpParameters,
    corresponding: BoolArray | None,
) -> _Pairs:
    """Find the partners of all points of `moving` at each of `poses` (k, 3)."""
    placed = join_points([moving.moved(pose) for pose in poses])
    distance, index = partners(placed, target, parameters, 3 * scale)
    index[index == len(target.oriented)] = 0  # any: an infinite distance weighs nothing
    if corresponding is not None:
        theirs, ours = target.oriented.polyline[index], placed.polyline
        pulls = corresponding[theirs, ours] & (theirs >= 0) & (ours >= 0)
        distance[~pulls] = np.inf
    normals = target.oriented.normals[index]
    residual = np.einsum("ij,ij->i", normals, placed.points - target.oriented.points[index])
    shape = (len(poses), len(moving))
    return _Pairs(
        placed.points.reshape(*shape, 2),
        distance.reshape(shape),
        residual.reshape(shape),
        normals.reshape(*shape, 2),
    )


def _linearise(pairs: _Pairs, poses: FloatArray, scale: float) -> tuple[FloatArray, FloatArray]:
    """Normal matrices (k, 3, 3), gradients (k, 3) of the robust point-to-line cost at `poses`."""
    weight = 1 / (1 + (pairs.distance / scale) ** 2) ** 2  # Geman-McClure
    arm = pairs.points - poses[:, None, :2]
    normals = pairs.normals
    turning = normals[..., 1] * arm[..., 0] - normals[..., 0] * arm[..., 1]
    jacobian = np.concatenate([normals, turning[..., None]], axis=-1)
    weighted = jacobian * weight[..., None]
    gradient = np.einsum("kni,kn->ki", weighted, pairs.residual)
    normal_matrix: FloatArray = weighted.transpose(0, 2, 1) @ jacobian
    return normal_matrix, gradient
