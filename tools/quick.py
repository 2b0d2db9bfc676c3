"""``make quick``: check what changed since the branch left main, in less than a minute.

Lints the changed files and runs, nearest first, as many of the tests that have to do with them
as fit. `imports` says what near is, `durations` how long a test takes.
"""

import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from tools.durations import REST, Durations, read_durations
from tools.imports import distances_of_tests

ROOT = Path(__file__).parents[1]
CORES = 2
BUDGET = 20.0 * CORES  # [s] of tests, as recorded
UNKNOWN = 0.5  # [s] of tests never timed
MAINS = ("main", "origin/main")


@dataclass(slots=True)
class Choice:
    """The tests to run.

    Attributes
    ----------
    files
        Files of tests, nearest first.
    left_out
        Single tests of these files that take too long, as pytest names them.
    further
        How many files that also have to do with the change found no room.
    """

    files: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    further: int = 0


def choose(distance: Mapping[str, int], durations: Durations, budget: float) -> Choice:
    """Return which tests to run within `budget` [s]: nearest first, of equals the quicker first."""
    choice = Choice()
    known = {file: durations.get(file, {REST: UNKNOWN}) for file in distance}
    for file in sorted(distance, key=lambda file: (distance[file], known[file][REST], file)):
        if known[file][REST] > budget:
            choice.further += 1
            continue
        choice.files.append(file)
        budget -= known[file][REST]
    for file in choice.files:
        named = {name: s for name, s in known[file].items() if name != REST}
        for name, seconds in sorted(named.items(), key=lambda item: item[1]):
            if seconds > budget:
                choice.left_out.append(f"{file}::{name}")
            else:
                budget -= seconds
    return choice


def main() -> int:
    """Check, and return the exit status: that of the first check that failed, else 0."""
    base = sys.argv[1] if len(sys.argv) > 1 else _left_main_at()
    files = _lines("git", "ls-files", "--cached", "--others", "--exclude-standard", "--deduplicate")
    files = [file for file in files if (ROOT / file).is_file()]
    changed = _changed_since(base)
    if not changed:
        print(f"nothing changed since {base[:9]}: nothing to check")
        return 0
    choice = choose(distances_of_tests(ROOT, files, changed), read_durations(), BUDGET)
    _explain(base, changed, choice)
    return _check(sorted(changed & set(files)), choice)


def _left_main_at() -> str:
    """Return the commit where this branch left main."""
    for main_branch in MAINS:
        command = ["git", "merge-base", "HEAD", main_branch]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        if done.returncode == 0:
            return done.stdout.strip()
    raise SystemExit(
        "there is no branch main to compare with; name a commit: make quick BASE=COMMIT"
    )


def _changed_since(base: str) -> set[str]:
    """Return the files that differ from `base`: committed, staged, edited, new or gone."""
    tracked = _lines("git", "diff", "--name-only", "--no-renames", base)
    return {*tracked, *_lines("git", "ls-files", "--others", "--exclude-standard")}


def _lines(*command: str) -> list[str]:
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(command)}: {done.stderr.strip()}")
    return done.stdout.splitlines()


def _explain(base: str, changed: set[str], choice: Choice) -> None:
    print(f"{len(changed)} files changed since {base[:9]}; {len(choice.files)} files of tests have")
    print("to do with them and fit into the time; make test runs all")
    if choice.left_out or choice.further:
        print(f"left out: {choice.further} files of tests, and {len(choice.left_out)} long tests")


def _check(changed: list[str], choice: Choice) -> int:
    """Run tests and the slower half of the lint side by side; return the exit status."""
    sources = [file for file in changed if file.endswith(".py")]
    waiting = [subprocess.Popen([_tool("mypy"), *sources], cwd=ROOT)] if sources else []
    status = 0
    for command in (*_lint(sources), *_tests(choice)):
        done = subprocess.run(command, cwd=ROOT, check=False)
        status = status or done.returncode
    for process in waiting:
        status = process.wait() or status
    return status


def _lint(sources: list[str]) -> list[list[str]]:
    if not sources:
        return []
    ruff = _tool("ruff")
    return [
        [ruff, "check", "--quiet", *sources],
        [ruff, "format", "--quiet", "--check", *sources],
        [_tool("lint-imports")],
    ]


def _tests(choice: Choice) -> list[list[str]]:
    if not choice.files:
        return []
    left_out = [f"--deselect={test}" for test in choice.left_out]
    options = ["-q", "-n", str(CORES), "-m", "not slow", "-p", "tools.deadline", *left_out]
    return [[_tool("pytest"), *options, *choice.files]]


def _tool(name: str) -> str:
    return str(Path(sys.executable).with_name(name))


if __name__ == "__main__":
    sys.exit(main())
