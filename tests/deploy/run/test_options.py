"""What `mapweave team` refuses before it starts anything."""

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
