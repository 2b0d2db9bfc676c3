"""Signals to stop: the first one asks, the second one ends the process."""

import signal
from collections.abc import Callable
from types import FrameType

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def stop_on_signal() -> Callable[[], bool]:
    """Return what tells whether Ctrl-C was pressed or the process was told to terminate."""
    came: list[int] = []

    def note(number: int, _frame: FrameType | None) -> None:
        came.append(number)
        for stopping in STOP_SIGNALS:
            signal.signal(stopping, signal.SIG_DFL)

    for stopping in STOP_SIGNALS:
        signal.signal(stopping, note)
    return lambda: bool(came)
