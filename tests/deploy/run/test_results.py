"""What the launcher does once a team is done, or was stopped."""

from collections.abc import Callable
from pathlib import Path

import pytest

from mapweave.cli import main
from mapweave.maps import JointMap
from mapweave_deploy import command
from mapweave_deploy.run.display import Display
from mapweave_deploy.run.launcher import Plan, TeamOutcome
from mapweave_deploy.run.processes import ChildDiedError, ProcessGroup
from mapweave_deploy.run.recorder import Recorder

End = Callable[[Path], TeamOutcome]


@pytest.fixture
def happened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return what a team does after its end, in its order; no process runs."""
    order: list[str] = []
    monkeypatch.setattr(command, "simulated_team", lambda *_: [])
    for name in ("start_server", "_tell", "_stay"):
        monkeypatch.setattr(command, name, lambda *_, name=name: order.append(name))
    return order


def team_that(ends: End, folder: Path, monkeypatch: pytest.MonkeyPatch, *more: str) -> int:
    """Return the exit status of a team that came to what `ends` returns or raises."""

    def run_team(_crew: ProcessGroup, plan: Plan, _display: Display) -> TeamOutcome:
        plan.store.write_text("no store")
        return ends(folder / "processes")

    monkeypatch.setattr(command, "run_team", run_team)
    return main(["team", "--world", "arena", "--output", str(folder), *more])


def test_router_and_coordinator_serve_while_results_are_computed(
    happened: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    outcome = TeamOutcome(JointMap(1, (), ()), {}, Recorder())
    assert team_that(lambda _: outcome, tmp_path, monkeypatch, "--stay") == 0
    assert happened == ["start_server", "_tell", "_stay"]


def test_a_team_that_lost_a_robot_writes_its_results_and_fails_by_its_name(
    happened: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    outcome = TeamOutcome(JointMap(1, (), ()), {}, Recorder(), ["r2"])
    assert team_that(lambda _: outcome, tmp_path, monkeypatch) == 1
    assert happened == ["_tell"]
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("mapweave: agent r2 ended before the team was done")


def test_where_what_there_is_cannot_be_kept_both_are_told_why_and_what_stopped_the_team(
    happened: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def ends(logs: Path) -> TeamOutcome:
        log = logs / "server.log"
        log.write_text("no room\n")
        raise ChildDiedError("server", 1, log)

    assert team_that(ends, tmp_path, monkeypatch) == 1
    said = capsys.readouterr()
    assert "Nothing is kept: " in said.out
    assert said.err.startswith("mapweave: server ended (1); its last words: no room")
    assert happened == []
