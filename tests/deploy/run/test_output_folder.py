"""One team at a time runs into a folder."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from mapweave.cli import main
from mapweave.errors import FileError
from mapweave_deploy.run.output_folder import OutputFolder

HOLD = """
import sys, time
from pathlib import Path
from mapweave_deploy.run.output_folder import OutputFolder
with OutputFolder(Path(sys.argv[1])).taken():
    print("taken", flush=True)
    time.sleep(600)
"""


def contents(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_second_team_into_one_folder_is_refused_in_one_line_and_touches_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = OutputFolder(tmp_path / "same")
    with folder.taken():
        for path in (folder.logs / "server.log", folder.path / "store-new.sqlite"):
            path.write_text("of the first")
        before = contents(folder.path)
        alias = tmp_path / "alias"
        alias.symlink_to(folder.path)
        for name in (folder.path, alias):
            words = ["team", "--world", "arena", "--robots", "2", "--output", str(name)]
            assert main(words) == 1
            said = capsys.readouterr()
            expected = "in use by another mapweave team; expected another --output"
            assert said.err == f"mapweave: {name}: {expected}\n"
            assert said.out == ""
        assert contents(folder.path) == before


def test_a_folder_is_free_again_however_the_team_in_it_ended(tmp_path: Path) -> None:
    folder = OutputFolder(tmp_path)
    with pytest.raises(RuntimeError), folder.taken():
        raise RuntimeError
    command = [sys.executable, "-c", HOLD, str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as first:
        assert first.stdout is not None
        assert first.stdout.readline() == "taken\n"
        with pytest.raises(FileError, match="in use"), folder.taken():
            pass
        os.kill(first.pid, signal.SIGKILL)
        first.wait()
    with folder.taken():
        pass


def test_what_processes_of_an_earlier_team_wrote_goes(tmp_path: Path) -> None:
    folder = OutputFolder(tmp_path)
    with folder.taken():
        (folder.logs / "server.log").write_text("earlier")
    with folder.taken():
        assert list(folder.logs.iterdir()) == []


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with (
        pytest.raises(FileError, match=r"file/team: cannot be made a folder"),
        OutputFolder(tmp_path / "file" / "team").taken(),
    ):
        pass
