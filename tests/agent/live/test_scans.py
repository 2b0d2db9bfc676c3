import threading
import time
from collections.abc import Iterator

import pytest

from mapweave.errors import FileError
from mapweave.io.scan_range import ScanRange
from mapweave.scan.scan import Scan
from mapweave_agent.live.scans import BACKLOG, LiveScans, scans_of

SOON, NEVER = 0.01, 20.0  # [s]


def scan(index: int) -> Scan:
    return Scan([1.0, 2.0], [0.0, 0.1], index)


def drain(live: LiveScans) -> list[int]:
    taken = []
    while not live.ended:
        found = live.take(NEVER)
        if found is not None:
            taken.append(found.index)
    return taken


def test_a_sensor_never_waits_and_what_is_oldest_goes() -> None:
    live = LiveScans(backlog=2)
    for index in range(5):
        live.put(scan(index))
    live.close()
    assert drain(live) == [3, 4]
    assert live.skipped == 3


def test_scans_are_taken_in_their_order_and_none_is_skipped_while_there_is_room() -> None:
    live = LiveScans()
    for index in range(BACKLOG):
        live.put(scan(index))
    live.close()
    assert (drain(live), live.skipped) == (list(range(BACKLOG)), 0)


def test_while_none_comes_nothing_is_taken_and_nothing_has_ended() -> None:
    live = LiveScans()
    assert live.take(SOON) is None
    assert not live.ended


class Source:
    """Scans, and in the end a failure, if there is one."""

    live = True

    def __init__(self, count: int, failure: FileError | None = None) -> None:
        self._count, self._failure = count, failure
        self.given = 0

    def count(self) -> None:
        """Nobody knows."""

    def scans(self) -> Iterator[Scan]:
        """Yield them."""
        for index in range(self._count):
            self.given += 1
            yield scan(index)
        if self._failure is not None:
            raise self._failure

    def close(self) -> None:
        """It ends by itself."""


def test_where_nothing_may_be_skipped_a_source_waits_for_its_turn() -> None:
    source = Source(50)
    with scans_of(source, ScanRange(), skipping=False) as live:
        assert live.take(NEVER) is not None
        assert source.given <= BACKLOG + 3
        assert drain(live) == list(range(1, 50))
        assert live.skipped == 0


def test_a_range_of_a_live_source_ends_it() -> None:
    with scans_of(Source(50), ScanRange(2, 5), skipping=False) as live:
        assert drain(live) == [2, 3, 4]


def test_what_a_source_fails_of_comes_after_its_scans() -> None:
    failing = Source(2, FileError("log", "is damaged"))
    with scans_of(failing, ScanRange(), skipping=False) as live:
        assert [live.take(NEVER), live.take(NEVER)] != [None, None]
        with pytest.raises(FileError, match="log: is damaged"):
            live.take(NEVER)
        assert not live.ended


def test_a_reader_that_waits_for_its_turn_ends_when_nobody_takes_scans_any_more() -> None:
    with scans_of(Source(50), ScanRange(), skipping=False) as live:
        assert live.take(NEVER) is not None
        reader = next(thread for thread in threading.enumerate() if thread.name == "source")
    reader.join(NEVER)
    assert not reader.is_alive()


def test_how_long_a_scan_waited_at_most_is_told_once() -> None:
    live = LiveScans()
    live.put(scan(0))
    time.sleep(5 * SOON)
    assert live.take(NEVER) is not None
    live.put(scan(1))
    assert live.take(NEVER) is not None
    assert live.oldest() >= 5 * SOON
    assert live.oldest() == 0.0


def test_of_scans_that_come_faster_than_they_are_taken_the_newest_is_next() -> None:
    with scans_of(Source(50), ScanRange()) as live:
        while not live.ended and live.skipped < 49:
            time.sleep(SOON)
        assert drain(live) == [49]
