"""How the launcher starts the processes of a team."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from mapweave_deploy.run.launcher import Plan, start_agent, start_server
from mapweave_deploy.run.processes import ProcessGroup
from mapweave_deploy.run.team_plan import Member


class Noted(ProcessGroup):
    """Starts nothing; notes what it was to start."""

    def __init__(self, logs: Path) -> None:
        super().__init__(logs)
        self.words: list[list[str]] = []

    def start(self, name: str, stage: int, arguments: Sequence[str]) -> None:  # type: ignore[override]  # nothing is started
        """Note the words."""
        self.words.append([name, str(stage), *arguments])


@pytest.mark.parametrize("config", [None, Path("robot.toml")])
def test_agents_and_coordinator_get_the_configuration_of_the_team(
    config: Path | None, tmp_path: Path
) -> None:
    member = Member(
        "r1", Path("log"), (0, 9), "here", np.empty(0, dtype=np.int64), np.empty((0, 3))
    )
    plan = Plan("t", [member], "max", "tcp/127.0.0.1:1", tmp_path / "store", tmp_path, None, config)
    crew = Noted(tmp_path)
    start_server(crew, plan, plan.store)
    start_agent(crew, plan, member)
    server, agent = crew.words
    assert (server[2], agent[2]) == ("server", "agent")
    for words in (server, agent):
        given = words[words.index("--config") + 1] if "--config" in words else None
        assert given == (None if config is None else "robot.toml")
