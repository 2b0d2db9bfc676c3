"""``make matrix``: the quicker tests with each Python that is installed, and lowest dependencies.

Each runs the wheel in an environment of its own under ``.matrix/``.
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from tools.durations import REST, read_durations
from tools.wheel_environment import ROOT, make_environment

VERSIONS = ("3.11", "3.12", "3.13")
LONGEST = 3.0  # [s]; longer tests are left to make test
FOLDER = ROOT / ".matrix"


def main() -> int:
    """Run all, say how each went, and return 1 if one failed."""
    runs = [(version, version, False) for version in VERSIONS]
    runs.insert(0, (f"{VERSIONS[0]}, lowest dependencies", VERSIONS[0], True))
    outcomes = {name: _try(version, lowest=lowest) for name, version, lowest in runs}
    for name, outcome in outcomes.items():
        print(f"Python {name}: {outcome}")
    return int("failed" in outcomes.values())


def _try(version: str, *, lowest: bool) -> str:
    """Return how the tests went: passed, failed, or not installed."""
    python = find_python(version)
    if python is None:
        return "not installed, left out"
    folder = FOLDER / (f"{version}-lowest" if lowest else version)
    inside = make_environment(folder, python, lowest=lowest)
    environment = {**os.environ, "PYTHONSAFEPATH": "1", "MAPWEAVE_INSTALLED": "1"}
    options = ["-q", "-n", "2", "-m", "not slow", *(f"--deselect={test}" for test in _long_tests())]
    command = [str(inside.with_name("pytest")), *options]
    done = subprocess.run(command, cwd=ROOT, env=environment, check=False)
    return "failed" if done.returncode else "passed"


def find_python(version: str) -> str | None:
    """Return the interpreter of `version`, such as ``3.12``: on the path, or one of pyenv's."""
    for candidate in _candidates(version):
        command = [candidate, "-c", "import sys; print('%d.%d' % sys.version_info[:2])"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode == 0 and done.stdout.strip() == version:
            return candidate
    return None


def _candidates(version: str) -> Iterator[str]:
    yield sys.executable
    on_path = shutil.which(f"python{version}")
    if on_path:
        yield on_path
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    yield from map(str, sorted(pyenv.glob(f"versions/{version}.*/bin/python")))


def _long_tests() -> Iterator[str]:
    for file, seconds in read_durations().items():
        long = (name for name, s in seconds.items() if name != REST and s > LONGEST)
        yield from (f"{file}::{name}" for name in long)


if __name__ == "__main__":
    sys.exit(main())
