"""Where a laser sits on its robot, and what its scans are as the robot sees them."""

import math
from dataclasses import dataclass

import numpy as np

from mapweave.geometry.arrays import FloatArray
from mapweave.scan.scan import Scan

UPSIDE_DOWN = "upside-down"


@dataclass(frozen=True, slots=True)
class Mounting:
    """A laser in the frame of its robot: x ahead, y to the left.

    Attributes
    ----------
    x, y
        Where it is [m].
    theta
        Where its beam of angle 0 looks [rad].
    upside_down
        Whether it hangs, so that what it calls left is the robot's right.
    """

    x: float = 0.0
    y: float = 0.0
    theta: float = 0.0
    upside_down: bool = False

    @classmethod
    def parse(cls, text: str) -> "Mounting":
        """Return what ``X,Y,DEGREES`` says, ``,upside-down`` behind it or not.

        Raises
        ------
        ValueError
            If it says nothing like it.
        """
        words = text.split(",")
        upside_down = words[-1] == UPSIDE_DOWN
        numbers = [float(word) for word in (words[:-1] if upside_down else words)]
        if len(numbers) != 3 or not all(math.isfinite(number) for number in numbers):
            raise ValueError(f"{text!r}: expected three numbers")
        x, y, degrees = numbers
        return cls(x, y, math.radians(degrees), upside_down)

    @property
    def degrees(self) -> float:
        """Where its beam of angle 0 looks [°]."""
        return math.degrees(self.theta)

    @property
    def pose(self) -> FloatArray:
        """(3,) of the laser in the robot's frame [m, m, rad]."""
        return np.array([self.x, self.y, self.theta])

    def turned(self, scan: Scan) -> Scan:
        """Return `scan` with its angles as the robot has them, seen from where the laser is."""
        if not self.theta and not self.upside_down:
            return scan
        angles = -scan.angles if self.upside_down else scan.angles
        # Scan itself puts them in ascending order again.
        return Scan(
            scan.ranges, angles + self.theta, scan.index, scan.stamp, scan.odometry, scan.sweep
        )
