"""Draws maps in a process of its own: in a thread it would take turns with tracking.

The lines of a submap take up to 0.1 s to be drawn, every second or so. A live robot has a scan
every 25 ms, and each of them waited for that.
"""

import logging
from multiprocessing.connection import Connection

from mapweave.mapping.map_snapshot import draw_here
from mapweave.maps import LineMap
from mapweave_agent.worker import Worker, answer

NICENESS = 12  # tracking and mapping come first where processors are few

_log = logging.getLogger(__name__)


class DrawingProcess(Worker):
    """Draws for one thread; a context manager. If the process is gone, it is drawn here."""

    def __init__(self) -> None:
        super().__init__(_serve, None)
        self._ended = False

    def draw(self, builder: bytes) -> LineMap:
        """Return the lines of a builder that is pickled, as `draw_here`."""
        if not self._ended:
            try:
                self._pipe.send(builder)
                drawn: LineMap = self._pipe.recv()
            except (EOFError, BrokenPipeError, ConnectionResetError):
                self._ended = True
                self._process.join()
                _log.error("the process that draws maps ended (%s)", self._process.exitcode)
            else:
                return drawn
        return draw_here(builder)


def _serve(pipe: Connection, _: None) -> None:
    """Draw what comes through `pipe` until its other end is closed."""
    answer(pipe, NICENESS, draw_here)
