"""The scans of a log, one after the other, in constant memory."""

import stat
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from mapweave.errors import FileError
from mapweave.io.readers.beams import DamagedLineError
from mapweave.io.readers.lines import Line, split_lines
from mapweave.io.readers.parser import LogParser
from mapweave.io.readers.records import LaserRecord
from mapweave.io.readers.streams import UnusableArchiveError, read_blocks
from mapweave.io.readers.tally import EXPECTED, Tally
from mapweave.scan.scan import Scan


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
        A CARMEN log (``FLASER`` or ``ROBOTLASER1``), a TORO or g2o graph with ``ROBOTLASER1``, or
        a Player log (``laser``); plain, gzip or a zip that holds one. Its content tells, not its
        name.
    odometry
        Fill `Scan.odometry` with the robot pose that the line states, where it is finite. (A log
        that another program has corrected states the corrected pose there, too.)
    angular_step
        Between beams [rad], where a line does not state it (``FLASER``); None has the log's
        parameters tell, or the number of beams.
    on_warning
        Called once, after the last scan, if damaged lines were left out or something was assumed
        that the log does not say; by default a `UserWarning` says so.

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


def _scans(
    path: Path, odometry: bool, angular_step: float | None, on_warning: Callable[[str], None]
) -> Iterator[Scan]:
    parser, tally = LogParser(angular_step), Tally()
    try:
        for line in read_lines(path):
            tally.lines += 1
            try:
                record = parser.parse(line)
            except DamagedLineError as error:
                tally.add_damaged(line, error)
                continue
            if record is not None:
                scan = _scan(tally.scans, record, odometry)
                tally.add_scan(scan, record)
                yield scan
        tally.check(path)
    finally:  # also where nobody wants the rest
        tally.warn(path, on_warning)


def _scan(index: int, record: LaserRecord, odometry: bool) -> Scan:
    usable = odometry and np.isfinite(record.robot_pose).all()
    guess = record.robot_pose if usable else None
    return Scan(record.ranges, record.angles, index, record.stamp, guess)
