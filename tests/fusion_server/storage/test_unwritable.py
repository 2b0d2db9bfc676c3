"""What may not be read or written is told at once, in one line; to look at it is no writing."""

import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

import pytest

from mapweave.cli import main
from mapweave.errors import FileError
from mapweave.maps import JointMap
from mapweave_fusion_server.storage.view import StoreView
from mapweave_fusion_server.store import Store
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import JointMapMessage

MAPWEAVE = Path(sys.executable).with_name("mapweave")
NOT_ALMIGHTY = (  # an administrator without what lets him pass over the rights of files
    "setpriv",
    "--bounding-set=-dac_override,-dac_read_search",
    "--inh-caps=-dac_override,-dac_read_search",
)
Run: TypeAlias = Callable[..., tuple[int, list[str]]]


@pytest.fixture
def run() -> Run:
    """Return what runs a command as somebody whom the rights of files stop."""
    prefix = NOT_ALMIGHTY if os.geteuid() == 0 else ()
    if prefix and shutil.which(prefix[0]) is None:
        pytest.skip("no setpriv here, without which rights of files stop no administrator")

    def run(*words: str | Path) -> tuple[int, list[str]]:
        done = subprocess.run(
            [*prefix, MAPWEAVE, *words], capture_output=True, text=True, check=False, timeout=60
        )
        return done.returncode, done.stderr.splitlines()

    return run


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Return a store with one version, in a folder of its own."""
    file = tmp_path / "kept" / "store.sqlite"
    file.parent.mkdir()
    with Store(file, "team") as store:
        store.add_version(1, 1.0, encode(JointMapMessage.pack(JointMap(1, (), ()), store.series)))
    return file


@pytest.mark.parametrize(
    ("folder_mode", "mode", "problem"),
    [
        (0o755, 0o444, "the store cannot be written: Permission denied"),
        (0o755, 0o000, "the store cannot be read: Permission denied"),
        (0o555, 0o644, "the store cannot be written: "),
    ],
    ids=["read only", "of somebody else", "in a folder that is read only"],
)
def test_a_coordinator_says_in_one_line_that_it_may_not_use_its_store(
    run: Run, path: Path, folder_mode: int, mode: int, problem: str
) -> None:
    path.chmod(mode)
    path.parent.chmod(folder_mode)
    try:
        status, said = run("server", "--store", path)
    finally:
        path.parent.chmod(0o755)
    assert status == 1
    [line] = said
    assert line.startswith(f"mapweave: {path}: {problem}")


def test_a_new_store_where_none_can_be_made_is_told_in_one_line(run: Run, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "closed").mkdir(0o555)
    for place in ("file/store", "closed/store", "nowhere/store"):
        status, said = run("server", "--store", tmp_path / place)
        [line] = said
        assert status == 1
        assert line.startswith(f"mapweave: {tmp_path / place}: the store cannot be ")


def test_what_is_no_file_is_neither_waited_for_nor_replaced(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(tmp_path / "socket"))
        for path in (tmp_path, tmp_path / "pipe", tmp_path / "socket", Path("/dev/null")):
            with pytest.raises(FileError, match="not a file"):
                Store(path, "team")
    assert Path("/dev/null").is_char_device()


def test_a_store_is_looked_at_where_nothing_may_be_written(run: Run, path: Path) -> None:
    path.parent.chmod(0o555)
    try:
        for words in (["check"], ["history"], ["show", "latest"]):
            assert run(*words, "--store", path) == (0, [])
    finally:
        path.parent.chmod(0o755)


def test_a_store_with_a_journal_that_cannot_be_read_there_is_told_so(
    run: Run, path: Path, tmp_path: Path
) -> None:
    medium = tmp_path / "medium"
    medium.mkdir()
    with Store(path, "team") as store:
        store.add_version(2, 2.0, store.version(1) or b"")
        for ending in ("", "-wal"):
            shutil.copy(f"{path}{ending}", medium)
    medium.chmod(0o555)
    try:
        status, [line] = run("history", "--store", medium / path.name)
    finally:
        medium.chmod(0o755)
    assert status == 1
    assert line.endswith(
        "its journal cannot be read where nothing may be written; copy both elsewhere"
    )
    with StoreView(medium / path.name) as view:
        assert view.numbers == (1, 2)


def test_keys_of_somebody_else_are_told_in_one_line(run: Run, tmp_path: Path) -> None:
    assert main(["keys", "team", "--robots", "r1", "--output", str(tmp_path / "keys")]) == 0
    folder = tmp_path / "keys" / "coordinator"
    (folder / "key.pem").chmod(0o000)
    status, said = run("server", "--store", tmp_path / "store.sqlite", "--tls", folder)
    assert status == 1
    assert said == [f"mapweave: {folder / 'key.pem'}: may not be read by who runs this program"]
    assert not (tmp_path / "store.sqlite").exists()
