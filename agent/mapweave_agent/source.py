"""Where a robot's scans come from: a log, played at the rate asked for."""

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from mapweave.errors import FileError
from mapweave.io.readers import read_scans
from mapweave.io.scan_range import ScanRange
from mapweave.scan.scan import Scan

NOMINAL_PERIOD = 0.2  # [s] between scans where the stamps do not tell; lidars turn at 5 Hz and more
LONGEST_PAUSE = (
    10.0  # [s] between scans; a longer one is a clock that jumped, or a robot that slept
)
_NUMBER = re.compile(r"[0-9]{1,9}(\.[0-9]{0,9})?|\.[0-9]{1,9}")


def parse_rate(text: str) -> float:
    """Return how many times real time ``--rate`` says; infinity for ``max``.

    Raises
    ------
    ValueError
        If it is neither ``max`` nor a positive number.
    """
    if text == "max":
        return math.inf
    rate = float(text) if _NUMBER.fullmatch(text) else 0.0
    if not 0 < rate < math.inf:
        raise ValueError(f"{text!r}: expected max, or how many times real time, such as 1 or 2.5")
    return rate


@dataclass(frozen=True, slots=True)
class LogSource:
    """Scans of a log.

    Attributes
    ----------
    total
        How many scans are selected.
    angular_step
        Between beams [rad], where the log does not state it; None has their number tell.
    topic
        Of a bag: the laser's; None takes the only one there is.
    """

    path: Path
    selected: ScanRange
    total: int
    angular_step: float | None = None
    topic: str | None = None

    @classmethod
    def open(
        cls,
        path: Path,
        selected: ScanRange,
        on_warning: Callable[[str], None],
        angular_step: float | None = None,
        topic: str | None = None,
    ) -> "LogSource":
        """Read the log through once, so that what is wrong with it is said before all else.

        Raises
        ------
        FileError
            If it holds no usable scan, or none that is selected.
        """
        read = read_scans(path, angular_step=angular_step, topic=topic, on_warning=on_warning)
        scans = sum(1 for _ in read)
        total = selected.count(scans)
        if total == 0:
            raise FileError(path, f"has {scans} scans, none of them in {selected}")
        return cls(path, selected, total, angular_step, topic)

    def scans(self) -> Iterator[Scan]:
        """Yield the selected scans, without odometry."""
        scans = read_scans(
            self.path,
            angular_step=self.angular_step,
            topic=self.topic,
            on_warning=_already_warned,
        )
        return self.selected.of(scans)


def _already_warned(_: str) -> None:
    """Damaged lines were reported when the log was opened."""


class ReplayClock:
    """When each scan is due, at a multiple of real time.

    Where the stamps stand still, run backwards, jump or are missing, scans follow each other at
    `NOMINAL_PERIOD`. A robot that cannot keep up falls behind; it leaves out no scan.

    Parameters
    ----------
    rate
        How many times real time; infinity for as fast as can be.
    """

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._stamp = math.nan
        self._elapsed = 0.0

    def due(self, scan: Scan) -> float:
        """Return when `scan`, the next of the log, is due [s after the first one]."""
        if math.isinf(self._rate):
            return 0.0
        self._elapsed += self._period(scan) / self._rate
        self._stamp = scan.stamp
        return self._elapsed

    def _period(self, scan: Scan) -> float:
        period = scan.stamp - self._stamp
        # NaN compares false.
        return period if 0.0 < period <= LONGEST_PAUSE else NOMINAL_PERIOD
