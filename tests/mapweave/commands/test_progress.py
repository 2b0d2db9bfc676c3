"""A bar is for a person at a terminal, and for nobody else."""

import os
import subprocess
import sys

import pytest

from mapweave.commands.progress import track

PROGRAM = (
    "from mapweave.commands.progress import track; print(sum(track(iter([1, 2, 3]), 'adding', 3)))"
)


def test_without_a_terminal_nothing_is_written(capfd: pytest.CaptureFixture[str]) -> None:
    assert list(track(iter("abc"), "spelling", total=3)) == ["a", "b", "c"]
    assert capfd.readouterr() == ("", "")


def test_on_a_terminal_a_bar_tells_what_is_done_and_standard_output_stays_clean() -> None:
    ours, terminal = os.openpty()
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM],
        stdout=subprocess.PIPE,
        stderr=terminal,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "80"},
    ) as process:
        os.close(terminal)
        output, _ = process.communicate(timeout=60)
    shown = os.read(ours, 65536).decode()
    os.close(ours)
    assert output == b"6\n"
    assert "adding" in shown
    assert "3/3" in shown
