"""A process beside the agent's own: what takes long must not hold tracking up."""

import atexit
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Any, Self

LAST = 19  # the greatest niceness
_SPAWN = multiprocessing.get_context("spawn")  # a forked Zenoh session hangs


class Worker:
    """A process that answers through a pipe; a context manager that ends it.

    Parameters
    ----------
    serve
        What the process runs, given its end of the pipe and `argument`; at the top of a module.
    """

    def __init__(self, serve: Callable[[Connection, Any], None], argument: object) -> None:
        self._serve = serve
        self._argument = argument
        self._start_process()
        atexit.register(self._end_process)  # before those that are left are asked to end

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        atexit.unregister(self._end_process)
        self._end_process()
        self._pipe.close()

    @property
    def pid(self) -> int:
        """Of the process."""
        pid = self._process.pid
        assert pid is not None  # it was started
        return pid

    def _start_process(self) -> None:
        self._pipe, theirs = _SPAWN.Pipe()
        self._process = _SPAWN.Process(
            target=self._serve, args=(theirs, self._argument), daemon=True
        )
        # What tells the whole group to end means the agent, which needs this process to the last.
        # The tracker first: where Python 3.11 starts it with the process, it unblocks them.
        resource_tracker.ensure_running()
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
        self._process.start()
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        # Only the process holds its end now: each side sees when the other one is gone.
        theirs.close()

    def _end_process(self) -> None:
        self._process.kill()
        self._process.join()


def answer(pipe: Connection, niceness: int, of: Callable[[Any], object]) -> None:
    """Answer what comes through `pipe`, by `of`, until its other end is closed.

    Parameters
    ----------
    niceness
        How much nicer this process is than the agent. One that is to be as nice as can be, `LAST`,
        runs where nothing else would if the agent itself is as nice, to give way to it as well.
    """
    for number in (signal.SIGINT, signal.SIGTERM):  # the agent ends this process itself
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _give_way(niceness)
    while True:
        try:
            pipe.send(of(pipe.recv()))
        except (EOFError, BrokenPipeError, ConnectionResetError):
            return


def _give_way(niceness: int) -> None:
    cannot_be_nicer = os.nice(0) >= LAST
    os.nice(niceness)
    # Not beside any other agent: on a robot whose cores are taken, maps would never be compared.
    if niceness >= LAST and cannot_be_nicer and sys.platform == "linux":
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))


def _end_with_parent() -> None:
    """End the process when the one that started it is gone, whatever is being computed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
