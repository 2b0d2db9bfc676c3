"""Scans on their way from the thread that takes them to the one that maps them."""

import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager

from mapweave.errors import MapweaveError
from mapweave.io.scan_range import ScanRange
from mapweave.io.sources import ScanSource
from mapweave.scan.scan import Scan

BACKLOG = 4
"""Scans that may wait: what a mapper catches up with after it was held up for a moment."""


class LiveScans:
    """A short queue that never makes a sensor wait: the oldest scan goes where it is full."""

    def __init__(self, backlog: int = BACKLOG) -> None:
        self._backlog = backlog
        self._queue: deque[Scan] = deque()
        self._changed = threading.Condition()
        self._closed = False
        self._failure: MapweaveError | None = None
        self.skipped = 0

    @property
    def ended(self) -> bool:
        """Whether no scan waits and none will come."""
        with self._changed:
            return self._closed and not self._queue and self._failure is None

    @property
    def waiting(self) -> int:
        """How many scans are still to be taken."""
        with self._changed:
            return len(self._queue)

    def put(self, scan: Scan) -> None:
        """Hand a scan over at once; `skipped` counts those that went for it."""
        with self._changed:
            if len(self._queue) == self._backlog:
                self._queue.popleft()
                self.skipped += 1
            self._queue.append(scan)
            self._changed.notify_all()

    def put_in_turn(self, scan: Scan) -> None:
        """Hand a scan over when there is room for it, so that none is skipped."""
        with self._changed:
            self._changed.wait_for(lambda: len(self._queue) < self._backlog or self._closed)
            if not self._closed:
                self._queue.append(scan)
                self._changed.notify_all()

    def take(self, timeout: float) -> Scan | None:
        """Return the next scan; None if none came within `timeout` [s], or none will.

        Raises
        ------
        MapweaveError
            If where the scans come from has failed.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._queue or self._closed, timeout)
            if self._queue:
                self._changed.notify_all()
                return self._queue.popleft()
            if self._failure is not None:
                raise self._failure
            return None

    def close(self, failure: MapweaveError | None = None) -> None:
        """Say that no more scans come, and why, where that is a failure."""
        with self._changed:
            self._closed, self._failure = True, failure
            self._changed.notify_all()


@contextmanager
def scans_of(source: ScanSource, selected: ScanRange) -> Iterator[LiveScans]:
    """Read a live source in a thread of its own; one that writes to a pipe waits for its turn."""
    live = LiveScans()

    def read() -> None:
        failure = None
        try:
            for scan in selected.of(source.scans()):
                live.put_in_turn(scan)
        except MapweaveError as error:
            failure = error
        finally:
            live.close(failure)

    # Nothing can wake a thread that waits for a sensor: it ends with the process.
    threading.Thread(target=read, name="source", daemon=True).start()
    try:
        yield live
    finally:
        live.close()
