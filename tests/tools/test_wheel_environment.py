"""Which versions the promise of ``pyproject.toml`` is tried with."""

import tomllib
from pathlib import Path

from tools.wheel_environment import lowest_versions

PYPROJECT = Path(__file__).parents[2] / "pyproject.toml"


def test_each_dependency_is_tried_at_the_version_promised() -> None:
    project = tomllib.loads(PYPROJECT.read_text(encoding="utf-8"))["project"]
    promised = [*project["dependencies"], *project["optional-dependencies"]["plot"]]
    assert [line.replace("==", ">=") for line in lowest_versions()] == promised
