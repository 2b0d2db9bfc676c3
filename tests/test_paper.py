"""What docs/paper.md names is there: modules, functions, parameters, files and benchmarks."""

import argparse
import importlib
import re
import shlex
from pathlib import Path

import pytest
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from benchmarks.__main__ import BENCHMARKS

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")
QUOTED = sorted(set(re.findall(r"`([^`]+)`", PAGE)))
DOTTED = [name for name in QUOTED if re.fullmatch(r"(mapweave\w*|benchmarks)(\.\w+)+", name)]
FILES = [name for name in QUOTED if re.fullmatch(r"[\w/]+/\w+\.\w+", name)]
RUNS = [name for name in QUOTED if name.startswith("python -m benchmarks ")]
SECTIONS = ("V. ", "VI. ", "VII. ", "VIII. ", "A. ", "B. ", "C. ")


def find(name: str) -> object:
    """Return the module, or what is in one, that `name` stands for; of a model's field its info.

    Raises
    ------
    ModuleNotFoundError, AttributeError, KeyError
        Where there is none.
    """
    module, attributes = name, ""
    while True:
        try:
            found: object = importlib.import_module(module)
            break
        except ModuleNotFoundError as error:
            if "." not in module or not module.startswith(str(error.name)):
                raise
            module, _, last = module.rpartition(".")
            attributes = f"{last}.{attributes}"
    for attribute in filter(None, attributes.split(".")):
        fields: dict[str, FieldInfo] = {}
        if isinstance(found, type) and issubclass(found, BaseModel):
            fields = found.model_fields
        found = fields[attribute] if attribute in fields else getattr(found, attribute)
    return found


@pytest.mark.parametrize("name", DOTTED)
def test_every_name_on_the_page_is_there(name: str) -> None:
    assert find(name) is not None


@pytest.mark.parametrize(
    "name", ["mapweave.lines.merged", "mapweave.lines.merging.devolve", "mapweave.maps.LineMap.x"]
)
def test_a_name_that_is_not_there_is_noticed(name: str) -> None:
    with pytest.raises((ModuleNotFoundError, AttributeError)):
        find(name)


@pytest.mark.parametrize("name", FILES)
def test_every_file_on_the_page_is_there(name: str) -> None:
    assert (ROOT / name).is_file()


@pytest.mark.parametrize("command", RUNS)
def test_every_measurement_on_the_page_can_be_run(command: str) -> None:
    name, *arguments = shlex.split(command)[3:]
    parser = argparse.ArgumentParser(exit_on_error=False)
    BENCHMARKS[name].add_arguments(parser)
    parser.parse_args(arguments)


def test_the_page_goes_through_all_sections_of_the_paper() -> None:
    headings = re.findall(r"^##+ (.*)$", PAGE, re.MULTILINE)
    for section in SECTIONS:
        assert any(heading.startswith(section) for heading in headings), section


def test_the_page_names_enough_to_be_worth_following() -> None:
    """A broken pattern would follow nothing and find everything in order."""
    assert len(DOTTED) > 50
    assert min(len(FILES), len(RUNS)) > 1
