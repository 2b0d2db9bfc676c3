"""How much time lies between two scans, by stamps that jitter, repeat, run back, come in batches.

A driver that stamps what it receives, over a link that hands scans on some at a time, stamps ten of
them within milliseconds and then none for a second. So the time that a scan usually takes is the
median of those from one to the next, unless that is less than lidars take, and many together take
far longer than it tells. A pause, or a clock that is set, is one gap, and not a batch.
"""

import math
from collections import deque
from itertools import accumulate
from statistics import median
from typing import Self

from mapweave.scan.scan import Scan

REMEMBERED = 60  # intervals between scans, whose median is the usual one
FEW = 10  # of them: as long as there are less, the longest is
QUICK = 0.02  # [s] from one scan to the next: few lidars are as quick, batches are
BATCHED = 6.0  # times the median, that a gap between batches takes
GAPS = 3  # or more, among those remembered: fewer are pauses
RUNS = (4, 8, 16)  # scans together, of which a batch may be a part
SHORTEST = 0.005  # [s] a scan: no lidar spins two hundred times a second


class ScanClock:
    """Knows how long scans take of late.

    Attributes
    ----------
    interval
        The time [s] that a scan usually takes; None where stamps do not tell.
    is_batched
        Whether scans come in batches.
    """

    def __init__(self) -> None:
        self.interval: float | None = None
        self.is_batched = False
        self._intervals: deque[float] = deque(maxlen=REMEMBERED)
        self._last: tuple[int, float] | None = None

    def copy(self) -> Self:
        """Return one that goes on by itself from here."""
        other = self.afresh()
        other._last = self._last
        return other

    def afresh(self) -> Self:
        """Return one that knows how long scans take, and of no scan."""
        other = type(self)()
        other._intervals, other.interval = self._intervals.copy(), self.interval
        other.is_batched = self.is_batched
        return other

    def tick(self, scan: Scan) -> None:
        """Note that `scan` was taken."""
        if self._last is not None:
            index, stamp = self._last
            interval = (scan.stamp - stamp) / max(scan.index - index, 1)
            self._intervals.append(interval if math.isfinite(interval) else 0.0)
            usual = self._usual()
            self.interval = usual if usual >= SHORTEST else None
        self._last = scan.index, scan.stamp

    def since(self, index: int, stamp: float, scan: Scan) -> float:
        """Return how long before `scan` [s] another one was taken, as long as there is evidence of.

        Parameters
        ----------
        index, stamp
            Of the other, which may be the later one as well; its stamp [s].
        """
        counted = max(abs(scan.index - index), 1) * (self.interval or 0.0)
        told = abs(scan.stamp - stamp)
        return max(counted, told) if math.isfinite(told) else counted

    def until(self, scan: Scan, last: Scan) -> float:
        """Return how long [s] it took from the `last` scan to `scan`; 0 where nothing tells."""
        if self.is_batched:
            return max(scan.index - last.index, 1) * (self.interval or 0.0)
        told = scan.stamp - last.stamp
        return 0.0 if self.interval is None else max(told, 0.0)

    def _usual(self) -> float:
        """Return the usual time [s] as stamps tell it; note whether scans come in batches."""
        count = len(self._intervals)
        if count < FEW:
            return max(self._intervals)
        usual = median(self._intervals)
        gaps = sum(each > BATCHED * max(usual, 0.0) for each in self._intervals)
        self.is_batched = usual < QUICK and gaps >= GAPS
        if not self.is_batched:
            return usual
        run = max(run for run in RUNS if 2 * run <= count)
        passed = [0.0, *accumulate(self._intervals)]
        return median(b - a for a, b in zip(passed, passed[run:], strict=False)) / run
