"""Ctrl-C ends what comes live, and keeps what came."""

import os
import signal
import time
from collections.abc import Iterator

import pytest

from mapweave.commands.ending import until_interrupted

NEVER = 60.0  # [s]


def press() -> None:
    os.kill(os.getpid(), signal.SIGINT)


def waited_for(count: int) -> Iterator[int]:
    """Yield numbers, then have Ctrl-C pressed while the next is waited for."""
    yield from range(count)
    press()
    time.sleep(NEVER)
    yield count


def test_what_comes_to_its_end_is_all_there_and_ctrl_c_is_as_it_was() -> None:
    before = signal.getsignal(signal.SIGINT)
    assert list(until_interrupted(iter(range(3)))) == [0, 1, 2]
    assert signal.getsignal(signal.SIGINT) is before


def test_ctrl_c_ends_the_waiting_and_all_that_came_is_there() -> None:
    before = signal.getsignal(signal.SIGINT)
    assert list(until_interrupted(waited_for(3))) == [0, 1, 2]
    assert signal.getsignal(signal.SIGINT) is before


def test_what_is_being_done_when_ctrl_c_comes_is_done_to_its_end() -> None:
    done = []
    for item in until_interrupted(iter(range(3))):
        press()
        time.sleep(0.01)
        done.append(item)
    assert done == [0]


def test_a_second_ctrl_c_interrupts() -> None:
    with pytest.raises(KeyboardInterrupt):
        for _ in until_interrupted(iter(range(3))):
            press()
            time.sleep(0.01)
            press()
            time.sleep(NEVER)
