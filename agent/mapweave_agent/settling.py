"""Settles finished submaps in a process of its own, so that no scan waits for a loop to close.

The mapper takes the outcome when its next submap is finished, some metres of path later: the map
is that of `mapweave map`, whatever the processors were busy with.
"""

import logging
import multiprocessing
import os
import signal
from multiprocessing.connection import Connection
from types import TracebackType

from mapweave.settling import Finished, Settled, Settler, SettlingParameters

NICENESS = 5  # tracking comes first where processors are few
_SPAWN = multiprocessing.get_context("spawn")  # a forked Zenoh session hangs

_log = logging.getLogger(__name__)


class SettlingProcess:
    """A `mapweave.settling.Settling`; a context manager that ends its process.

    If the process is gone, it is said once, and submaps stay as they were tracked.
    """

    def __init__(self, parameters: SettlingParameters) -> None:
        self._pipe, theirs = _SPAWN.Pipe()
        self._process = _SPAWN.Process(target=_serve, args=(theirs, parameters), daemon=True)
        self._process.start()
        # Only the process holds its end now: each side sees when the other one is gone.
        theirs.close()
        self._ended = False

    def __enter__(self) -> "SettlingProcess":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._process.terminate()
        self._process.join()
        self._pipe.close()

    @property
    def pid(self) -> int:
        """Of the process."""
        pid = self._process.pid
        assert pid is not None  # it was started
        return pid

    def begin(self, finished: Finished) -> None:
        """Hand the next submap over."""
        if self._ended:
            return
        try:
            self._pipe.send(finished)
        except (BrokenPipeError, ConnectionResetError):
            self._tell_end()

    def take(self) -> Settled | None:
        """Wait for the outcome; None where there is nobody to come to one."""
        if self._ended:
            return None
        try:
            settled: Settled = self._pipe.recv()
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


def _serve(pipe: Connection, parameters: SettlingParameters) -> None:
    """Settle what comes through `pipe` until its other end is closed."""
    # Ctrl-C goes to the whole group; the agent ends this process itself.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(NICENESS)
    settler = Settler(parameters)
    while True:
        try:
            finished = pipe.recv()
        except EOFError:
            return
        pipe.send(settler.settle(finished))
