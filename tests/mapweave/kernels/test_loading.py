"""Compiled kernels where they were built and are wanted, their twins elsewhere, which is said."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from mapweave.kernels.loading import COMPILED, digest_of_sources

KERNELS = Path(__file__).parents[3] / "mapweave" / "kernels"
STUB = KERNELS / "_compiled.pyi"
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


OLDER = "import sys, types; sys.modules['mapweave.kernels._compiled'] = types.ModuleType('older'); "
BROKEN = """import importlib
def cannot(name): raise ImportError('wrong ELF class')
importlib.import_module = cannot
"""
LOAD = "from mapweave.kernels.loading import load_compiled; from pathlib import Path; "


def test_kernels_of_other_sources_are_not_used_and_how_to_compile_them_is_said() -> None:
    load = f"{LOAD}print(*load_compiled(Path({str(KERNELS)!r})))"
    found, _, line = say(OLDER + load, MAPWEAVE_PURE="0").partition(" ")
    assert found == "None"
    assert line.startswith("kernels were compiled from other sources") and "\n" not in line
    assert line.endswith("pip install --no-deps --editable .")


def test_an_installed_package_which_has_no_sources_takes_the_kernels_it_has(tmp_path: Path) -> None:
    found = say(f"{OLDER}{LOAD}print(load_compiled(Path({str(tmp_path)!r})))", MAPWEAVE_PURE="0")
    assert found == "(<module 'older'>, None)"


def test_kernels_that_cannot_be_loaded_are_done_without_and_that_is_said() -> None:
    found, _, line = say(BROKEN + SAY, MAPWEAVE_PURE="0").partition(" ")
    assert found == "True"
    assert line.startswith("kernels cannot be loaded (wrong ELF class)")


def test_the_digest_tells_any_change_of_a_source(tmp_path: Path) -> None:
    assert digest_of_sources(tmp_path) is None
    (tmp_path / "a.hpp").write_text("int a;")
    first = digest_of_sources(tmp_path)
    (tmp_path / "a.hpp").write_text("int b;")
    second = digest_of_sources(tmp_path)
    (tmp_path / "a.hpp").rename(tmp_path / "c.hpp")
    assert len({first, second, digest_of_sources(tmp_path)}) == 3


@pytest.mark.skipif(COMPILED is None, reason="no compiled kernels here")
def test_the_compiled_kernels_are_of_the_sources_here() -> None:
    assert COMPILED is not None
    assert COMPILED.sources() == digest_of_sources(KERNELS)


@pytest.mark.skipif(COMPILED is None, reason="no compiled kernels here")
def test_the_stub_is_that_of_the_compiled_kernels(tmp_path: Path) -> None:
    generated = tmp_path / "stub.pyi"
    command = ["-m", "nanobind.stubgen", "-q", "-m", "mapweave.kernels._compiled"]
    # Elsewhere than in the checkout, which the generator would look into before what is installed.
    subprocess.run([sys.executable, *command, "-o", str(generated)], check=True, cwd=tmp_path)
    assert STUB.read_text() == generated.read_text()
