"""What a log held, counted for the warning or the error at its end."""

import math
from collections.abc import Callable
from pathlib import Path

from mapweave.errors import FileError
from mapweave.io.readers.beams import DamagedLineError
from mapweave.io.readers.lines import Line
from mapweave.io.readers.parser import ForeignLineError
from mapweave.io.readers.records import LaserRecord
from mapweave.scan.scan import Scan

EXPECTED = (
    "expected a CARMEN, TORO or g2o log with FLASER or ROBOTLASER1 lines, or Player's; plain, gzip"
    " or zip"
)

_MOST_ASSUMED = 4
"""Sentences in a warning: a log of more kinds of scans is not one anybody recorded."""

_FEW = 10
"""Scans whose stamps need not tell time: so few may be taken at once."""


class Stamps:
    """Whether the stamps of a log tell the time: that some are odd is common, and no matter."""

    def __init__(self) -> None:
        self._scans = 0
        self._onwards = 0
        self._back = 0
        self._last = math.nan

    def add(self, stamp: float) -> None:
        """Count one more scan, taken at `stamp` [s]; NaN where it is not known."""
        self._scans += 1
        self._onwards += stamp > self._last
        self._back += stamp < self._last
        self._last = self._last if math.isnan(stamp) else stamp

    @property
    def assumed(self) -> str:
        """What is assumed where they tell none; empty where they do."""
        if math.isnan(self._last) and self._scans > 1:
            return "scans follow each other evenly, as they have no stamps"
        if self._scans < _FEW or self._onwards > self._back:
            return ""
        if not self._back:
            return f"scans follow each other evenly, as all have the stamp {self._last:.6g}"
        return "scans follow each other evenly, as more of their stamps run back than on"


class Tally:
    """Counts what a log held."""

    def __init__(self) -> None:
        self.lines = 0
        self.scans = 0
        self._hits = 0
        self._damaged = 0
        self._foreign = 0
        self._first = ""
        self._stamps = Stamps()
        self._assumed: dict[str, None] = {}  # in the order of the log

    def add_scan(self, scan: Scan, record: LaserRecord) -> None:
        """Count a whole scan, and note what was assumed of it."""
        self.scans += 1
        self._hits += int(scan.hits.sum())
        self._stamps.add(record.stamp)
        if record.assumed and len(self._assumed) < _MOST_ASSUMED:
            self._assumed[record.assumed] = None

    def add_damaged(self, line: Line, error: DamagedLineError) -> None:
        """Count a line that was left out."""
        self._damaged += 1
        self._foreign += isinstance(error, ForeignLineError)
        self._first = self._first or f"line {line.number}: {error}"

    def check(self, path: Path) -> None:
        """Raise `FileError` if no scan was usable."""
        if not self._hits:
            raise FileError(path, f"{self._why_unusable()}; {EXPECTED}")

    def warn(self, path: Path, on_warning: Callable[[str], None]) -> None:
        """Warn once, if scans are used, of those that were not and of what was assumed."""
        if not self._hits:
            return
        said = [f"dropped {self._damage()}"] if self._damaged else []
        assumed = [*self._assumed, *filter(None, [self._stamps.assumed])]
        if assumed:
            said.append(f"assumed: {'; '.join(assumed)}")
        if said:
            on_warning(f"{path}: {'; '.join(said)}")

    def _damage(self) -> str:
        lines = "line" if self._damaged == 1 else "lines"
        return f"{self._damaged} damaged {lines}, the first {self._first}"

    def _why_unusable(self) -> str:
        if self.scans:
            return f"no usable scan: in none of its {self.scans} scans did a beam come back"
        if self._damaged > self._foreign:
            return f"no usable scan: {self._damage()}"
        return "holds no laser scan" if self.lines else "is empty"
