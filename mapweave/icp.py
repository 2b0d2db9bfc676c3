"""Alignment: the Iterative Closest Point algorithm on oriented points (paper, V, Alignment).

The paper extends ICP [5] to respect the correspondence of polylines. Here a point finds its
partner among points with a like normal, seen from the same side, which rules out partners
around corners and behind walls; and, where corresponding polylines are known, a pair on two
that do not correspond does not pull. Distances are measured along the partner's normal, because
a wall holds a point across it and not along it.
"""

from dataclasses import dataclass

import numpy as np
from pydantic import BaseModel, ConfigDict, Field
from scipy.spatial import KDTree

from mapweave import se2
from mapweave.arrays import BoolArray, FloatArray, IntArray
from mapweave.surface import Surface


class IcpParameters(BaseModel):
    """How far points look for partners and how strongly they pull."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    normal_weight: float = Field(
        0.4, gt=0, description="[m] how far apart opposite normals hold two points, halved"
    )
    start_scale: float = Field(
        0.35, gt=0, description="[m] residual at which a pair's weight has halved, first iteration"
    )
    end_scale: float = Field(0.04, gt=0, description="[m] the same at the end: some 2 sigma (SICK)")
    shrink: float = Field(0.75, gt=0, lt=1, description="of the scale, each iteration")
    max_iterations: int = Field(25, ge=1)
    converged: float = Field(
        2e-4, gt=0, description="[m, rad] smallest step worth another iteration"
    )
    noise: float = Field(
        0.1,
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

    surface: Surface
    tree: KDTree

    @classmethod
    def of(cls, surface: Surface, parameters: IcpParameters) -> "Target":
        """Index `surface`."""
        return cls(surface, KDTree(_features(surface, parameters), balanced_tree=False))


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
    moving: Surface,
    target: Target,
    start: FloatArray,
    parameters: IcpParameters,
    prior: FloatArray | None = None,
    corresponding: BoolArray | None = None,
) -> Fit:
    """Move `moving` from `start` (3,) until it lies on `target`.

    Parameters
    ----------
    prior
        (3, 3) information [1/m², 1/rad²] that holds the pose at `start`; decides the directions
        that the surfaces leave open.
    corresponding
        (target's polylines, moving one's polylines) which pairs of polylines may pull. A point's
        partner is its nearest of all; where the polylines of the two do not correspond, or
        either is on none, the pair is left out, and no farther partner is looked for. Without
        it all pairs pull.
    """
    pose = np.array(start, dtype=float)
    held = np.zeros((3, 3)) if prior is None else prior
    scale = parameters.start_scale
    information = np.zeros((3, 3))
    for _ in range(parameters.max_iterations):
        normal_matrix, gradient = _linearise(moving, target, pose, scale, parameters, corresponding)
        information = normal_matrix
        system = normal_matrix / parameters.noise**2 + held + np.diag([1e-6, 1e-6, 1e-6])
        error = pose - start
        error[2] = se2.wrap(error[2])
        step = -np.linalg.solve(system, gradient / parameters.noise**2 + held @ error)
        pose = pose + step
        settled = np.abs(step).max() < parameters.converged
        if settled and scale <= parameters.end_scale:
            break
        scale = max(parameters.end_scale, scale * parameters.shrink)
    pose[2] = se2.wrap(pose[2])
    return Fit(pose, information)


def partners(
    moving: Surface, target: Target, parameters: IcpParameters, reach: float
) -> tuple[FloatArray, IntArray]:
    """Return each moving point's distance to its partner and the partner's index.

    `moving` is in the target's frame. Without a partner within `reach` [m] the distance is
    infinite and the index ``len(target.surface)``.
    """
    distance, index = target.tree.query(_features(moving, parameters), distance_upper_bound=reach)
    return np.asarray(distance, dtype=np.float64), np.asarray(index, dtype=np.int64)


def _features(surface: Surface, parameters: IcpParameters) -> FloatArray:
    """(n, 4): nearness in place and in normal at once."""
    return np.hstack([surface.points, parameters.normal_weight * surface.normals])


def _linearise(
    moving: Surface,
    target: Target,
    pose: FloatArray,
    scale: float,
    parameters: IcpParameters,
    corresponding: BoolArray | None,
) -> tuple[FloatArray, FloatArray]:
    """Normal matrix (3, 3) and gradient (3,) of the robust point-to-line cost at `pose`."""
    placed = moving.moved(pose)
    distance, index = partners(placed, target, parameters, 3 * scale)
    paired = np.isfinite(distance)
    if corresponding is not None:
        theirs, ours = target.surface.polyline[index[paired]], moving.polyline[paired]
        paired[paired] = corresponding[theirs, ours] & (theirs >= 0) & (ours >= 0)
    points, index = placed.points[paired], index[paired]
    normals = target.surface.normals[index]
    residual = np.einsum("ij,ij->i", normals, points - target.surface.points[index])
    weight = 1 / (1 + (distance[paired] / scale) ** 2) ** 2  # Geman-McClure
    arm = points - pose[:2]
    jacobian = np.column_stack([normals, normals[:, 1] * arm[:, 0] - normals[:, 0] * arm[:, 1]])
    weighted = jacobian * weight[:, None]
    return weighted.T @ jacobian, weighted.T @ residual
