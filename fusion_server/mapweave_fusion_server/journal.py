"""What the coordinator's log tells, beside what everybody tells of a team."""

import logging
from collections.abc import Iterable, Iterator

INTERVAL = 60.0  # [s]
MOST_LINES = 120  # of who comes and goes, in that: a large team that starts, or loses its router

LOGGER = logging.getLogger(__name__)


def record(lines: Iterable[str]) -> None:
    """Log `lines`; what came from the network cannot move a terminal's cursor."""
    for line in lines:
        LOGGER.info("%s", "".join(c if c.isprintable() else "?" for c in line))


class Bounded:
    """Lets so many lines of one kind through in a minute; how many were left out is a line, too.

    Parameters
    ----------
    what
        They tell, in words.
    """

    def __init__(self, what: str) -> None:
        self._what = what
        self._began = -INTERVAL
        self._told = self._left_out = 0

    def told(self, lines: Iterable[str], now: float) -> Iterator[str]:
        """Yield those of `lines` that are to be told at `now` [s]."""
        if now - self._began >= INTERVAL:
            if self._left_out:
                yield f"{self._left_out} more lines about {self._what} were left out"
            self._began, self._told, self._left_out = now, 0, 0
        for line in lines:
            if self._told < MOST_LINES:
                self._told += 1
                yield line
            else:
                self._left_out += 1
