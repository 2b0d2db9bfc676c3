"""De-skewing: beams that were taken one after the other, as if all were taken in mid-sweep.

A lidar turns while its robot drives: at 10 Hz and 1 rad/s the last beam looks 6° past where it
would have looked at first. Where the scan says how long its sweep took, each return is put where
it was seen from in the middle of it, by the motion of the step before, or by odometry.

Why in the middle: there an error of the velocity turns one half of the scan this way and the other
that way, and the pose stays. As of the first beam all of the scan is off by it, and so is the
pose, and the next velocity by twice as much: poses swing from scan to scan.
"""

from dataclasses import replace
from typing import Self

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.scan.clock import ScanClock
from mapweave.scan.scan import Scan

LONGEST = 1.0  # [s] between scans that still tell how fast the robot is
NEGLIGIBLE = np.array([0.005, 0.005, 0.001])  # [m, m, rad] during a sweep: a laser errs more
ALIKE, ALIKE_SHARE = 0.1, 0.05  # [m], and of the range, by which returns of one surface differ


class Deskewer:
    """Knows how fast the robot is, from where its last scans were placed.

    Attributes
    ----------
    to_stamp
        (3,) the pose of the sensor at the stamp of the last scan, in mid-sweep [m, m, rad].
    """

    def __init__(self) -> None:
        self._clock = ScanClock()
        self._placed: tuple[Scan, FloatArray] | None = None  # the last one, and its pose
        self._velocity: FloatArray = np.zeros(3)
        self._told: tuple[Scan, FloatArray] | None = None  # the same of odometry
        self.to_stamp: FloatArray = np.zeros(3)

    def afresh(self) -> Self:
        """Return one that knows how long scans take, and of none where it was."""
        other = type(self)()
        other._clock = self._clock.afresh()
        return other

    def placed(self, scan: Scan, pose: FloatArray) -> None:
        """Take in that `scan`, as it was straightened, was placed at `pose` (3,) [m, m, rad]."""
        if self._placed is not None:
            last, before = self._placed
            self._velocity = _velocity(before, pose, self._clock.until(scan, last))
        self._placed = scan, pose

    def straight(self, scan: Scan) -> Scan:
        """Return `scan` with all returns as of mid-sweep, its stamp too; as it is without one."""
        self._clock.tick(scan)
        told = self._told_velocity(scan)
        velocity = self._velocity if told is None else told
        self.to_stamp = -abs(scan.sweep) / 2 * velocity
        if not scan.sweep:
            return scan
        middle = scan.stamp + abs(scan.sweep) / 2
        if not (np.abs(velocity * scan.sweep) > NEGLIGIBLE).any():
            return replace(scan, stamp=middle, sweep=0.0)
        return replace(deskewed(scan, velocity), stamp=middle)

    def _told_velocity(self, scan: Scan) -> FloatArray | None:
        """(3,) what odometry says; None without."""
        before = self._told
        if scan.odometry is None:
            self._told = None
            return None
        self._told = scan, scan.odometry
        if before is None:
            return None
        last, pose = before
        return _velocity(pose, scan.odometry, self._clock.until(scan, last))


def deskewed(scan: Scan, velocity: FloatArray) -> Scan:
    """Return `scan` as it would have been taken at once, in mid-sweep, by a sensor at rest.

    Parameters
    ----------
    velocity
        (3,) of the sensor, in its own frame [m/s, m/s, rad/s], taken to be constant.
    """
    after = np.linspace(-0.5, 0.5, len(scan.angles)) * scan.sweep  # mid-sweep
    turn = velocity[2] * after
    half = turn / 2  # of the way, it looked half as far round
    x = (velocity[0] * np.cos(half) - velocity[1] * np.sin(half)) * after
    y = (velocity[0] * np.sin(half) + velocity[1] * np.cos(half)) * after
    bearing = scan.angles + turn
    # Where nothing came back there is a direction still.
    ranges = np.where(scan.hits, scan.ranges, np.inf)
    with np.errstate(invalid="ignore"):
        points = np.column_stack([ranges * np.cos(bearing) + x, ranges * np.sin(bearing) + y])
        seen = np.arctan2(points[:, 1], points[:, 0])
    aside = se2.wrap(np.where(scan.hits, seen, bearing) - bearing)
    directions = bearing + aside
    distances = np.where(scan.hits, np.hypot(points[:, 0], points[:, 1]), np.nan)
    return replace(scan, ranges=_resampled(scan.angles, directions, distances), sweep=0.0)


def _resampled(angles: FloatArray, directions: FloatArray, distances: FloatArray) -> FloatArray:
    """(n,) ranges at `angles` (n,) of what is `distances` (n,) away in `directions` (n,) [rad]."""
    step = (angles[-1] - angles[0]) / (len(angles) - 1)
    if angles[-1] - angles[0] > 2 * np.pi - 1.5 * step:  # all round: it goes on where it began
        turns = 2 * np.pi * np.array([-1, 0, 1])
        directions = (directions[None] + turns[:, None]).ravel()
        distances = np.tile(distances, 3)
    order = np.argsort(directions, kind="stable")
    directions, distances = directions[order], distances[order]
    after = np.clip(np.searchsorted(directions, angles), 1, len(directions) - 1)
    low, high = directions[after - 1], directions[after]
    near, far = distances[after - 1], distances[after]
    share = np.clip((angles - low) / np.maximum(high - low, 1e-9), 0.0, 1.0)
    with np.errstate(invalid="ignore"):
        one_surface = np.abs(near - far) < ALIKE + ALIKE_SHARE * np.minimum(near, far)
    nearest = np.where(share < 0.5, near, far)
    found = np.where(one_surface, near + share * (far - near), nearest)
    apart = np.minimum(np.abs(angles - low), np.abs(high - angles))
    return np.where(apart <= step, found, np.nan)


def _velocity(first: FloatArray, second: FloatArray, since: float) -> FloatArray:
    """(3,) [m/s, m/s, rad/s] in the frame of `second` (3,); zero where no time [s] is told."""
    if not 0.0 < since <= LONGEST:
        return np.zeros(3)
    # Seen from the second pose, which is where the robot is now.
    return -se2.between(second, first) / since
