"""Settles finished submaps in a process of its own, so that no scan waits for a loop to close.

The mapper takes the outcome when its next submap is finished, some metres of path later: the map
is that of `mapweave map`, whatever the processors were busy with.
"""

import logging
from collections.abc import Sequence
from multiprocessing.connection import Connection

from mapweave.mapping.backend import Backend, BackendParameters, BackendResult, FinishedSubmap
from mapweave.maps import Submap
from mapweave_agent.worker import Worker, answer

NICENESS = 10  # tracking comes first where processors are few, and versions of the joint map

_log = logging.getLogger(__name__)


class BackendProcess(Worker):
    """A `mapweave.mapping.backend.BackendRunner`; a context manager that ends its process.

    If the process is gone, it is said once, and submaps stay as they were tracked.
    """

    def __init__(self, parameters: BackendParameters, known: Sequence[Submap] = ()) -> None:
        super().__init__(_serve, (parameters, tuple(known)))
        self._ended = False

    def begin(self, finished: FinishedSubmap) -> None:
        """Hand the next submap over."""
        if self._ended:
            return
        try:
            self._pipe.send(finished)
        except (BrokenPipeError, ConnectionResetError):
            self._tell_end()

    @property
    def is_ready(self) -> bool:
        """Whether the outcome is there, or there will be none."""
        return self._ended or self._pipe.poll()

    def take(self) -> BackendResult | None:
        """Wait for the outcome; None where there is nobody to come to one."""
        if self._ended:
            return None
        try:
            settled: BackendResult = self._pipe.recv()
        except (EOFError, ConnectionResetError):
            self._tell_end()
            return None
        return settled

    def _tell_end(self) -> None:
        self._ended = True
        self._process.join()
        _log.error(
            "the process that closes loops ended (%s): the map is as tracked from here",
            self._process.exitcode,
        )


def _serve(pipe: Connection, known: tuple[BackendParameters, tuple[Submap, ...]]) -> None:
    """Settle what comes through `pipe` until its other end is closed."""
    answer(pipe, NICENESS, Backend(*known).settle)
