"""A plugin of pytest for ``make quick``: when the time is up, what has not begun is skipped."""

import os
import time

import pytest

from tools.quick import UNTIL


def pytest_runtest_setup() -> None:
    """Skip a test that would begin too late."""
    if time.time() > float(os.environ[UNTIL]):
        pytest.skip("the time is up; make test runs all")
