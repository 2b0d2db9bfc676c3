"""Compiled kernels where they were built and are wanted, their twins elsewhere, which is said."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from mapweave.kernels.loading import COMPILED

STUB = Path(__file__).parents[3] / "mapweave" / "kernels" / "_compiled.pyi"
SAY = "from mapweave.kernels.loading import COMPILED, missing; print(COMPILED is None, missing())"
HIDE = "import sys; sys.modules['mapweave.kernels._compiled'] = None; "


def say(code: str, **environment: str) -> str:
    told = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return told.stdout.strip()


def test_who_asks_for_pure_numpy_gets_it_and_is_told_nothing() -> None:
    assert say(SAY, MAPWEAVE_PURE="1") == "True None"


def test_where_nothing_was_compiled_that_is_said_in_a_line() -> None:
    found, _, line = say(HIDE + SAY, MAPWEAVE_PURE="0").partition(" ")
    assert found == "True"
    assert line.startswith("kernels were not compiled") and "\n" not in line


@pytest.mark.skipif(COMPILED is None, reason="no compiled kernels here")
def test_the_stub_is_that_of_the_compiled_kernels(tmp_path: Path) -> None:
    generated = tmp_path / "stub.pyi"
    command = ["-m", "nanobind.stubgen", "-q", "-m", "mapweave.kernels._compiled"]
    # Elsewhere than in the checkout, which the generator would look into before what is installed.
    subprocess.run([sys.executable, *command, "-o", str(generated)], check=True, cwd=tmp_path)
    assert STUB.read_text() == generated.read_text()
