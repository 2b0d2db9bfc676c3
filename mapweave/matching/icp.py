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
from pydantic import Field

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.kernels.point_map import IcpSettings, PointMap, icp_settings, make_point_map
from mapweave.parameters import StageParameters, derived
from mapweave.scan.points import OrientedPoints

CELL = 0.2  # [m] of the grid that partners are looked up in


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
    trial: int = Field(5, ge=0, description="iterations after which poor starts may be dropped")
    noise: float = derived(
        lambda c: c.sensor.residual_sigma,
        gt=0,
        description="[m] of a residual against the prior; above the sensor's, because neighbouring"
        " returns err alike",
    )


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """What is aligned to: oriented points in the target's frame, searchable."""

    known: PointMap

    @classmethod
    def of(cls, oriented: OrientedPoints, parameters: IcpParameters) -> "Target":
        """Index `oriented`."""
        known = make_point_map(parameters.normal_weight, CELL, 0.0, 1)
        known.add(oriented.points, oriented.normals, oriented.polyline)
        return cls(known)


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
    share: float = 0.0,
) -> list[Fit]:
    """Move `moving` from each of `starts` (k, 3) until it lies on `target`.

    Starts that after some iterations have less than `share` of the best one's support are dropped.

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
    settings = icp_settings(
        IcpSettings(
            parameters.start_scale,
            parameters.end_scale,
            parameters.shrink,
            parameters.converged,
            parameters.noise,
            parameters.max_iterations,
            parameters.trial,
            share,
        )
    )
    _, poses, information = target.known.align(
        moving.points,
        moving.normals,
        np.ascontiguousarray(starts, dtype=np.float64),
        np.zeros((3, 3)) if prior is None else prior,
        settings,
        None if corresponding is None else moving.polyline,
        corresponding,
    )
    return [Fit(pose, held_by) for pose, held_by in zip(poses, information, strict=True)]


def partners(moving: OrientedPoints, target: Target, reach: float) -> tuple[FloatArray, IntArray]:
    """Return each moving point's distance to its partner and the partner's index.

    `moving` is in the target's frame. Without a partner within `reach` [m] the distance is
    infinite and the index ``len(target.known)``.
    """
    distance, number = target.known.find(moving.points, moving.normals, reach)
    return distance, np.where(number < 0, len(target.known), number)
