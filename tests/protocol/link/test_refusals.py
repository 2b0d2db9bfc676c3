"""Each refusal is counted; the log has a line a kind a minute, whatever comes."""

import pytest

from mapweave_protocol.link.guard.refusals import INTERVAL, MOST_SENDERS, OTHERS, Refusals


class Clock:
    """Says what it is set to."""

    def __init__(self) -> None:
        self.now = 1e6

    def __call__(self) -> float:
        """Return the time [s]."""
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def refusals(clock: Clock) -> Refusals:
    return Refusals(clock)


def test_each_is_counted_by_sender_and_kind(refusals: Refusals) -> None:
    for sender, kind in [("r1", "map"), ("r2", "map"), ("r1", "map"), ("r1", "pose")]:
        refusals.add(sender, kind, "key", "why")
    assert refusals.counts == {("r1", "map"): 2, ("r2", "map"): 1, ("r1", "pose"): 1}
    assert refusals.total == 4


def test_a_flood_is_a_line_a_kind_a_minute_that_counts_the_rest(
    refusals: Refusals, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    for _ in range(1000):
        for kind in ("map", "pose"):
            refusals.add("r1", kind, "the key", "damaged")
        clock.now += 3 * INTERVAL / 1000
    assert len(caplog.messages) == 2 * 3
    assert caplog.messages[0] == "the key: refused, damaged"
    assert caplog.messages[2] == (
        "the key: refused, damaged (333 more map refused since the last line)"
    )
    assert refusals.total == 2000


def test_after_however_many_kinds_of_keys_something_is_still_told(
    refusals: Refusals, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    for number in range(1000):
        refusals.add(f"r{number}", "map", f"key {number}", "damaged")
    assert len(caplog.messages) == 1
    clock.now += INTERVAL
    refusals.add("r1", "map", "the last key", "damaged")
    assert "the last key" in caplog.messages[-1]


def test_senders_without_end_count_as_one(refusals: Refusals) -> None:
    for number in range(1000):
        refusals.add(f"r{number}", "map", "key", "why")
    assert len(refusals.counts) == MOST_SENDERS + 1
    assert refusals.counts[OTHERS, "map"] == 1000 - MOST_SENDERS


def test_what_is_shown_is_one_line_of_bounded_length(
    refusals: Refusals, caplog: pytest.LogCaptureFixture
) -> None:
    refusals.add("r1", "map", "key\nforged line \x1b[2J" + "x" * 60_000, "why\r\x9b" + "y" * 60_000)
    [line] = caplog.messages
    assert line.isprintable()
    assert len(line) < 500
    assert "key\\nforged line \\x1b[2J" in line
