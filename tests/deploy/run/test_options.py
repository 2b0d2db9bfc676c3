"""What `mapweave team` refuses before it starts anything."""

import sys
from pathlib import Path

import pytest

from mapweave.cli import main


@pytest.mark.parametrize(
    ("option", "value"),
    [
        *[("--listen", text) for text in ("foo", "udp/127.0.0.1:7", "tcp/127.0.0.1:0")],
        *[("--listen", text) for text in ("tcp/127.0.0.1:99999", "tcp/127.0.0.1")],
        ("--rate", "x"),
        ("--timeout", "0"),
        ("--robots", "none"),
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
