"""The scans of a file, whatever its format: its content tells, not its name."""

import stat
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Protocol

from mapweave.errors import FileError
from mapweave.io.readers import log, scan_lines
from mapweave.io.readers.options import ReadOptions
from mapweave.io.readers.ros_bags import bag_folder, db3, mcap, ros1_bag
from mapweave.io.readers.ros_bags.frames import StaticFrames
from mapweave.io.readers.streams import DamagedStreamError, UnusableArchiveError, read_blocks
from mapweave.scan.scan import Scan


class ScanReader(Protocol):
    """Reads files of one format: a module of this folder."""

    def read(self, path: Path, options: ReadOptions) -> Iterator[Scan]:
        """Yield the whole scans of a file."""


class ScanFormat(ScanReader, Protocol):
    """A format that is told by how it begins."""

    def sniffs(self, head: bytes) -> bool:
        """Tell whether a file that begins with `head` is one."""


BINARY_FORMATS: tuple[ScanFormat, ...] = (ros1_bag, db3, mcap)
TEXT_FORMATS: tuple[ScanFormat, ...] = (scan_lines,)
"""They may be packed; what is none of these is taken for a log of lines."""


def read_scans(
    path: str | Path,
    *,
    odometry: bool | str = False,
    angular_step: float | None = None,
    topic: str | None = None,
    on_warning: Callable[[str], None] = warnings.warn,
    on_laser: Callable[[str, StaticFrames], None] | None = None,
) -> Iterator[Scan]:
    """Return the whole scans of a file, in its order, as they are read.

    The scan index counts whole scans from 0: a damaged line takes none, a scan in which nothing
    came back takes one. Stamps are handed through as recorded (they may stand still, be shifted
    or go backwards); one that is not finite becomes NaN. No pose in the file is read unless
    `odometry` asks for it: logs often hold poses that another program has corrected.

    Parameters
    ----------
    path
        A CARMEN log (``FLASER`` or ``ROBOTLASER1``), a TORO or g2o graph with ``ROBOTLASER1``, a
        Player log (``laser``), or lines of JSON (``mapweave/scans/1``): plain, gzip or a zip that
        holds one. A ROS 1 bag, a ROS 2 bag in SQLite or MCAP, or a folder of one, with or without
        ``metadata.yaml``: of one that was cut off, all whole messages. Its content tells, not its
        name.
    odometry
        Fill `Scan.odometry` with the robot pose that the line states, where it is finite. (A log
        that another program has corrected states the corrected pose there, too.) Of a bag the
        topic, such as ``/odom`` or ``/tf``, or True for the only one.
    angular_step
        Between beams [rad], where a line does not state it (``FLASER``); None has the log's
        parameters tell, or the number of beams.
    topic
        Of a bag: the laser's topic, such as ``/scan``, or those of several, ``/front+/rear``, whose
        scans within half a period become one view from the middle of the robot; None takes the
        only one there is.
    on_warning
        Called once, after the last scan, if something was left out, or assumed that the file does
        not say; by default a `UserWarning` says so.
    on_laser
        Of a bag: told before its first scan which frame the laser is in, and what is fixed to what;
        not of several lasers.

    Raises
    ------
    FileError
        At once if there is no such file, or it is no bag and a topic is named; while reading if it
        cannot be read, or has several lasers of which none was named; at the end if there was no
        usable scan.
    MissingExtraError
        If it is a bag, and `rosbags` is not installed.
    """
    source = Path(path)
    which = odometry if isinstance(odometry, str) else None
    options = ReadOptions(
        bool(odometry), angular_step, topic, on_warning, odometry_topic=which, on_laser=on_laser
    )
    if source.is_dir():
        return bag_folder.read(source, options)
    log.check_is_file(source)
    reader = _format(source)
    asked = topic or which
    if asked and reader not in BINARY_FORMATS:
        raise FileError(source, f"is no bag, which alone has topics, such as {asked}")
    return reader.read(source, options)


def count_scans(
    path: str | Path, angular_step: float | None = None, topic: str | None = None
) -> int:
    """Return how many scans `read_scans` yields: about a second for ten thousand.

    Raises
    ------
    FileError
        As `read_scans` does.
    """
    scans = read_scans(path, angular_step=angular_step, topic=topic, on_warning=lambda _: None)
    return sum(1 for _ in scans)


def _format(path: Path) -> ScanReader:
    """Return the format of the file at `path`; that of logs where nothing else fits."""
    if not stat.S_ISREG(path.stat().st_mode):
        return log  # A pipe can be read only once.
    try:
        with path.open("rb") as file:
            head = file.read(64)
            for binary in BINARY_FORMATS:
                if binary.sniffs(head):
                    return binary
            file.seek(0)
            unpacked = next(read_blocks(file), b"")
    except (OSError, DamagedStreamError, UnusableArchiveError):
        return log  # says it of a whole file
    for binary in BINARY_FORMATS:
        if binary.sniffs(unpacked):
            raise FileError(path, "is a packed bag; expected it unpacked")
    for text in TEXT_FORMATS:
        if text.sniffs(unpacked):
            return text
    return log
