"""Signals to stop: the first one asks, the second one ends the process."""

import signal
from collections.abc import Callable
from types import FrameType

from mapweave_protocol.link.service_manager import ServiceManager

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def stop_on_signal() -> Callable[[], bool]:
    """Return what tells whether Ctrl-C was pressed or the process was told to terminate.

    A main loop asks it in every turn: that is what a service manager takes for a sign of life.
    """
    came: list[int] = []
    manager = ServiceManager()

    def note(number: int, _frame: FrameType | None) -> None:
        came.append(number)
        for stopping in STOP_SIGNALS:
            signal.signal(stopping, signal.SIG_DFL)

    def asked() -> bool:
        stop = bool(came)  # once: it may come while a sign of life is given
        if stop:
            manager.stopping()
        else:
            manager.alive()
        return stop

    for stopping in STOP_SIGNALS:
        signal.signal(stopping, note)
    return asked
