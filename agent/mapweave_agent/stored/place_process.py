"""Looks for places in a known map in a process of its own, so that no scan waits for it."""

import logging
from multiprocessing.connection import Connection

from mapweave.mapping.localization.known_map import KnownMap
from mapweave.mapping.localization.place_finder import (
    Place,
    PlaceFinder,
    PlaceFinderParameters,
    Search,
)
from mapweave_agent.worker import Worker, answer

NICENESS = 5  # tracking comes first where processors are few

_log = logging.getLogger(__name__)


class PlaceProcess(Worker):
    """A `mapweave.mapping.localization.place_finder.PlaceSearcher`; a context manager.

    If the process is gone, it is said once, and nothing is found any more.
    """

    def __init__(self, known: KnownMap, parameters: PlaceFinderParameters) -> None:
        super().__init__(_serve, (known, parameters))
        self._ended = False

    def begin(self, search: Search) -> None:
        """Hand a search over."""
        if self._ended:
            return
        try:
            self._pipe.send(search)
        except (BrokenPipeError, ConnectionResetError):
            self._tell_end()

    @property
    def is_ready(self) -> bool:
        """Whether the outcome is there, or there will be none."""
        return self._ended or self._pipe.poll()

    def take(self) -> Place | None:
        """Wait for the outcome; None where there is nobody to come to one."""
        if self._ended:
            return None
        try:
            found: Place | None = self._pipe.recv()
        except (EOFError, ConnectionResetError):
            self._tell_end()
            return None
        return found

    def _tell_end(self) -> None:
        self._ended = True
        self._process.join()
        _log.error(
            "the process that looks for the robot ended (%s): it is not found any more",
            self._process.exitcode,
        )


def _serve(pipe: Connection, known: tuple[KnownMap, PlaceFinderParameters]) -> None:
    """Search for what comes through `pipe` until its other end is closed."""
    answer(pipe, NICENESS, PlaceFinder(*known).find)
