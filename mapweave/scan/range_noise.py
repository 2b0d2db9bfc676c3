"""How much a lidar's readings scatter: made for far less, walls fray and scans fit nowhere.

Three neighbouring returns of a wall tell. Along a straight line the reciprocal of the range is a
sinusoid of the angle, so two of them say where the one between should be, however the line lies.
"""

import numpy as np

from mapweave.geometry.arrays import FloatArray
from mapweave.scan.scan import Scan

SCANS = 4  # that are asked, the first: fewer than a robot may miss until it counts as lost
ENOUGH = 100  # returns between two others, in these
TIMES = 1.75  # what is assumed, that are far more: reached by 6 of 2381 stretches of recordings
MAX_STEP = 0.25  # [m] from one return to the next of one surface
MAX_SIGMA = 0.2  # [m] that may be set
_BEYOND = 7.0  # medians, beyond which a return is of something else
_COARSE = 0.01  # [m] more, as readings may be whole centimetres, and most of them alike
_OF_MEAN = np.sqrt(np.pi / 2)  # standard deviations of a normal distribution, in means of its size
_THREE = np.sqrt(1.5)  # each of the three scatters; the outer two count half


class RangeNoise:
    """Judges the first scans of a lidar.

    Parameters
    ----------
    assumed
        Standard deviation of a reading [m]; infinite where it is known.
    """

    def __init__(self, assumed: float) -> None:
        self._assumed = assumed
        self._scans = 0
        self._off: list[FloatArray] = []

    def watch(self, scan: Scan) -> float | None:
        """Take the next scan; return the standard deviation [m] once it shows to be far more."""
        if self._scans == SCANS or not len(off := off_line(scan)):
            return None
        self._scans += 1
        self._off.append(off)
        if self._scans < SCANS:
            return None
        together = np.abs(np.concatenate(self._off))
        self._off.clear()
        scattered = together[together <= _BEYOND * np.median(together) + _COARSE]
        sigma = float(_OF_MEAN / _THREE * scattered.mean())
        is_more = len(together) >= ENOUGH and sigma > TIMES * self._assumed
        return min(round(sigma, 3), MAX_SIGMA) if is_more else None


def off_line(scan: Scan) -> FloatArray:
    """Return (k,) how far [m] returns lie off the line through their neighbours, along the beam.

    Of returns whose neighbours are of one surface with them.
    """
    with np.errstate(invalid="ignore"):
        near = np.abs(np.diff(scan.ranges)) < MAX_STEP  # False for what did not come back
    k = 1 + np.flatnonzero(near[:-1] & near[1:])
    step = np.diff(scan.angles)
    before, after = np.sin(step[k - 1]), np.sin(step[k])
    line = after / scan.ranges[k - 1] + before / scan.ranges[k + 1]
    return np.asarray(scan.ranges[k] - np.sin(step[k - 1] + step[k]) / line)
