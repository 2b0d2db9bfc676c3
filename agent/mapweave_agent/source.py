"""A recording as a robot's scans: checked, and played at the rate asked for."""

import math
import re
from collections.abc import Callable

from mapweave.errors import FileError
from mapweave.io.scan_range import ScanRange
from mapweave.io.sources import ScanSource
from mapweave.scan.scan import Scan
from mapweave.text import counted

NOMINAL_PERIOD = 0.2  # [s] between scans where the stamps do not tell; lidars turn at 5 Hz and more
LONGEST_PAUSE = (
    10.0  # [s] between scans; a longer one is a clock that jumped, or a robot that slept
)
SLOWEST, FASTEST = 0.001, 1_000_000.0  # times real time; beyond, nobody waits for the next scan
_NUMBER = re.compile(r"([0-9]{1,12}(\.[0-9]{0,12})?|\.[0-9]{1,12})([eE][-+]?[0-9]{1,2})?")


def parse_rate(text: str) -> float:
    """Return how many times real time ``--rate`` says; infinity for ``max``.

    Raises
    ------
    ValueError
        If it is neither ``max`` nor a number from `SLOWEST` to `FASTEST`.
    """
    if text == "max":
        return math.inf
    rate = float(text) if _NUMBER.fullmatch(text) else 0.0
    if not SLOWEST <= rate <= FASTEST:
        raise ValueError(
            f"{text!r}: expected max, or how many times real time, such as 1 or 2.5, from"
            f" {SLOWEST:g} to {FASTEST:.0f}"
        )
    return rate


def count_selected(name: str, source: ScanSource, selected: ScanRange) -> int | None:
    """Read a recording through once, so that what is wrong with it is said before all else.

    Parameters
    ----------
    name
        What the source was called, for errors.

    Returns
    -------
    int or None
        How many of its scans are selected; None for a live source, of which nobody knows.

    Raises
    ------
    FileError
        If it holds no usable scan, or none that is selected.
    """
    if source.live:
        return None
    scans = sum(1 for _ in source.scans())
    total = selected.count(scans)
    if total == 0:
        raise FileError(name, f"has {counted(scans, 'scan')}, none of them in {selected}")
    return total


def told_once(tell: Callable[[str], None]) -> Callable[[str], None]:
    """Return `tell` for who reads a recording twice: what was said is not said again."""
    said: set[str] = set()

    def tell_once(message: str) -> None:
        if message not in said:
            said.add(message)
            tell(message)

    return tell_once


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
