"""A router process, teams and logs, as for agents."""

import pytest

from tests.agent.conftest import _no_earlier_runs, endpoint, logs, team

__all__ = ["_no_earlier_runs", "endpoint", "logs", "team"]


@pytest.fixture(autouse=True)
def _patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have a slow machine not taken for a silent laser; tests of silence say otherwise."""
    monkeypatch.setattr("mapweave_ros.silence.SILENT", 600.0)
