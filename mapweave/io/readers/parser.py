"""The lines of one log, each read in the light of those before it."""

import re

import numpy as np

from mapweave.geometry.arrays import FloatArray
from mapweave.io.readers.beams import DamagedLineError
from mapweave.io.readers.flaser import FlaserBeams
from mapweave.io.readers.lines import Line
from mapweave.io.readers.player import is_player, parse_player
from mapweave.io.readers.records import (
    SCAN_KINDS,
    LaserRecord,
    parse_flaser,
    parse_laser,
    parse_numbers,
    parse_robotlaser,
)

_MESSAGE_NAME = re.compile(rb"#|//|[A-Za-z][A-Za-z0-9_:]*\Z")


class ForeignLineError(DamagedLineError):
    """A damaged line that need not have been a scan."""


class LogParser:
    """Tells the scans of one log from its lines, which must come in their order.

    Parameters
    ----------
    angular_step
        Between beams [rad], where a line does not state it (``FLASER``); None has the log's
        parameters tell, or the number of beams.
    """

    def __init__(self, angular_step: float | None = None) -> None:
        self._beams = FlaserBeams(angular_step)
        self._has_times = False
        self._odometry: FloatArray = np.full(3, np.nan)

    def parse(self, line: Line) -> LaserRecord | None:
        """Return the scan that `line` holds; None if it is a line of another kind.

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
            return self._scan(words)
        if words[0] == b"Laser" and words[1:2] and words[1].isdigit():
            return parse_laser(words, self._beams.of, self._odometry)
        if words[0] == b"PARAM":
            self._beams.note(words)
        elif words[0] == b"Odometry":
            self._odometry = _pose(words[1:])
        elif is_player(words):
            return parse_player(words)
        elif not _MESSAGE_NAME.match(words[0]):
            raise ForeignLineError("does not start with the name of a message")
        return None

    def _scan(self, words: list[bytes]) -> LaserRecord:
        if words[0] != b"FLASER":
            return parse_robotlaser(words)
        record = parse_flaser(words, self._beams.of, untimed=not self._has_times)
        self._has_times = self._has_times or len(words) > len(record.ranges) + 8
        return record


def _pose(words: list[bytes]) -> FloatArray:
    """Return the pose (3,) [m, m, rad] that `words` are; NaN where they are none."""
    try:
        return parse_numbers(words) if len(words) == 3 else np.full(3, np.nan)
    except DamagedLineError:
        return np.full(3, np.nan)


def _starts_a_kind(words: list[bytes]) -> bool:
    """Return whether a line was cut off within its first word, which was to be a scan's."""
    return len(words) == 1 and any(kind.startswith(words[0]) for kind in SCAN_KINDS)
