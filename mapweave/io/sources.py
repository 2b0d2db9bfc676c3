"""Where scans come from, as one word names it: a file, ``-``, or what an installed package adds.

A package that reads a sensor of its own registers an opener under a scheme in the entry-point
group ``mapweave.sources``::

    [project.entry-points."mapweave.sources"]
    lidar = "my_package:open_lidar"

Then ``lidar:/dev/ttyUSB0`` is a source: ``open_lidar("lidar:/dev/ttyUSB0", options)`` returns a
`ScanSource`.
"""

import os
import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path
from typing import Protocol, TypeAlias

from mapweave.errors import FileError, UnknownSourceError
from mapweave.io.readers.lines import split_lines
from mapweave.io.readers.options import ReadOptions
from mapweave.io.readers.ros_bags.frames import StaticFrames
from mapweave.io.readers.scan_lines import read_scan_lines
from mapweave.io.readers.scans import count_scans, read_scans
from mapweave.io.readers.streams import BLOCK
from mapweave.io.refusals import Refusals
from mapweave.scan.scan import Scan

SOURCE_GROUP = "mapweave.sources"
STANDARD_INPUT = "-"
_TOPIC = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")


class ScanSource(Protocol):
    """Scans of one sensor, in the order in which they were taken."""

    @property
    def live(self) -> bool:
        """Whether they come as they are taken; those of a recording are there at once."""

    def count(self) -> int | None:
        """Return how many there will be; None where nobody knows."""

    def scans(self) -> Iterator[Scan]:
        """Yield the scans, until there are no more.

        Raises
        ------
        MapweaveError
            If they cannot be read any further.
        """

    def close(self) -> None:
        """End `scans`, from another thread; nothing where only their writer can end them."""


SourceOpener: TypeAlias = Callable[[str, ReadOptions], ScanSource]


def open_source(name: str, options: ReadOptions) -> ScanSource:
    """Return the source that `name` says.

    Parameters
    ----------
    name
        ``-`` for lines of JSON on standard input, a word ``SCHEME:…`` of a package that is
        installed, else the path of a recording.
    options
        How it is read; a source takes what it knows of.

    Raises
    ------
    UnknownSourceError
        If it looks like ``SCHEME:…``, no package knows the scheme, and there is no such file.
    FileError
        If it looks like a topic of ROS 2, and there is no such file.
    """
    if name == STANDARD_INPUT:
        return StandardInput(options)
    scheme, colon, _ = name.partition(":")
    openers = {point.name: point for point in entry_points(group=SOURCE_GROUP)}
    if colon and scheme in openers:
        opener: SourceOpener = openers[scheme].load()
        return opener(name, options)
    if "ros2" in openers and _TOPIC.fullmatch(name) and not Path(name).exists():
        raise FileError(name, f"no such file; if it is a topic of ROS 2, it is said as ros2:{name}")
    if colon and scheme.isidentifier() and not Path(name).exists():
        raise UnknownSourceError(name, scheme, sorted(openers))
    return Recording(Path(name), options)


@dataclass(frozen=True, slots=True)
class Recording:
    """A log, a bag, or another file or folder of scans."""

    path: Path
    options: ReadOptions
    live: bool = False

    def count(self) -> int:
        """Return how many scans there are; reads it through."""
        return count_scans(self.path, self.options.angular_step, self.options.topic)

    def scans(self, on_laser: Callable[[str, StaticFrames], None] | None = None) -> Iterator[Scan]:
        """As `read_scans`."""
        return read_scans(
            self.path,
            odometry=self.options.odometry_topic or self.options.odometry,
            angular_step=self.options.angular_step,
            topic=self.options.topic,
            on_warning=self.options.on_warning,
            on_laser=on_laser,
        )

    def close(self) -> None:
        """Nothing: who reads it stops reading."""


@dataclass(frozen=True, slots=True)
class StandardInput:
    """Lines of JSON that another program writes, as it writes them."""

    options: ReadOptions
    live: bool = True

    def count(self) -> None:
        """Nobody knows."""

    def scans(self) -> Iterator[Scan]:
        """As `read_scan_lines`; what is left out is told at once, and not when all is over."""
        name, lines = "standard input", split_lines(_blocks(sys.stdin.fileno()))
        refusals = Refusals(name, self.options.on_warning, "line")
        return read_scan_lines(name, lines, self.options, refusals.add)

    def close(self) -> None:
        """Nothing: nobody can wake who waits for a writer."""


def _blocks(descriptor: int) -> Iterator[bytes]:
    """Yield what arrives, at once: a buffered reader would wait for more."""
    while block := os.read(descriptor, BLOCK):
        yield block
