"""Which single wrong lines the tests notice: each of mutations.toml, in a copy of the tree."""

import argparse
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue

from benchmarks.mutation_entries import Mutation, chosen, read_entries
from benchmarks.tables import format_table
from tests.conftest import DATA

ROOT = Path(__file__).parents[1]
AT_ONCE = 2
PATIENCE = 120.0  # [s] for tests that take a few seconds; what hangs was noticed
CHECKING = 1200.0  # [s] for all of them, once, on the code as it is
MOST_SURVIVING = 0.05  # of those that are not among the survivors of old: of these none
MADE = {"bench", "demo", "team", "site", "dist"}  # folders at the root that are no code
PASSED, FAILED, INTERRUPTED = 0, 1, 2  # what pytest ends with


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a mutation."""

    mutation: Mutation
    noticed: bool
    seconds: float

    def __str__(self) -> str:
        """One line of progress."""
        word = "noticed " if self.noticed else "SURVIVES"
        return f"{word} {self.seconds:5.1f} s  {self.mutation.room:<12}  {self.mutation.name}"


class Tree:
    """A copy of the code and its tests, in which both are imported from the copy."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        shutil.copytree(ROOT, folder, ignore=_left_out)
        with (folder / "pyproject.toml").open("rb") as file:
            roots = tomllib.load(file)["tool"]["hatch"]["build"]["dev-mode-dirs"]
        self._environment = {
            "MAPWEAVE_DATA": str(DATA),
            **os.environ,
            # Before what is installed; without byte code, which may look as new as a changed file.
            "PYTHONPATH": os.pathsep.join(str(folder / root) for root in roots),
            "PYTHONDONTWRITEBYTECODE": "1",
            "OMP_NUM_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
        }

    def test(self, guards: Sequence[str], patience: float) -> tuple[int | None, str]:
        """Run tests until one fails; return what pytest ended with, None out of time, and said."""
        command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *guards]
        process = subprocess.Popen(
            command,
            cwd=self.folder,
            env=self._environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        try:
            said, _ = process.communicate(timeout=patience)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            said, _ = process.communicate()
            return None, said
        return process.returncode, said

    def try_out(self, mutation: Mutation) -> Outcome:
        """Make the code wrong, run the tests that guard it, and make it right again."""
        begun = time.monotonic()
        right = mutation.apply(self.folder)
        try:
            status, said = self.test(mutation.guards, PATIENCE)
        finally:
            (self.folder / mutation.file).write_text(right)
        if status is not None and status > INTERRUPTED:
            sys.exit(f"mutation {mutation.name}: its tests cannot be run\n{said}")
        return Outcome(mutation, status != PASSED, time.monotonic() - begun)


def _left_out(folder: str, names: list[str]) -> set[str]:
    """Return which `names` in `folder` are not copied: hidden ones, byte code, what was made."""
    made = MADE if Path(folder) == ROOT else set()
    return {name for name in names if name.startswith((".", "__pycache__"))} | made


def check_guards(tree: Tree, mutations: Sequence[Mutation]) -> None:
    """End the program unless all guarding tests pass on the code as it is."""
    guards = sorted({guard for mutation in mutations for guard in mutation.guards})
    status, said = tree.test(guards, CHECKING)
    if status != PASSED:
        sys.exit(f"the guarding tests do not pass on the code as it is\n{said}")
    print(f"{len(guards)} guarding tests and files of tests pass on the code as it is")


def try_all(trees: Sequence[Tree], mutations: Sequence[Mutation]) -> list[Outcome]:
    """Try the mutations, one at a time in each of the trees."""
    free: SimpleQueue[Tree] = SimpleQueue()
    for tree in trees:
        free.put(tree)

    def try_one(mutation: Mutation) -> Outcome:
        tree = free.get()
        try:
            outcome = tree.try_out(mutation)
        finally:
            free.put(tree)
        print(outcome)
        return outcome

    with ThreadPoolExecutor(len(trees)) as workers:
        try:
            return list(workers.map(try_one, mutations))
        finally:
            workers.shutdown(cancel_futures=True)  # interrupted: what was not begun is not


def summary(outcomes: Sequence[Outcome]) -> str:
    """Return how many of each room were noticed, as a table."""
    rows = []
    for room in dict.fromkeys(outcome.mutation.room for outcome in outcomes):
        here = [outcome.noticed for outcome in outcomes if outcome.mutation.room == room]
        rows.append([room, str(len(here)), str(here.count(False))])
    rows.append(["all", str(len(outcomes)), str(sum(not o.noticed for o in outcomes))])
    return format_table(["room", "mutations", "survive"], rows)


def within_bar(outcomes: Sequence[Outcome]) -> bool:
    """Tell whether no survivor of old survives again, and few enough of the others do."""
    of_old = [o.noticed for o in outcomes if o.mutation.survived]
    others = [o.noticed for o in outcomes if not o.mutation.survived]
    return all(of_old) and others.count(False) <= MOST_SURVIVING * len(others)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the names of some."""
    parser.add_argument(
        "--only", nargs="+", default=[], metavar="NAME", help="mutations or rooms to try"
    )


def run(options: argparse.Namespace) -> None:
    """Try the mutations, name those that survive, and end with 1 where there are too many."""
    mutations = chosen(read_entries(), options.only)
    with tempfile.TemporaryDirectory(prefix="mutations-") as folder:
        trees = [Tree(Path(folder) / str(k)) for k in range(AT_ONCE)]
        check_guards(trees[0], mutations)
        outcomes = try_all(trees, mutations)
    print(summary(outcomes))
    for outcome in outcomes:
        if not outcome.noticed:
            print(f"survives: {outcome.mutation.name}, in {outcome.mutation.file}")
    if not within_bar(outcomes):
        sys.exit(1)
