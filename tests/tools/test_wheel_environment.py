"""Which versions the promise of ``pyproject.toml`` is tried with."""

import tomllib
from pathlib import Path

from tools.wheel_environment import fitting_wheels, lowest_versions

PYPROJECT = Path(__file__).parents[2] / "pyproject.toml"


def test_each_dependency_is_tried_at_the_version_promised() -> None:
    project = tomllib.loads(PYPROJECT.read_text(encoding="utf-8"))["project"]
    promised = [*project["dependencies"], *project["optional-dependencies"]["plot"]]
    assert [line.replace("==", ">=") for line in lowest_versions()] == promised


def test_each_python_takes_the_wheel_that_was_compiled_for_it(tmp_path: Path) -> None:
    """One of another Python is not supported on this platform, as pip says."""
    for name in ("m-0.1.dev0-cp311-cp311-linux_x86_64.whl", "m-0.1.dev0-cp312-cp312-linux.whl"):
        (tmp_path / name).touch()
    (chosen,) = fitting_wheels(tmp_path, "cp312")
    assert chosen.name == "m-0.1.dev0-cp312-cp312-linux.whl"
    assert fitting_wheels(tmp_path, "cp313") == []
    (tmp_path / "m-0.1.dev0-py3-none-any.whl").touch()  # where nothing could be compiled
    assert len(fitting_wheels(tmp_path, "cp313")) == 1
