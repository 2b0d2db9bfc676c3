"""The last lines that the coordinator's journal told, for those who come to look."""

import logging
import threading
from collections import deque
from collections.abc import Callable
from typing import Any

from mapweave_fusion_server import journal

KEPT_LINES = 500


class StoryTail(logging.Handler):
    """Keeps what the journal tells; a context manager that listens as long as its block lasts.

    Parameters
    ----------
    on_line
        Called at each line, in the thread that told it.
    """

    def __init__(self, on_line: Callable[[], None]) -> None:
        super().__init__(logging.INFO)
        self._on_line = on_line
        self._lines: deque[dict[str, Any]] = deque(maxlen=KEPT_LINES)
        self._guard = threading.Lock()
        self._count = 0

    @property
    def count(self) -> int:
        """How many lines were told: the number of the last one."""
        return self._count

    def __enter__(self) -> "StoryTail":
        journal.LOGGER.addHandler(self)
        return self

    def __exit__(self, *_: object) -> None:
        journal.LOGGER.removeHandler(self)

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a line."""
        with self._guard:
            self._count += 1
            line = {"number": self._count, "time": record.created, "text": record.getMessage()}
            self._lines.append(line)
        self._on_line()

    def since(self, number: int) -> list[dict[str, Any]]:
        """Return the lines after line `number`, as far as they are kept, oldest first."""
        with self._guard:
            return [line for line in self._lines if line["number"] > number]
