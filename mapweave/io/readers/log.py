"""The scans of a log, one after the other, in constant memory."""

import re
import stat
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from mapweave.errors import FileError
from mapweave.io.readers.lines import Line, split_lines
from mapweave.io.readers.records import SCAN_KINDS, DamagedLineError, LaserRecord, parse_record
from mapweave.io.readers.streams import UnusableArchiveError, read_blocks
from mapweave.scan.scan import Scan

EXPECTED = "expected a CARMEN, TORO or g2o log with FLASER or ROBOTLASER1 lines, plain, gzip or zip"
_MESSAGE_NAME = re.compile(rb"#|//|[A-Za-z][A-Za-z0-9_:]*\Z")


def read_scans(
    path: str | Path,
    *,
    odometry: bool = False,
    angular_step: float | None = None,
    on_warning: Callable[[str], None] = warnings.warn,
) -> Iterator[Scan]:
    """Return the whole scans of a log, in the order of its lines, as they are read.

    The scan index counts whole scans from 0: a damaged line takes none, a scan in which nothing
    came back takes one. Stamps are handed through as recorded (they may stand still, be shifted
    or go backwards); one that is not finite becomes NaN. No pose in the file is read unless
    `odometry` asks for it: logs often hold poses that another program has corrected.

    Parameters
    ----------
    path
        A CARMEN log (``FLASER`` or ``ROBOTLASER1``), or a TORO or g2o graph with ``ROBOTLASER1``;
        plain, gzip or a zip that holds one. Its content tells, not its name.
    odometry
        Fill `Scan.odometry` with the robot pose that the line states, where it is finite. (A log
        that another program has corrected states the corrected pose there, too.)
    angular_step
        Between beams [rad], where a line does not state it (``FLASER``); None has the number of
        beams tell.
    on_warning
        Called once, after the last scan, if damaged lines were left out; by default a
        `UserWarning` says so.

    Raises
    ------
    FileError
        At once if there is no such file, or it is a folder; while reading if it cannot be read;
        at the end if there was no usable scan.
    """
    source = Path(path)
    check_is_file(source)
    return _scans(source, odometry, angular_step, on_warning)


def count_scans(path: str | Path, angular_step: float | None = None) -> int:
    """Return how many scans `read_scans` yields: about a second for ten thousand.

    Raises
    ------
    FileError
        As `read_scans` does.
    """
    return sum(1 for _ in read_scans(path, angular_step=angular_step, on_warning=lambda _: None))


def check_is_file(path: Path) -> None:
    """Raise `FileError` if `path` is missing, a folder, or may not be read."""
    try:
        kind = path.stat().st_mode
        if stat.S_ISREG(kind):  # A pipe can be opened only once.
            path.open("rb").close()
    except FileNotFoundError as error:
        raise FileError(path, f"no such file; {EXPECTED}") from error
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror}); {EXPECTED}") from error
    if stat.S_ISDIR(kind):
        raise FileError(path, f"is a folder; {EXPECTED}")


def read_lines(path: Path) -> Iterator[Line]:
    """Yield the lines of the log at `path`, unpacked.

    Raises
    ------
    FileError
        If it cannot be opened or read.
    """
    try:
        with path.open("rb") as file:
            yield from split_lines(read_blocks(file))
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror}); {EXPECTED}") from error
    except UnusableArchiveError as error:
        raise FileError(path, f"{error}; {EXPECTED}") from error


class _ForeignLineError(DamagedLineError):
    """A damaged line that need not have been a scan."""


class _Tally:
    """Counts what a log held, for the warning or the error at its end."""

    def __init__(self) -> None:
        self.lines = 0
        self.scans = 0
        self.hits = 0
        self.damaged = 0
        self.foreign = 0
        self.first = ""

    def add_scan(self, scan: Scan) -> None:
        self.scans += 1
        self.hits += int(scan.hits.sum())

    def add_damaged(self, line: Line, error: DamagedLineError) -> None:
        self.damaged += 1
        self.foreign += isinstance(error, _ForeignLineError)
        self.first = self.first or f"line {line.number}: {error}"

    def check(self, path: Path) -> None:
        """Raise `FileError` if no scan was usable."""
        if not self.hits:
            raise FileError(path, f"{self._why_unusable()}; {EXPECTED}")

    def warn(self, path: Path, on_warning: Callable[[str], None]) -> None:
        """Warn if some scans were damaged and others were not."""
        if self.hits and self.damaged:
            on_warning(f"{path}: dropped {self._damage()}")

    def _damage(self) -> str:
        lines = "line" if self.damaged == 1 else "lines"
        return f"{self.damaged} damaged {lines}, the first {self.first}"

    def _why_unusable(self) -> str:
        if self.scans:
            return f"no usable scan: in none of its {self.scans} scans did a beam come back"
        if self.damaged > self.foreign:
            return f"no usable scan: {self._damage()}"
        return "holds no laser scan" if self.lines else "is empty"


def _scans(
    path: Path, odometry: bool, angular_step: float | None, on_warning: Callable[[str], None]
) -> Iterator[Scan]:
    tally = _Tally()
    try:
        for line in read_lines(path):
            tally.lines += 1
            try:
                record = parse_line(line, angular_step)
            except DamagedLineError as error:
                tally.add_damaged(line, error)
                continue
            if record is not None:
                scan = _scan(tally.scans, record, odometry)
                tally.add_scan(scan)
                yield scan
        tally.check(path)
    finally:  # also where nobody wants the rest
        tally.warn(path, on_warning)


def _scan(index: int, record: LaserRecord, odometry: bool) -> Scan:
    usable = odometry and np.isfinite(record.robot_pose).all()
    guess = record.robot_pose if usable else None
    return Scan(record.ranges, record.angles, index, record.stamp, guess)


def parse_line(line: Line, angular_step: float | None = None) -> LaserRecord | None:
    """Return the scan that `line` holds; None if it is a line of another kind.

    `angular_step` is that of `read_scans`.

    Raises
    ------
    DamagedLineError
        If it is, or may have been, a scan, and is not whole.
    """
    if line.damage:
        raise DamagedLineError(line.damage)
    words = line.text.split()
    if not words:
        return None
    if words[0] in SCAN_KINDS or _starts_a_kind(words):
        return parse_record(words, angular_step)
    if not _MESSAGE_NAME.match(words[0]):
        raise _ForeignLineError("does not start with the name of a message")
    return None


def _starts_a_kind(words: list[bytes]) -> bool:
    """Return whether a line was cut off within its first word, which was to be a scan's."""
    return len(words) == 1 and any(kind.startswith(words[0]) for kind in SCAN_KINDS)
