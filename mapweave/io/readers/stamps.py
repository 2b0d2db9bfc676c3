"""Whether the stamps of a log can be used."""

import math

from mapweave.scan.clock import SHORTEST

_FEW = 10
"""Scans whose stamps need not tell time: so few may be taken at once."""


class Stamps:
    """Whether the stamps of a log tell the time: that some are odd is common, and no matter."""

    def __init__(self) -> None:
        self._scans = 0
        self._onwards = 0
        self._back = 0
        self._last = math.nan
        self._passed = 0.0

    def add(self, stamp: float) -> None:
        """Count one more scan, taken at `stamp` [s]; NaN where it is not known."""
        self._scans += 1
        self._onwards += stamp > self._last
        self._back += stamp < self._last
        self._passed += stamp - self._last if stamp > self._last else 0.0
        self._last = self._last if math.isnan(stamp) else stamp

    @property
    def assumed(self) -> str:
        """What is assumed where they tell none; empty where they do."""
        if math.isnan(self._last) and self._scans > 1:
            return "scans follow each other evenly, as they have no stamps"
        if self._scans < _FEW:
            return ""
        if self._onwards > self._back:
            return self._too_fast()
        if not self._back:
            return f"scans follow each other evenly, as all have the stamp {self._last:.6g}"
        return "scans follow each other evenly, as more of their stamps run back than on"

    def _too_fast(self) -> str:
        """What is assumed where they are those of no lidar, as when a whole log is sent at once."""
        if self._passed / self._scans >= SHORTEST:
            return ""
        told = f"{self._scans} stamps within {self._passed:.3g} s"
        return f"scans follow each other evenly, as no lidar takes {told}; expected seconds"
