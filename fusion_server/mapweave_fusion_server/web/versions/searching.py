"""What was searched of the latest version, worked out beside all else and told when it is known."""

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from types import TracebackType
from typing import NamedTuple

from mapweave_fusion_server.web.versions.history import History
from mapweave_fusion_server.web.versions.json_text import to_json


class Searched(NamedTuple):
    """What was searched of a version: its number, and what is told of it, as JSON."""

    version: int
    text: bytes


class Searching:
    """Works it out in a thread of its own; a context manager that waits for the last one.

    Parameters
    ----------
    history
        Of all versions.
    on_found
        Called when there is news, in that thread.

    Attributes
    ----------
    found
        What was worked out last; None before there is any.
    """

    def __init__(self, history: History, on_found: Callable[[], None]) -> None:
        self.found: Searched | None = None
        self._history = history
        self._on_found = on_found
        self._asked = 0
        self._lock = threading.Lock()
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="searching")

    def __enter__(self) -> "Searching":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._worker.shutdown(wait=True, cancel_futures=True)

    def ask(self, version: int) -> None:
        """Have it worked out for `version`, unless that, or a later one, was asked for before."""
        with self._lock:
            if version > self._asked:
                self._asked = version
                self._worker.submit(self._search, version)

    def _search(self, version: int) -> None:
        if version < self._asked:
            return  # nobody looks at it any more
        components = self._history.coverage(version)
        self.found = Searched(version, to_json({"version": version, "components": components}))
        self._on_found()
