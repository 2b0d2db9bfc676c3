"""Refining a finished submap: its scans fit each other, and the older walls that they saw again.

Tracking places each scan by what was seen before it, so what is seen later cannot put it right,
and its errors add up along a submap. Here all scans of a submap move at once (multi-view ICP): a
point is drawn to its like in the other scans, and to the walls of other submaps, which stay.
"""

from collections.abc import Sequence

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.kernels.multiview import normal_equations, solve_positive
from mapweave.parameters import StageParameters, derived
from mapweave.scan.points import OrientedPoints, join_points


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
    step_doubt: float = Field(
        1.5, gt=0, description="times these sigmas by which a step is off that counts a quarter"
    )
    start_sigma: float = Field(0.03, gt=0, description="[m] of the first scan")
    start_turn: float = Field(0.01, gt=0, description="[rad] of the first scan")


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
    tracked = np.array(poses, dtype=float)
    refined = tracked.copy()
    for scale in p.scales:
        matrix, pull = normal_equations(
            moving.points,
            moving.normals,
            owner,
            refined,
            walls.points,
            walls.normals,
            p.normal_weight,
            p.partners,
            scale,
        )
        off = refined - tracked
        off[:, 2] = se2.wrap(off[:, 2])
        held = _tracking(off, p)
        # A Gauss-Newton step; tracking pulls each pose back to where it put it.
        right = pull / p.noise**2 + held @ off.ravel()
        step = solve_positive(matrix / p.noise**2 + held, -right)
        refined = refined + step.reshape(-1, 3)
        refined[:, 2] = se2.wrap(refined[:, 2])
    return refined


def _tracking(off: FloatArray, p: MultiviewIcpParameters) -> FloatArray:
    """(3n, 3n) normal matrix of the n - 1 tracked steps and of the first pose.

    Of small corrections in the common frame: neighbours move and turn alike. Tracking may have put
    a scan into another minimum, beside the true one: the farther off both steps are, to it and
    from it, by what the other scans say, the less they count, as a pair of points does, and the
    scans before and after it are held to each other instead. One step alone is not given up: all
    that follows would hang on nothing, and turn as a whole. The (n, 3) `off` is how far the poses
    are from where tracking put them [m, m, rad].
    """
    sigmas = np.array([p.step_sigma, p.step_sigma, p.turn_sigma])
    wrong = ((np.diff(off, axis=0) / sigmas) ** 2).sum(axis=1)
    weight = (1 + wrong / p.step_doubt**2) ** -2
    beside = np.minimum(np.r_[1.0, weight[:-1]], np.r_[weight[1:], 1.0])  # what comes later, too
    kept = np.maximum(weight, beside)
    matrix = np.zeros((off.size, off.size))
    matrix[:3, :3] = np.diag(np.array([p.start_sigma, p.start_sigma, p.start_turn]) ** -2)
    _hold(matrix, 1, kept[:, None] * sigmas**-2)
    over = (1 - kept[:-1]) * (1 - kept[1:])
    _hold(matrix, 2, over[:, None] * sigmas**-2 / 2)
    return matrix


def _hold(matrix: FloatArray, apart: int, precision: FloatArray) -> None:
    """Add to a normal matrix that poses so many scans `apart` move alike, by (m, 3) `precision`."""
    before = np.arange(precision.size)
    after = before + 3 * apart
    held = precision.ravel()
    matrix[before, before] += held
    matrix[after, after] += held
    matrix[before, after] -= held
    matrix[after, before] -= held
