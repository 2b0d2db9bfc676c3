"""The list of mutations fits the code: what it would make wrong is there, and so are the tests."""

import ast
from collections import Counter
from functools import cache
from pathlib import Path
from typing import get_args

import pytest

from benchmarks.mutation_entries import Mutation, Room, chosen, read_entries
from benchmarks.mutations import ROOT, Outcome, Tree, within_bar
from mapweave.errors import FileError

ENTRIES = read_entries()
OF_OLD = 13  # that no test noticed when the list was begun
OTHERS, IN_A_ROOM = 60, 5  # at least


def some(name: str = "some", *, survived: bool = False) -> Mutation:
    return Mutation(
        name=name,
        room="merging",
        survived=survived,
        file="code.py",
        before="a < b",
        after="a > b",
        guards=("tests/test_code.py",),
    )


@cache
def names_in(path: Path) -> set[str]:
    """Return the names of the functions in a file of tests."""
    tree = ast.parse(path.read_text())
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


@cache
def meaning_of(text: str) -> str:
    """Return what Python reads, whatever its lay-out and comments."""
    return ast.dump(ast.parse(text))


@pytest.mark.parametrize("mutation", ENTRIES, ids=[entry.name for entry in ENTRIES])
def test_each_makes_code_that_is_there_into_other_code(mutation: Mutation) -> None:
    text = (ROOT / mutation.file).read_text()
    assert text.count(mutation.before) == 1
    assert meaning_of(text.replace(mutation.before, mutation.after)) != meaning_of(text)


@pytest.mark.parametrize("mutation", ENTRIES, ids=[entry.name for entry in ENTRIES])
def test_each_is_guarded_by_tests_that_are_there(mutation: Mutation) -> None:
    for guard in mutation.guards:
        file, _, name = guard.partition("::")
        names = names_in(ROOT / file)
        assert not name or name.partition("[")[0] in names


def test_every_part_of_the_program_has_some() -> None:
    rooms = Counter(mutation.room for mutation in ENTRIES)
    assert set(rooms) == set(get_args(Room))
    assert min(rooms.values()) >= IN_A_ROOM
    assert len({mutation.name for mutation in ENTRIES}) == len(ENTRIES)
    of_old = sum(mutation.survived for mutation in ENTRIES)
    assert of_old == OF_OLD
    assert len(ENTRIES) - of_old >= OTHERS


def test_applying_one_changes_its_place_alone_and_returns_what_was_there(tmp_path: Path) -> None:
    code = tmp_path / "code.py"
    code.write_text("if a < b:\n    pass\n")
    assert some().apply(tmp_path) == "if a < b:\n    pass\n"
    assert code.read_text() == "if a > b:\n    pass\n"


@pytest.mark.parametrize(("text", "times"), [("if b > a:\n", 0), ("a < b < c or a < b\n", 2)])
def test_a_place_that_is_not_there_once_is_named(tmp_path: Path, text: str, times: int) -> None:
    (tmp_path / "code.py").write_text(text)
    with pytest.raises(FileError, match=f"mutation some: expected 'a < b' once, found it {times}"):
        some().apply(tmp_path)
    assert (tmp_path / "code.py").read_text() == text


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Tree:
    """Return a copy of the code."""
    return Tree(tmp_path_factory.mktemp("copies") / "tree")


@pytest.mark.parametrize(
    ("before", "after", "noticed"),
    [("{0,31}$", "{0,99}$", True), ('"""Return `name` if', '"""Give `name` back if', False)],
    ids=["a limit", "a docstring"],
)
def test_what_the_tests_notice_is_told_apart_and_the_copy_is_right_again(
    tree: Tree, before: str, after: str, noticed: bool
) -> None:
    file = "mapweave/ids.py"
    fields = {
        "file": file,
        "before": before,
        "after": after,
        "guards": ("tests/mapweave/test_ids.py",),
    }
    assert tree.try_out(some().model_copy(update=fields)).noticed == noticed
    assert (tree.folder / file).read_text() == (ROOT / file).read_text()


def test_tests_that_hang_are_ended(tree: Tree) -> None:
    status, _ = tree.test(["tests/mapweave/test_ids.py"], patience=0.01)
    assert status is None


def test_code_is_copied_and_what_was_made_is_not(tree: Tree) -> None:
    copied = {path.name for path in tree.folder.iterdir()}
    assert {"mapweave", "protocol", "tests", "pyproject.toml"} <= copied
    assert not {".venv", ".git", "bench", "team"} & copied
    assert (tree.folder / "mapweave" / "team" / "__init__.py").exists()


def test_some_are_chosen_by_name_or_by_room() -> None:
    entries = [some("one"), some("other").model_copy(update={"room": "agent"})]
    assert chosen(entries, []) == entries
    assert chosen(entries, ["other"]) == chosen(entries, ["agent"]) == entries[1:]
    with pytest.raises(ValueError, match="no mutation and no room 'third'"):
        chosen(entries, ["third"])


@pytest.mark.parametrize(
    ("of_old", "others", "enough"), [(0, 0, True), (0, 3, True), (0, 4, False), (1, 0, False)]
)
def test_none_of_old_and_five_percent_of_the_others_may_survive(
    of_old: int, others: int, enough: bool
) -> None:
    outcomes = [Outcome(some(survived=True), k >= of_old, 1.0) for k in range(13)]
    outcomes += [Outcome(some(), k >= others, 1.0) for k in range(60)]
    assert within_bar(outcomes) == enough
