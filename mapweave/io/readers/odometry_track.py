"""A robot's odometry beside its scans: what it says of the moment at which a scan was taken."""

import bisect
import math

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray

AHEAD = 0.2  # [s] from the last one that odometry is taken to go on as before


class OdometryTrack:
    """Poses by their stamps; between two of them, on the way from one to the other.

    Parameters
    ----------
    most
        Poses that are remembered, the last ones; None for all.
    """

    def __init__(self, most: int | None = None) -> None:
        self._most = most
        self._stamps: list[float] = []
        self._poses: list[FloatArray] = []

    def add(self, stamp: float, pose: FloatArray) -> None:
        """Take a pose (3,) [m, m, rad] at `stamp` [s]; one that runs back begins anew."""
        if not math.isfinite(stamp):
            return
        if self._stamps and stamp <= self._stamps[-1]:
            if stamp == self._stamps[-1]:
                return
            self._stamps, self._poses = [], []
        self._stamps.append(stamp)
        self._poses.append(pose)
        if self._most is not None and len(self._stamps) > 2 * self._most:
            del self._stamps[: -self._most], self._poses[: -self._most]

    def at(self, stamp: float) -> FloatArray | None:
        """(3,) the pose at `stamp` [s]; None where odometry says nothing of it."""
        if not math.isfinite(stamp) or len(self._stamps) < 2:
            return None
        after = bisect.bisect_left(self._stamps, stamp)
        if after == 0 or (after == len(self._stamps) and stamp - self._stamps[-1] > AHEAD):
            return self._poses[0] if after == 0 and stamp == self._stamps[0] else None
        after = min(after, len(self._stamps) - 1)
        first, second = self._stamps[after - 1], self._stamps[after]
        step = se2.between(self._poses[after - 1], self._poses[after])
        return se2.compose(self._poses[after - 1], (stamp - first) / (second - first) * step)
