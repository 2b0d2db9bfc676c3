"""A scan: one sweep of ranges."""

from dataclasses import dataclass

import numpy as np

from mapweave.geometry.arrays import BoolArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Scan:
    """One sweep of a 2D laser, in the sensor's frame: x ahead, y to the left.

    Attributes
    ----------
    index
        Which scan of its log, from 0.
    stamp
        When it was taken [s]; NaN where the log gives no usable time.
    angles
        (n,) beam directions [rad], strictly ascending (counter-clockwise).
    ranges
        (n,) measured distances [m]; NaN where nothing came back.
    odometry
        The robot's own guess of its pose [m, m, rad], only where it was asked for.
    """

    index: int
    stamp: float
    angles: FloatArray
    ranges: FloatArray
    odometry: FloatArray | None = None

    @property
    def hits(self) -> BoolArray:
        """(n,) which beams came back."""
        return np.isfinite(self.ranges)

    @property
    def points(self) -> FloatArray:
        """(n, 2) where each beam ended [m], NaN where nothing came back."""
        bearing = np.column_stack([np.cos(self.angles), np.sin(self.angles)])
        points: FloatArray = self.ranges[:, None] * bearing
        return points
