"""Which single wrong lines the tests notice: each of mutations.toml, in a copy of the tree."""

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue

from benchmarks.mutation_entries import Mutation, chosen, read_entries
from benchmarks.mutation_tree import Tree
from benchmarks.tables import format_table

AT_ONCE = 2
PATIENCE = 120.0  # [s] for tests that take a few seconds; what hangs was noticed
CHECKING = 1200.0  # [s] for all of them, once, on the code as it is
MOST_SURVIVING = 0.05  # of those that are not among the survivors of old: of these none
PASSED, INTERRUPTED = 0, 2  # what pytest ends with


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a mutation.

    Attributes
    ----------
    mutation
        Which.
    unnoticed
        Where no test failed: in the code, or of a rule with a kernel in the twin or the kernel.
    seconds
        How long that took to find out.
    """

    mutation: Mutation
    unnoticed: tuple[str, ...]
    seconds: float

    @property
    def noticed(self) -> bool:
        """Whether a test failed wherever the code was wrong."""
        return not self.unnoticed

    def __str__(self) -> str:
        """One line of progress."""
        word = "noticed " if self.noticed else "SURVIVES"
        return f"{word} {self.seconds:5.1f} s  {self.mutation.room:<12}  {self.mutation.name}"


def try_out(tree: Tree, mutation: Mutation) -> Outcome:
    """Find out where the tests that guard a rule do not notice that it is wrong."""
    begun = time.monotonic()
    ended = tree.test_wrong(mutation, PATIENCE)
    for status, said in ended.values():
        if status is not None and status > INTERRUPTED:
            sys.exit(f"mutation {mutation.name}: its tests cannot be run\n{said}")
    unnoticed = tuple(where for where, (status, _) in ended.items() if status == PASSED)
    return Outcome(mutation, unnoticed, time.monotonic() - begun)


def check_guards(tree: Tree, mutations: Sequence[Mutation]) -> None:
    """End the program unless all guarding tests pass on the code as it is."""
    for pure in (False, True):
        asked = [mutation for mutation in mutations if mutation.kernel or not pure]
        guards = sorted({guard for mutation in asked for guard in mutation.guards})
        if not guards:
            continue
        used = "twins" if pure else "compiled kernels"
        status, said = tree.test(guards, CHECKING, pure=pure)
        if status != PASSED:
            sys.exit(f"the guarding tests do not pass on the code as it is, with {used}\n{said}")
        print(f"with {used} {len(guards)} guarding tests and files of tests pass on the code as is")


def try_all(trees: Sequence[Tree], mutations: Sequence[Mutation]) -> list[Outcome]:
    """Try the mutations, one at a time in each of the trees."""
    free: SimpleQueue[Tree] = SimpleQueue()
    for tree in trees:
        free.put(tree)

    def try_one(mutation: Mutation) -> Outcome:
        tree = free.get()
        try:
            outcome = try_out(tree, mutation)
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
        with ThreadPoolExecutor(AT_ONCE) as workers:
            list(workers.map(Tree.compile, trees))
        check_guards(trees[0], mutations)
        outcomes = try_all(trees, mutations)
    print(summary(outcomes))
    for outcome in outcomes:
        if not outcome.noticed:
            where = " and ".join(outcome.unnoticed)
            print(f"survives in {where}: {outcome.mutation.name}, in {outcome.mutation.file}")
    if not within_bar(outcomes):
        sys.exit(1)
