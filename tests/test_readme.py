"""What the README promises is there: commands, options, files, targets, names, keys and fields."""

import argparse
import ast
import importlib
import inspect
import re
import shlex
from importlib.metadata import entry_points
from pathlib import Path
from typing import get_args, get_type_hints

import pytest
from pydantic import BaseModel

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
from mapweave_protocol.wire import keys

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
PROSE = BLOCK.sub("", README)
MAKE_TARGET = re.compile(r"^make ([a-z-]+)")
TABLED: dict[str, type[BaseModel]] = {
    "MAP.json": MapFile,
    "submaps[]": SubmapFile,
    "JOINT.json": JointFile,
    "alignments[]": AlignmentFile,
    "components[]": ComponentFile,
}


def blocks(*languages: str) -> list[str]:
    return [text for language, text in BLOCK.findall(README) if language in languages]


def typed_lines() -> list[str]:
    """What the README tells a person to type: the lines of its ``sh`` blocks, without comments."""
    joined = "\n".join(blocks("sh")).replace("\\\n", " ")
    lines = [shlex.join(shlex.split(line, comments=True)) for line in joined.splitlines()]
    return [line for line in lines if line]


def mapweave_lines() -> list[str]:
    """Those that run a subcommand."""
    return [line for line in typed_lines() if re.match(r"mapweave [a-z]", line)]


def mentions() -> list[str]:
    """Spans of code in running text."""
    return re.findall(r"`([^`\n]+)`", PROSE)


def parser_of(name: str) -> argparse.ArgumentParser:
    found = {point.name: point for point in entry_points(group=COMMAND_GROUP)}
    assert name in found, f"there is no command {name}"
    command: Command = found[name].load()
    parser = argparse.ArgumentParser(prog=f"mapweave {name}")
    command.configure(parser)
    return parser


@pytest.mark.parametrize("line", mapweave_lines())
def test_every_command_line_is_understood(line: str) -> None:
    _, name, *arguments = shlex.split(line)
    parser_of(name).parse_args(arguments)


def test_every_command_has_a_line() -> None:
    shown = {line.split()[1] for line in mapweave_lines()}
    assert shown == {point.name for point in entry_points(group=COMMAND_GROUP)}


def test_every_command_and_option_named_in_the_text_exists() -> None:
    for words in (mention.split() for mention in mentions()):
        if words[0] != "mapweave" or len(words) == 1:
            continue
        known = parser_of(words[1]).format_help()
        for option in (word for word in words[2:] if word.startswith("--")):
            assert option in known, f"{words[1]} has no {option}"


def test_every_make_target_named_exists() -> None:
    matches = [MAKE_TARGET.match(text) for text in (*mentions(), *typed_lines())]
    named = {match[1] for match in matches if match}
    assert {"demo", "test"} <= named
    assert named <= set(re.findall(r"^([a-z-]+):", MAKEFILE, re.MULTILINE))


def test_every_file_linked_exists() -> None:
    links = re.findall(r"\]\(([^)#]+)[^)]*\)", README) + re.findall(r'src="([^"]+)"', README)
    local = [link for link in links if "://" not in link]
    assert local
    assert [link for link in local if not (ROOT / link).exists()] == []


def test_every_section_linked_exists() -> None:
    headings = re.findall(r"^#+ (.+)$", PROSE, re.MULTILINE)
    anchors = {re.sub(r"[^\w -]", "", h.lower()).replace(" ", "-") for h in headings}
    assert set(re.findall(r"\]\(#([^)]+)\)", README)) <= anchors


@pytest.mark.parametrize("code", blocks("python"))
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
    examples = "\n".join(blocks("python"))
    used = {
        (joint_map if owner == "joint" else JointComponent, field)
        for owner, field in re.findall(r"\b(joint|component)\.(\w+)", examples)
    }
    assert len(used) > 1
    assert [field for owner, field in used if field not in owner.__dataclass_fields__] == []


def test_the_keys_on_the_wire_are_those_of_the_code() -> None:
    written = {
        re.sub(r"<(\w+)>", r"{\1}", key) for key in re.findall(r"^mapweave/@v1/\S+", README, re.M)
    }
    assert written == {
        value.text for value in vars(keys).values() if isinstance(value, keys.KeyFormat)
    }


@pytest.mark.parametrize("place", TABLED)
def test_every_field_of_the_files_is_in_the_tables_and_no_other(place: str) -> None:
    row = rf"^\| `{re.escape(place)}` \| `(\w+)` \|"
    assert set(re.findall(row, README, re.MULTILINE)) == set(TABLED[place].model_fields)


def test_the_pictures_are_small() -> None:
    assert sum(file.stat().st_size for file in (ROOT / "docs").rglob("*")) < 600_000
