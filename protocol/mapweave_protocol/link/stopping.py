"""Signals to stop: the first one asks; the same told again changes nothing; a later one ends.

Shells, `timeout` and service managers tell a process and then its group: the process hears one
wish twice.
"""

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from mapweave_protocol.link.service_manager import ServiceManager

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)
REPEATED = 1.0  # [s] for which another signal is the first one told again


class StopSignals:
    """Tells, when it is called, whether Ctrl-C was pressed or the process was told to terminate.

    It hears signals from when it is made, in the main thread. A main loop asks it in every turn:
    that is what a service manager takes for a sign of life.
    """

    def __init__(self) -> None:
        self._manager = ServiceManager()
        self._came: float | None = None  # [s]
        self._on_later: Callable[[], None] | None = None
        self._later = False
        for stopping in STOP_SIGNALS:
            signal.signal(stopping, self._note)

    def __call__(self) -> bool:
        """Return whether to stop."""
        stop = self._came is not None  # once: it may come while a sign of life is given
        if stop:
            self._manager.stopping()
        else:
            self._manager.alive()
        if self._later and self._on_later is not None:
            self._later = False
            self._on_later()
        return stop

    @contextmanager
    def nothing_lost(self, on_later: Callable[[], None]) -> Iterator[None]:
        """Have a later signal end nothing in a block: `on_later` is called in the next turn."""
        self._on_later = on_later
        try:
            yield
        finally:
            self._on_later = None

    def _note(self, number: int, _frame: FrameType | None) -> None:
        now = time.monotonic()
        if self._came is None:
            self._came = now
        elif now - self._came <= REPEATED:
            return
        elif self._on_later is not None:
            self._later = True
        else:
            signal.signal(number, signal.SIG_DFL)
            signal.raise_signal(number)
