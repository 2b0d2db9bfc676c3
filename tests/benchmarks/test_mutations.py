"""The list of mutations fits the code: what it would make wrong is there, and so are the tests."""

import ast
import re
import shutil
from collections import Counter
from functools import cache
from pathlib import Path
from typing import get_args

import pytest

from benchmarks.mutation_entries import Mutation, Place, Room, chosen, read_entries
from benchmarks.mutation_tree import ROOT, Tree
from benchmarks.mutations import Outcome, try_out, within_bar
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


def some_place() -> Place:
    return Place(file="code.py", before="a < b", after="a > b")


@cache
def names_in(path: Path) -> set[str]:
    """Return the names of the functions in a file of tests."""
    tree = ast.parse(path.read_text())
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


@cache
def meaning_of(text: str) -> str:
    """Return what Python reads, whatever its lay-out and comments."""
    return ast.dump(ast.parse(text))


@cache
def words_of(text: str) -> tuple[str, ...]:
    """Return what C++ reads, whatever its lay-out and comments."""
    return tuple(re.findall(r"\w+|[^\w\s]", re.sub(r"//.*", "", text)))


@pytest.mark.parametrize("mutation", ENTRIES, ids=[entry.name for entry in ENTRIES])
def test_each_makes_code_that_is_there_into_other_code(mutation: Mutation) -> None:
    for place in mutation.places:
        text = (ROOT / place.file).read_text()
        wrong = place.replace_in(text, mutation.name)
        meant = meaning_of if place.file.endswith(".py") else words_of
        assert meant(wrong) != meant(text)


@pytest.mark.parametrize("mutation", ENTRIES, ids=[entry.name for entry in ENTRIES])
def test_a_rule_of_a_twin_is_made_wrong_in_its_kernel_too(mutation: Mutation) -> None:
    """And is guarded in its room: that the two compute the same says nothing of the rule."""
    has_kernel = mutation.file.startswith("mapweave/kernels/")
    assert bool(mutation.kernel) == has_kernel
    assert all(
        re.fullmatch(r"mapweave/kernels/[\w/]+\.hpp", place.file) for place in mutation.kernel
    )
    assert not any(guard.startswith("tests/mapweave/kernels/") for guard in mutation.guards)


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
    assert some().apply(tmp_path) == {"code.py": "if a < b:\n    pass\n"}
    assert code.read_text() == "if a > b:\n    pass\n"


def test_all_places_are_changed_even_two_in_one_file(tmp_path: Path) -> None:
    right = {"code.py": "if a < b:\n", "code.hpp": "if (a < b || c) {\n"}
    for file, text in right.items():
        (tmp_path / file).write_text(text)
    kernel = (
        Place(file="code.hpp", before="a < b", after="a > b"),
        Place(file="code.hpp", before="|| c", after="|| !c"),
    )
    assert some().model_copy(update={"kernel": kernel}).apply(tmp_path) == right
    assert (tmp_path / "code.py").read_text() == "if a > b:\n"
    assert (tmp_path / "code.hpp").read_text() == "if (a > b || !c) {\n"


@pytest.mark.parametrize(("text", "times"), [("if b > a:\n", 0), ("a < b < c or a < b\n", 2)])
def test_a_place_that_is_not_there_once_is_named(tmp_path: Path, text: str, times: int) -> None:
    (tmp_path / "code.py").write_text(text)
    (tmp_path / "right.py").write_text("a < b\n")
    doubtful = some().model_copy(update={"file": "right.py", "kernel": (some_place(),)})
    with pytest.raises(FileError, match=f"mutation some: expected 'a < b' once, found it {times}"):
        doubtful.apply(tmp_path)
    assert (tmp_path / "code.py").read_text() == text
    assert (tmp_path / "right.py").read_text() == "a < b\n"


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
    assert try_out(tree, some().model_copy(update=fields)).noticed == noticed
    assert (tree.folder / file).read_text() == (ROOT / file).read_text()


@pytest.mark.slow
@pytest.mark.skipif(
    not all(map(shutil.which, ("cmake", "ninja", "c++"))), reason="nothing here to compile with"
)
def test_the_twin_and_the_kernel_are_made_wrong_and_tested_each(tree: Tree) -> None:
    """A rule is kept in one of the two, and the tests say in which they noticed."""
    (entry,) = chosen(ENTRIES, ["turn-noise-ignored"])
    right = {place.file: (ROOT / place.file).read_text() for place in entry.places}
    module = tree.compile()
    compiled = module.read_bytes()
    kept_by_twin = entry.model_copy(update={"after": f"{entry.before} + 0.0"})
    kept_by_kernel = tuple(
        p.model_copy(update={"after": f"{p.before} + 0.0"}) for p in entry.kernel
    )
    assert try_out(tree, entry).unnoticed == ()
    assert try_out(tree, kept_by_twin).unnoticed == ("the twin",)
    only_twin = entry.model_copy(update={"kernel": kept_by_kernel})
    assert try_out(tree, only_twin).unnoticed == ("the kernel",)
    assert {place.file: (tree.folder / place.file).read_text() for place in entry.places} == right
    assert module.read_bytes() == compiled


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
    unnoticed = ("the code",)
    outcomes = [Outcome(some(survived=True), unnoticed * (k < of_old), 1.0) for k in range(13)]
    outcomes += [Outcome(some(), unnoticed * (k < others), 1.0) for k in range(60)]
    assert within_bar(outcomes) == enough
