"""Scans on their way from the thread that takes them to the one that maps them."""

import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager

from mapweave.errors import MapweaveError
from mapweave.io.scan_range import ScanRange
from mapweave.io.sources import ScanSource
from mapweave.scan.scan import Scan

BACKLOG = 1
"""Scans that may wait: a newer one takes the place, so that none is older than a period."""

FAREWELL = 2.0  # [s] for a source to leave its network


class LiveScans:
    """Room for the newest scan, which never makes a sensor wait: an older one makes way."""

    def __init__(self, backlog: int = BACKLOG) -> None:
        self._backlog = backlog
        self._queue: deque[tuple[Scan, float]] = deque()  # and when each came [s]
        self._changed = threading.Condition()
        self._closed = False
        self._failure: MapweaveError | None = None
        self._oldest = 0.0
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
            self._queue.append((scan, time.monotonic()))
            self._changed.notify_all()

    def put_in_turn(self, scan: Scan) -> None:
        """Hand a scan over when there is room for it, so that none is skipped."""
        with self._changed:
            self._changed.wait_for(lambda: len(self._queue) < self._backlog or self._closed)
            if not self._closed:
                self._queue.append((scan, time.monotonic()))
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
                scan, came = self._queue.popleft()
                self._oldest = max(self._oldest, time.monotonic() - came)
                return scan
            if self._failure is not None:
                raise self._failure
            return None

    def oldest(self) -> float:
        """Return how long a scan waited [s] at most since this was asked last."""
        with self._changed:
            oldest, self._oldest = self._oldest, 0.0
            return oldest

    def close(self, failure: MapweaveError | None = None) -> None:
        """Say that no more scans come, and why, where that is a failure."""
        with self._changed:
            self._closed, self._failure = True, failure
            self._changed.notify_all()


@contextmanager
def scans_of(
    source: ScanSource, selected: ScanRange, *, skipping: bool = True
) -> Iterator[LiveScans]:
    """Read a live source in a thread of its own.

    Parameters
    ----------
    skipping
        Whether scans that come faster than they are taken are left out; otherwise none is, and
        the source waits for its turn.
    """
    live = LiveScans()
    hand_over = live.put if skipping else live.put_in_turn

    def read() -> None:
        failure = None
        try:
            for scan in selected.of(source.scans()):
                hand_over(scan)
        except MapweaveError as error:
            failure = error
        finally:
            live.close(failure)

    # Nothing can wake a thread that waits for a pipe: it ends with the process.
    reader = threading.Thread(target=read, name="source", daemon=True)
    reader.start()
    try:
        yield live
    finally:
        live.close()
        source.close()
        reader.join(FAREWELL)
