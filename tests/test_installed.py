"""What is tested by ``make test`` is the wheel, not the checkout."""

import os
import subprocess
import sys
import sysconfig
from importlib import import_module
from pathlib import Path

import pytest

PACKAGES = (
    "mapweave",
    "mapweave_protocol",
    "mapweave_ros",
    "mapweave_agent",
    "mapweave_fusion_server",
    "mapweave_deploy",
)
SITE = Path(sysconfig.get_path("purelib"))

pytestmark = pytest.mark.skipif(
    "MAPWEAVE_INSTALLED" not in os.environ, reason="make test and make matrix test the wheel"
)


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_is_the_installed_one(package: str) -> None:
    assert Path(str(import_module(package).__file__)).is_relative_to(SITE)


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_is_the_installed_one_in_programs_that_tests_start(package: str) -> None:
    program = f"import {package}; print({package}.__file__)"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert Path(done.stdout.strip()).is_relative_to(SITE)


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_tells_type_checkers_that_it_is_typed(package: str) -> None:
    assert (SITE / package / "py.typed").is_file()
