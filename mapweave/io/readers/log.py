"""The scans of a log, one after the other, in constant memory."""

import re
import stat
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from mapweave.errors import FileError
from mapweave.io.readers.lines import Line, split_lines
from mapweave.io.readers.options import ReadOptions
from mapweave.io.readers.records import SCAN_KINDS, DamagedLineError, LaserRecord, parse_record
from mapweave.io.readers.streams import UnusableArchiveError, read_blocks
from mapweave.io.readers.tally import Tally
from mapweave.scan.scan import Scan

EXPECTED = "expected a CARMEN, TORO or g2o log with FLASER or ROBOTLASER1 lines, plain, gzip or zip"
_MESSAGE_NAME = re.compile(rb"#|//|[A-Za-z][A-Za-z0-9_:]*\Z")


def read(path: Path, options: ReadOptions) -> Iterator[Scan]:
    """Yield the whole scans of the log at `path`, as `read_scans` does."""
    tally = Tally("line", EXPECTED)
    try:
        for line in read_lines(path):
            tally.pieces += 1
            try:
                record = parse_line(line, options.angular_step)
            except DamagedLineError as error:
                foreign = isinstance(error, _ForeignLineError)
                tally.add_damaged(line.number, error, foreign=foreign)
                continue
            if record is not None:
                scan = _scan(tally.scans, record, options.odometry)
                tally.add_scan(scan)
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


class _ForeignLineError(DamagedLineError):
    """A damaged line that need not have been a scan."""


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
