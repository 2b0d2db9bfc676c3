"""How the launcher starts the processes of a team."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from mapweave.errors import MapweaveError
from mapweave_deploy.run.display import Lines
from mapweave_deploy.run.launcher import Plan, run_team, start_agent, start_server, with_free_port
from mapweave_deploy.run.processes import ProcessGroup
from mapweave_deploy.run.team_plan import Member
from mapweave_fusion_server.web.address import TOKEN_VARIABLE, HttpAddress


class Noted(ProcessGroup):
    """Starts nothing; notes what it was to start."""

    def __init__(self, logs: Path) -> None:
        super().__init__(logs)
        self.words: list[list[str]] = []
        self.told: list[dict[str, str]] = []
        self.niceness: list[int] = []
        self.needed: list[bool] = []

    def start(  # type: ignore[override]  # nothing is started
        self,
        name: str,
        stage: int,
        arguments: Sequence[str],
        environment: Mapping[str, str] | None = None,
        niceness: int = 0,
        *,
        needed: bool = True,
    ) -> None:
        """Note the words, and what only the process itself is told."""
        self.words.append([name, str(stage), *arguments])
        self.told.append(dict(environment or {}))
        self.niceness.append(niceness)
        self.needed.append(needed)


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
    coordinator, robot = crew.niceness
    assert coordinator + 19 == robot, "on one machine robots give way to whom all wait for"
    assert crew.needed == [True, False], "a team goes on without a robot"
    server, agent = crew.words
    assert (server[2], agent[2]) == ("server", "agent")
    for words in (server, agent):
        given = words[words.index("--config") + 1] if "--config" in words else None
        assert given == (None if config is None else "robot.toml")


def test_the_coordinator_alone_serves_the_page_and_nobody_else_sees_the_token(
    tmp_path: Path,
) -> None:
    page = HttpAddress("127.0.0.1", 8080)
    plan = Plan(
        *("t", [], "max", "tcp/127.0.0.1:1", tmp_path / "store", tmp_path, None),
        page=page,
        token="secret",
    )
    crew = Noted(tmp_path)
    start_server(crew, plan, plan.store)
    (words,), (told,) = crew.words, crew.told
    assert words[words.index("--http") + 1] == "127.0.0.1:8080"
    assert told == {TOKEN_VARIABLE: "secret"}
    assert "secret" not in " ".join(words)


def test_a_port_is_chosen_once_so_that_the_page_comes_back_where_it_was() -> None:
    chosen = with_free_port(HttpAddress("127.0.0.1", 0))
    assert chosen.port > 0
    assert with_free_port(chosen) == chosen


def test_keys_that_a_robot_lacks_are_told_before_anything_starts(tmp_path: Path) -> None:
    member = Member(
        "r1", Path("log"), (0, 9), "here", np.empty(0, dtype=np.int64), np.empty((0, 3))
    )
    plan = Plan(
        *("t", [member], "max", "tls/127.0.0.1:1", tmp_path / "store", tmp_path, None),
        keys=tmp_path / "keys",
    )
    crew = Noted(tmp_path)
    with pytest.raises(MapweaveError, match=r"keys/robots/r1/ca.pem: missing"):
        run_team(crew, plan, Lines(Console()))
    assert crew.words == []
