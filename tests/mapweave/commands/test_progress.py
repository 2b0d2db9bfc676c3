"""A bar is for a person at a terminal, and for nobody else."""

import os
import subprocess
import sys

import pytest

from mapweave.commands.progress import busy, track

PROGRAM = (
    "from mapweave.commands.progress import track; print(sum(track(iter([1, 2, 3]), 'adding', 3)))"
)


BUSY = """
import time
from mapweave.commands.progress import busy
with busy('joining'):
    time.sleep(0.5)
    print(6)
"""


def test_without_a_terminal_nothing_is_written(capfd: pytest.CaptureFixture[str]) -> None:
    assert list(track(iter("abc"), "spelling", total=3)) == ["a", "b", "c"]
    assert capfd.readouterr() == ("", "")


def on_a_terminal(program: str) -> tuple[bytes, str]:
    """Run a program; return its standard output, and what its terminal shows."""
    ours, terminal = os.openpty()
    with subprocess.Popen(
        [sys.executable, "-c", program],
        stdout=subprocess.PIPE,
        stderr=terminal,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "80"},
    ) as process:
        os.close(terminal)
        output, _ = process.communicate(timeout=60)
    shown = os.read(ours, 65536).decode()
    os.close(ours)
    return output, shown


def test_on_a_terminal_a_bar_tells_what_is_done_and_standard_output_stays_clean() -> None:
    output, shown = on_a_terminal(PROGRAM)
    assert output == b"6\n"
    assert "adding" in shown
    assert "3/3" in shown


def test_what_takes_nobody_knows_how_long_is_shown_to_be_under_way() -> None:
    output, shown = on_a_terminal(BUSY)
    assert output == b"6\n"
    assert "joining" in shown


def test_nor_is_that_written_without_a_terminal(capfd: pytest.CaptureFixture[str]) -> None:
    with busy("joining"):
        pass
    assert capfd.readouterr() == ("", "")
