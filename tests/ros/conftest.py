"""A router process, teams and logs, as for agents."""

from tests.agent.conftest import _no_earlier_runs, endpoint, logs, team

__all__ = ["_no_earlier_runs", "endpoint", "logs", "team"]
