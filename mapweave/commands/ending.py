"""Ctrl-C where scans come live: what came until then is mapped, and written."""

import signal
from collections.abc import Iterator
from types import FrameType
from typing import TypeVar

Item = TypeVar("Item")


def until_interrupted(items: Iterator[Item]) -> Iterator[Item]:
    """Yield `items` until Ctrl-C; a second one interrupts, as usual.

    It ends the waiting for an item at once, but nothing that is being done with one: a map must not
    be left half changed. For the main thread.
    """
    waiting = asked = False

    def note(_number: int, _frame: FrameType | None) -> None:
        nonlocal asked
        asked = True
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if waiting:
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, note)
    try:
        while not asked:
            try:
                waiting = True
                item = next(items)
            except (StopIteration, KeyboardInterrupt):  # no more come, or are wanted
                return
            finally:
                waiting = False
            yield item
    finally:
        signal.signal(signal.SIGINT, before)
