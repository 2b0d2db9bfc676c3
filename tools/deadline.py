"""A plugin of pytest for ``make quick``: when the time is up, what has not begun is skipped."""

import time

import pytest

TIME = 30.0  # [s] from the first test of a process; `quick` chooses for less, on an idle machine


class Deadline:
    """Skips tests that would begin too late."""

    def __init__(self) -> None:
        self._end: float | None = None

    def pytest_runtest_setup(self) -> None:
        """Start the clock with the first test; skip those that come when it has run down."""
        self._end = self._end or time.monotonic() + TIME
        if time.monotonic() > self._end:
            pytest.skip("the time is up; make test runs all")


def pytest_configure(config: pytest.Config) -> None:
    """Give each process of pytest a clock of its own."""
    config.pluginmanager.register(Deadline())
