"""A subscriber does not pay for the solver: what ``mapweave_protocol`` loads."""

import subprocess
import sys

import pytest

import mapweave_protocol


def loaded_by(code: str) -> set[str]:
    """Return the modules that a fresh interpreter has loaded after `code`."""
    told = subprocess.run(
        [sys.executable, "-c", f"{code}\nimport sys\nprint(*sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
    )
    return set(told.stdout.split())


def test_the_package_loads_nothing_until_a_name_is_used() -> None:
    assert loaded_by("import mapweave_protocol").isdisjoint({"zenoh", "numpy", "pydantic"})


def test_a_subscriber_loads_neither_solver_nor_geometry() -> None:
    loaded = loaded_by("from mapweave_protocol import joint_maps")
    assert "zenoh" in loaded
    assert loaded.isdisjoint({"gtsam", "scipy", "shapely", "matplotlib"})


def test_watching_loads_no_solver() -> None:
    loaded = loaded_by("import mapweave_protocol.narration.watch")
    assert loaded.isdisjoint({"gtsam", "scipy", "shapely", "matplotlib"})


def test_an_unknown_name_is_an_attribute_error_that_names_it() -> None:
    with pytest.raises(AttributeError, match="'mapweave_protocol' has no attribute 'nothing'"):
        getattr(mapweave_protocol, "nothing")  # noqa: B009
