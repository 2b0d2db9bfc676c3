"""Ctrl-C, or the word to terminate, ends what comes live, and keeps what came."""

import os
import signal
import time
from collections.abc import Iterator

import pytest

from mapweave.commands.ending import STOP_SIGNALS, ended_in_order

NEVER = 60.0  # [s]

either = pytest.mark.parametrize("how", STOP_SIGNALS)


@pytest.fixture(autouse=True)
def _heard_again() -> Iterator[None]:
    """Have signals be heard again after a test: what others start would ignore them as well."""
    before = {number: signal.getsignal(number) for number in STOP_SIGNALS}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def tell(how: signal.Signals) -> None:
    os.kill(os.getpid(), how)
    time.sleep(0.01)


def waited_for(count: int, how: signal.Signals) -> Iterator[int]:
    """Yield numbers, then have the signal come while the next is waited for."""
    yield from range(count)
    tell(how)
    time.sleep(NEVER)
    yield count


@either
def test_what_comes_to_its_end_is_all_there_and_signals_are_as_they_were(
    how: signal.Signals,
) -> None:
    before = signal.getsignal(how)
    with ended_in_order() as ending:
        assert list(ending.until(iter(range(3)))) == [0, 1, 2]
    assert not ending.asked
    assert signal.getsignal(how) is before


@either
def test_a_signal_ends_the_waiting_and_all_that_came_is_there(how: signal.Signals) -> None:
    with ended_in_order() as ending:
        assert list(ending.until(waited_for(3, how))) == [0, 1, 2]
    assert ending.asked


@either
def test_what_is_being_done_when_a_signal_comes_is_done_to_its_end(how: signal.Signals) -> None:
    done = []
    with ended_in_order() as ending:
        for item in ending.until(iter(range(3))):
            tell(how)
            done.append(item)
    assert done == [0]


@either
def test_a_signal_that_is_told_again_changes_nothing(how: signal.Signals) -> None:
    done: list[object] = []
    with ended_in_order() as ending:
        done.extend(ending.until(waited_for(3, how)))
        tell(how)
        done.append("written")
    assert done == [0, 1, 2, "written"]
