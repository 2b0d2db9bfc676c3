"""What the pages promise is there: commands, options, files, targets, names, keys and fields."""

import argparse
import ast
import importlib
import inspect
import re
import shlex
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest
from pydantic import BaseModel

from benchmarks.__main__ import BENCHMARKS
from mapweave.cli import COMMAND_GROUP, Command
from mapweave.io.map_schema import (
    AlignmentFile,
    ComponentFile,
    JointFile,
    MapFile,
    SubmapFile,
)
from mapweave.maps import JointComponent
from mapweave_protocol import joint_maps
from mapweave_protocol.wire import keys, messages
from mapweave_protocol.wire.model import Message

ROOT = Path(__file__).parents[1]
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
MAKE_TARGET = re.compile(r"^make ([a-z-]+)")
BENCHMARK = re.compile(r"python -m benchmarks ([a-z][\w-]*)")
FOR_DEVELOPERS = {"fuzz", "docs", "peers", "test", "dev"}  # extras
TABLED: dict[str, type[BaseModel]] = {
    "MAP.json": MapFile,
    "submaps[]": SubmapFile,
    "JOINT.json": JointFile,
    "alignments[]": AlignmentFile,
    "components[]": ComponentFile,
}


@dataclass(frozen=True)
class Page:
    """A page of Markdown."""

    path: Path

    @property
    def name(self) -> str:
        """Its path in the repository."""
        return self.path.relative_to(ROOT).as_posix()

    @property
    def text(self) -> str:
        """All of it."""
        return self.path.read_text(encoding="utf-8")

    @property
    def prose(self) -> str:
        """The page without its blocks of code."""
        return BLOCK.sub("", self.text)

    def blocks(self, language: str) -> list[str]:
        """Its blocks of code in `language`."""
        return [text for found, text in BLOCK.findall(self.text) if found == language]

    def typed_lines(self) -> list[str]:
        """What it tells a person to type: the lines of its ``sh`` blocks, without comments."""
        joined = "\n".join(self.blocks("sh")).replace("\\\n", " ")
        lines = [shlex.join(shlex.split(line, comments=True)) for line in joined.splitlines()]
        return [line for line in lines if line]

    def mentions(self) -> list[str]:
        """Spans of code in running text."""
        return re.findall(r"`([^`\n]+)`", self.prose)

    def links(self) -> list[str]:
        """What it links to, and the pictures that it shows."""
        return re.findall(r"\]\(([^)]+)\)", self.prose) + re.findall(r'src="([^"]+)"', self.prose)

    def anchors(self) -> set[str]:
        """What links may name after ``#``."""
        headings = re.findall(r"^#+ (.+)$", self.prose, re.MULTILINE)
        return {re.sub(r"[^\w -]", "", h.lower()).replace(" ", "-") for h in headings}


README, ARCHITECTURE = Page(ROOT / "README.md"), Page(ROOT / "ARCHITECTURE.md")
FORMATS, WIRE = Page(ROOT / "docs" / "formats.md"), Page(ROOT / "docs" / "wire.md")
PAGES = [
    Page(path)
    for folder in (ROOT, ROOT / "docs", ROOT / "benchmarks")
    for path in sorted(folder.glob("*.md"))
]
every_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)


def mapweave_lines() -> list[str]:
    """Typed lines that run a subcommand."""
    lines = dict.fromkeys(line for page in PAGES for line in page.typed_lines())
    return [line for line in lines if re.match(r"mapweave [a-z]", line)]


def parser_of(name: str) -> argparse.ArgumentParser:
    found = {point.name: point for point in entry_points(group=COMMAND_GROUP)}
    assert name in found, f"there is no command {name}"
    command: Command = found[name].load()
    parser = argparse.ArgumentParser(prog=f"mapweave {name}")
    command.configure(parser)
    return parser


def test_every_extra_that_does_something_for_a_user_is_in_the_readme() -> None:
    known = set(PROJECT["project"]["optional-dependencies"]) - FOR_DEVELOPERS
    install = next(line for line in README.text.splitlines() if "pip install '.[" in line)
    assert set(re.findall(r"[a-z0-9]+", install.partition("pip install '.[")[2])) >= known


@pytest.mark.parametrize("line", mapweave_lines())
def test_every_command_line_is_understood(line: str) -> None:
    _, name, *arguments = shlex.split(line)
    parser_of(name).parse_args(arguments)


def test_every_command_has_a_line() -> None:
    shown = {line.split()[1] for line in mapweave_lines()}
    assert shown == {point.name for point in entry_points(group=COMMAND_GROUP)}


@every_page
def test_every_command_and_option_named_in_the_text_exists(page: Page) -> None:
    for words in (mention.split() for mention in page.mentions()):
        if words[0] != "mapweave" or not words[1:] or not words[1].isalpha() or words[1].isupper():
            continue
        known = parser_of(words[1]).format_help()
        for option in (word for word in words[2:] if word.startswith("--")):
            assert option in known, f"{words[1]} has no {option}"


@every_page
def test_every_make_target_named_exists(page: Page) -> None:
    matches = [MAKE_TARGET.match(text) for text in (*page.mentions(), *page.typed_lines())]
    named = {match[1] for match in matches if match}
    assert named <= set(re.findall(r"^([a-z-]+):", MAKEFILE, re.MULTILINE))


def test_the_readme_begins_with_two_commands() -> None:
    assert README.typed_lines()[:2] == ["make demo", "make test"]


@every_page
def test_every_benchmark_named_exists(page: Page) -> None:
    assert set(BENCHMARK.findall(page.text)) <= set(BENCHMARKS)


@every_page
def test_every_file_and_section_linked_exists(page: Page) -> None:
    assert [link for link in page.links() if not _leads_somewhere(page, link)] == []


def _leads_somewhere(page: Page, link: str) -> bool:
    if "://" in link:
        return True
    file, _, section = link.partition("#")
    target = page.path.parent / file if file else page.path
    return target.exists() and (not section or section in Page(target).anchors())


@every_page
def test_every_module_named_exists(page: Page) -> None:
    """By its path in the repository or in ``mapweave/``, or by its name alone."""
    named = [m for m in page.mentions() if re.fullmatch(r"[\w/]+\.py", m)]
    assert [name for name in named if not _is_module(name)] == []


def _is_module(name: str) -> bool:
    places = [ROOT / name, ROOT / "mapweave" / name]
    if "/" not in name:
        places += [path for top in _packages() for path in top.rglob(name)]
    return any(place.is_file() for place in places)


def _packages() -> Iterator[Path]:
    for package in PROJECT["tool"]["scikit-build"]["wheel"]["packages"]:
        yield ROOT / package
    yield ROOT / "benchmarks"


@every_page
def test_every_page_can_be_found_from_another_one(page: Page) -> None:
    linked = {
        (other.path.parent / link.partition("#")[0]).resolve()
        for other in PAGES
        if other != page
        for link in other.links()
        if "://" not in link
    }
    assert page == README or page.path in linked


def test_the_readme_is_short() -> None:
    assert len(README.text.splitlines()) <= 150


def test_the_quickstart_is_printed_as_it_stands() -> None:
    code = (ROOT / "examples" / "quickstart.py").read_text(encoding="utf-8")
    assert code in README.blocks("python")


PYTHON_EXAMPLES = [code for page in PAGES for code in page.blocks("python")]


@pytest.mark.parametrize("code", PYTHON_EXAMPLES)
def test_every_name_in_a_python_example_exists(code: str) -> None:
    """Imports work, what is taken from a module is in it, and its functions take the arguments."""
    tree = ast.parse(code)
    modules = {
        alias.name: importlib.import_module(alias.name)
        for node in ast.walk(tree)
        if isinstance(node, ast.Import)
        for alias in node.names
    }
    assert modules
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            owner = node.func.value
            if isinstance(owner, ast.Name) and owner.id in modules:
                function = getattr(modules[owner.id], node.func.attr)
                given = {keyword.arg or "": None for keyword in node.keywords}
                inspect.signature(function).bind(*node.args, **given)


def test_a_joint_map_has_what_the_example_prints() -> None:
    (joint_map,) = get_args(get_type_hints(joint_maps)["return"])
    (examples,) = [code for code in README.blocks("python") if "joint_maps" in code]
    used = {
        (joint_map if owner == "joint" else JointComponent, field)
        for owner, field in re.findall(r"\b(joint|component)\.(\w+)", examples)
    }
    assert len(used) > 1
    assert [field for owner, field in used if field not in owner.__dataclass_fields__] == []


def test_the_keys_on_the_wire_are_those_of_the_code() -> None:
    keys_written = re.findall(r"^mapweave/@?v\d\S+", WIRE.text, re.MULTILINE)
    written = {re.sub(r"<(\w+)>", r"{\1}", key) for key in keys_written}
    assert written == {
        value.text for value in vars(keys).values() if isinstance(value, keys.KeyFormat)
    }


def test_the_messages_on_the_wire_are_those_of_the_code() -> None:
    kinds = [value for value in vars(messages).values() if isinstance(value, type)]
    letters = {k.letter.decode() for k in kinds if issubclass(k, Message) and k is not Message}
    assert letters
    assert set(re.findall(r"^\| [^|`]+ \| `([a-z])` \|", WIRE.text, re.MULTILINE)) == letters


@pytest.mark.parametrize("place", TABLED)
def test_every_field_of_the_files_is_in_the_tables_and_no_other(place: str) -> None:
    row = rf"^\| `{re.escape(place)}` \| `(\w+)` \|"
    written = re.findall(row, FORMATS.text, re.MULTILINE)
    assert set(written) == set(TABLED[place].model_fields)


def test_the_layers_drawn_are_those_of_the_import_contract() -> None:
    (contract,) = [c for c in PROJECT["tool"]["importlinter"]["contracts"] if _is_of_library(c)]
    (drawn,) = [b for b in ARCHITECTURE.blocks("text") if b.startswith("commands ")]
    lines = [line for line in drawn.splitlines() if not line.startswith(" ")]
    assert [re.split(r"\s{2,}", line)[0] for line in lines] == contract["layers"]


def _is_of_library(contract: dict[str, Any]) -> bool:
    return contract["type"] == "layers" and contract.get("containers") == ["mapweave"]


def test_what_is_cited_is_this_version_and_the_paper() -> None:
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    version = re.search(r"^version: (\S+)$", citation, re.MULTILINE)
    assert version is not None
    assert version[1] == PROJECT["project"]["version"]
    names = re.findall(r"family-names: (\w+)", citation)
    assert names == ["Latecki", "Lakaemper", "Sun", "Wolter"]


def test_the_changelog_is_as_keep_a_changelog_wants_it() -> None:
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    versions = re.findall(r"^## (.+)$", changelog, re.MULTILINE)
    assert versions[0] == "[Unreleased]"
    kinds = set(re.findall(r"^### (.+)$", changelog, re.MULTILINE))
    assert kinds <= {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security", "Next"}


def test_the_pictures_are_small() -> None:
    assert sum(file.stat().st_size for file in (ROOT / "docs").rglob("*")) < 600_000
