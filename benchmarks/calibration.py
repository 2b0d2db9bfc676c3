"""Whether poses are as well determined as they say: errors of steps against what was told."""

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import RobotMap, Trajectory


def within_two_sigma(robot_map: RobotMap, truth: FloatArray) -> FloatArray:
    """Return (3,) shares of the steps that err by less than 2 sigma, of 0.95 if errors are normal.

    In the direction that is held least, across it, and in heading. A step leads from a scan to
    the next one of the log in the same submap, the (n, 3) `truth` of both known; both err, and
    so does the truth. NaN where there is no such step.
    """
    deviations = [_deviations(submap.trajectory, truth) for submap in robot_map.submaps]
    together = np.concatenate([np.empty((0, 3)), *deviations])
    return np.mean(together < 2.0, axis=0) if len(together) else np.full(3, np.nan)


def _deviations(path: Trajectory, truth: FloatArray) -> FloatArray:
    """(m, 3) errors of the steps of a submap, each in units of its sigma."""
    if path.uncertainty is None:
        return np.empty((0, 3))
    known = np.isfinite(truth[path.scan_index, 0])
    first = np.flatnonzero((np.diff(path.scan_index) == 1) & known[:-1] & known[1:])
    second = first + 1
    true = truth[path.scan_index]
    step, right = (se2.between(poses[first], poses[second]) for poses in (path.pose, true))
    error = se2.between(right, step)
    told = path.uncertainty
    # The error is in the second scan's frame; the directions are in the submap's.
    least = told[second, 3] - path.pose[second, 2]
    along = np.column_stack([np.cos(least), np.sin(least)])
    across = np.column_stack([-along[:, 1], along[:, 0]])
    turn = np.hypot(told[first, 2], told[second, 2])
    apart = [
        np.abs(np.einsum("ij,ij->i", error[:, :2], direction))
        / np.hypot(
            _sigma(told[first], least - told[second, 3], direction),
            _sigma(told[second], least - told[second, 3], direction),
        )
        for direction in (along, across)
    ]
    return np.column_stack([*apart, np.abs(error[:, 2]) / turn])


def _sigma(told: FloatArray, turned: FloatArray, direction: FloatArray) -> FloatArray:
    """(m,) standard deviations [m] in `direction` (m, 2), whose frame is `turned` (m,) [rad]."""
    angle = np.arctan2(direction[:, 1], direction[:, 0]) - (told[:, 3] + turned)
    sigma: FloatArray = np.hypot(told[:, 0] * np.cos(angle), told[:, 1] * np.sin(angle))
    return sigma
