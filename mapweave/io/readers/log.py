"""The scans of a log, one after the other, in constant memory."""

import stat
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from mapweave.errors import FileError
from mapweave.io.readers.beams import DamagedLineError
from mapweave.io.readers.lines import Line, split_lines
from mapweave.io.readers.options import ReadOptions
from mapweave.io.readers.parser import ForeignLineError, LogParser
from mapweave.io.readers.records import LaserRecord
from mapweave.io.readers.streams import UnusableArchiveError, read_blocks
from mapweave.io.readers.tally import Tally
from mapweave.scan.scan import Scan

EXPECTED = (
    "expected a CARMEN, TORO or g2o log with FLASER or ROBOTLASER1 lines, Player's, or DP-SLAM's;"
    " plain, gzip or zip"
)


def read(path: Path, options: ReadOptions) -> Iterator[Scan]:
    """Yield the whole scans of the log at `path`, as `read_scans` does."""
    parser, tally = LogParser(options.angular_step), Tally("line", EXPECTED)
    try:
        for line in read_lines(path):
            tally.pieces += 1
            try:
                record = parser.parse(line)
            except DamagedLineError as error:
                foreign = isinstance(error, ForeignLineError)
                tally.add_damaged(line.number, error, foreign=foreign)
                continue
            if record is not None:
                scan = _scan(tally.scans, record, options.odometry)
                tally.add_scan(scan)
                tally.assume(record.assumed)
                yield scan
        if problem := tally.problem():
            raise FileError(path, problem)
    finally:  # also where nobody wants the rest
        tally.warn(path, options)


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


def _scan(index: int, record: LaserRecord, odometry: bool) -> Scan:
    usable = odometry and np.isfinite(record.robot_pose).all()
    guess = record.robot_pose if usable else None
    return Scan(record.ranges, record.angles, index, record.stamp, guess)
