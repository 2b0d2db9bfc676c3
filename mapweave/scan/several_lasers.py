"""Scans of several lasers of one robot, to scans of one that sits in its middle.

Lasers turn on their own. Scans that were taken within half a period of the fastest are one view;
what is older is left out, rather than placed where the robot no longer is.
"""

import math
from collections.abc import Iterator, Mapping

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.scan.mounting import Mounting
from mapweave.scan.scan import Scan

MIN_STEP = math.radians(0.1)  # [rad] between beams of a view
MAX_STEP = math.radians(2.0)


class SeveralLasers:
    """Puts the scans of lasers together as they come.

    A view is complete when every laser has given a scan, or when one gives its next: a laser
    that has failed holds nobody up for longer than one period.

    Parameters
    ----------
    mountings
        Of each laser, by its topic; two or more.
    """

    def __init__(self, mountings: Mapping[str, Mounting]) -> None:
        self._mountings = mountings
        self._waiting: dict[str, Scan] = {}
        self._last: dict[str, float] = {}
        self._periods: dict[str, float] = {}
        self._views = 0

    def add(self, topic: str, scan: Scan) -> Iterator[Scan]:
        """Take the scan of a laser; yield the views that it completes."""
        if topic in self._waiting:
            yield self._view()
        self._note_period(topic, scan.stamp)
        self._waiting[topic] = scan
        if len(self._waiting) == len(self._mountings):
            yield self._view()

    def _note_period(self, topic: str, stamp: float) -> None:
        since = stamp - self._last.get(topic, math.nan)
        if since > 0:  # False for NaN, and for a clock that stands still
            self._periods[topic] = since
        self._last[topic] = stamp

    def _view(self) -> Scan:
        """Return one scan of those that wait, as of the newest."""
        newest = max(scan.stamp for scan in self._waiting.values())
        apart = min(self._periods.values(), default=math.inf) / 2
        points, steps = [], []
        for topic, scan in self._waiting.items():
            if newest - scan.stamp > apart:
                continue
            mounting = self._mountings[topic]
            turned = Scan(scan.ranges, -scan.angles if mounting.upside_down else scan.angles)
            points.append(se2.transform_points(mounting.pose, turned.points[turned.hits]))
            steps.append(float(np.ptp(scan.angles)) / (len(scan.angles) - 1))
        self._waiting.clear()
        view = _seen_from_the_middle(np.vstack(points), min(steps), self._views, newest)
        self._views += 1
        return view


def _seen_from_the_middle(points: FloatArray, step: float, index: int, stamp: float) -> Scan:
    """Return a scan of a full turn that has, in each direction, the nearest of `points` (n, 2)."""
    count = math.ceil(2 * math.pi / min(max(step, MIN_STEP), MAX_STEP))
    step = 2 * math.pi / count
    angles = -math.pi + step * np.arange(count)
    bearing = np.arctan2(points[:, 1], points[:, 0])
    beam = np.rint((bearing + math.pi) / step).astype(np.int64) % count
    ranges = np.full(count, np.inf)
    np.minimum.at(ranges, beam, np.hypot(*points.T))
    return Scan(ranges, angles, index, stamp)
