"""What `mapweave team` refuses before it starts anything."""

import socket
import sys
from pathlib import Path

import pytest

from mapweave.cli import main
from mapweave_fusion_server.store import Store


@pytest.mark.parametrize(
    ("option", "value"),
    [
        *[("--listen", text) for text in ("foo", "udp/127.0.0.1:7", "tcp/127.0.0.1:0")],
        *[("--listen", text) for text in ("tcp/127.0.0.1:99999", "tcp/127.0.0.1")],
        *[("--rate", text) for text in ("x", "1e-9", "1e9", "nan")],
        ("--timeout", "0"),
        *[("--robots", text) for text in ("none", "1000")],
    ],
)
def test_an_argument_that_is_none_is_wrong_usage_said_in_words(
    option: str, value: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["team", "--world", "arena", option, value])
    assert ended.value.code == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert option in said
    assert value in said
    assert "invalid _" not in said


def test_a_lidar_is_given_to_simulated_robots_only(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["team", "a.log", "--lidar", "urg"])
    assert ended.value.code == 2
    assert "--lidar is of simulated robots: expected --world" in capsys.readouterr().err


def test_a_picture_that_cannot_be_drawn_is_told_before_the_team_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert main(["team", "--world", "arena", "--output", str(tmp_path / "team")]) == 1
    assert "pip install 'mapweave[plot]'" in capsys.readouterr().err
    assert not (tmp_path / "team").exists()


def test_robots_of_several_logs_count_together(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["team", "a.log", "b.log", "--robots", "33"])
    assert ended.value.code == 2
    assert "--robots: 66 robots in all, expected 64 at most" in capsys.readouterr().err


@pytest.mark.parametrize(("option", "before"), [("--listen", "tcp/"), ("--http", "")])
def test_a_port_that_is_taken_is_told_before_the_team_runs(
    option: str, before: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        words = ["team", "--world", "arena", option, before + address]
        assert main([*words, "--output", str(tmp_path / "team")]) == 1
    told = capsys.readouterr()
    assert told.err == f"mapweave: {option}: {address}: Address already in use\n"
    assert told.out == ""
    assert not (tmp_path / "team").exists()


def test_a_log_that_is_none_is_told_before_all_else(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["team", "nope.log", "--output", str(tmp_path / "team")]) == 1
    told = capsys.readouterr()
    assert told.err.startswith("mapweave: nope.log: no such file")
    assert told.out == ""
    assert not (tmp_path / "team").exists()


def test_a_store_that_another_coordinator_has_is_told_before_the_team_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    store = tmp_path / "store.sqlite"
    with Store(store, "team"):
        words = ["team", "--world", "arena", "--store", str(store)]
        assert main([*words, "--output", str(tmp_path / "team")]) == 1
    told = capsys.readouterr()
    assert told.err == f"mapweave: {store}: in use by another mapweave server\n"
    assert told.out == ""
    assert not (tmp_path / "team").exists()
