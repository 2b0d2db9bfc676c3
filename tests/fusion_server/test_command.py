"""What `mapweave server` refuses before it connects to anything."""

from pathlib import Path

import pytest

from mapweave.cli import main


def test_a_file_that_is_no_store_ends_the_command_with_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    diary = tmp_path / "diary.txt"
    diary.write_text("dear diary")
    assert main(["server", "--store", str(diary)]) == 1
    [line] = capsys.readouterr().err.splitlines()
    assert str(diary) in line
    assert diary.read_text() == "dear diary"


def test_a_team_that_is_no_id_ends_the_command_with_one_line(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["server", "--team", "No Team"]) == 1
    [line] = capsys.readouterr().err.splitlines()
    assert "team 'No Team'" in line


@pytest.mark.parametrize("interval", ["-1", "nan", "inf", "soon"])
def test_an_interval_that_is_none_is_wrong_usage(
    interval: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["server", "--min-interval", interval])
    assert ended.value.code == 2
    assert "_seconds" not in capsys.readouterr().err
