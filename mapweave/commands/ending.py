"""Ctrl-C where scans come live, or the word to terminate: what came until then is mapped."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TypeVar

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)

Item = TypeVar("Item")


class Ending:
    """Whether an end was asked for."""

    def __init__(self) -> None:
        self.asked = False
        self._waiting = False

    def note(self, _number: int, _frame: FrameType | None) -> None:
        """End the waiting for an item; a signal that comes again changes nothing."""
        self.asked = True
        if self._waiting:
            self._waiting = False
            raise KeyboardInterrupt

    def until(self, items: Iterator[Item]) -> Iterator[Item]:
        """Yield `items` until an end is asked for.

        It ends the waiting for an item at once, but nothing that is being done with one: a map
        must not be left half changed.
        """
        try:
            while not self.asked:
                self._waiting = True
                try:
                    item = next(items)
                finally:
                    self._waiting = False
                yield item
        except (StopIteration, KeyboardInterrupt):  # no more come, or are wanted
            return


@contextmanager
def ended_in_order() -> Iterator[Ending]:
    """Have Ctrl-C, and the word to terminate, end in a block only what is `Ending.until`.

    They may come twice: shells and `timeout` tell a process and then its group. Once an end was
    asked for, the program is about to end, and they are ignored until it has: a handler of Python's
    is gone before its process is. For the main thread.
    """
    ending = Ending()
    before = {number: signal.signal(number, ending.note) for number in STOP_SIGNALS}
    try:
        yield ending
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if ending.asked else handler)
