"""Whenever the process ends, and whatever the disk kept of it, the store opens and is right."""

import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from mapweave_fusion_server.store import Store

WRITER = """
import sys
from pathlib import Path
from mapweave_fusion_server.store import Store
with Store(Path(sys.argv[1]), "rescue") as store:
    while True:
        number = store.latest_version + 1
        store.keep_map(("a", "x"), 0, float(number), b"map" * number)
        store.add_version(number, float(number), str(number).encode() * 1000)
        print(store.series, number, flush=True)
"""
MAKER = """
import sys
from pathlib import Path
from mapweave_fusion_server.store import Store
path = Path(sys.argv[1])
print("begins", flush=True)
while True:
    path.unlink(missing_ok=True)
    Store(path, "rescue").__exit__(None, None, None)
"""


def _run_and_kill(script: str, path: Path, seconds: float) -> list[str]:
    """Run `script`, kill it so long after its first line, and return its lines."""
    process = subprocess.Popen(
        [sys.executable, "-c", script, str(path)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    lines = [process.stdout.readline()]
    assert lines[0], "it never began"
    time.sleep(seconds)
    process.send_signal(signal.SIGKILL)
    lines += process.stdout.readlines()
    process.stdout.close()
    process.wait()
    return [line for line in lines if line.endswith("\n")]


def _kill_while_writing(path: Path, times: int) -> None:
    chance = random.Random(1)
    for _ in range(times):
        series, number = _run_and_kill(WRITER, path, chance.uniform(0, 0.05))[-1].split()
        with Store(path, "rescue") as store:
            assert store.series == series
            assert store.latest_version >= int(number)
            assert store.version(int(number)) == number.encode() * 1000
            assert store.map_of("a") is not None
            assert store.damaged == 0


def test_a_version_that_was_told_is_there_after_a_kill_at_any_instant(tmp_path: Path) -> None:
    _kill_while_writing(tmp_path / "store.sqlite", 6)


@pytest.mark.slow
def test_a_hundred_kills_while_writing_lose_nothing_that_was_told(tmp_path: Path) -> None:
    _kill_while_writing(tmp_path / "store.sqlite", 100)


def test_what_a_kill_leaves_of_a_new_store_is_accepted(tmp_path: Path) -> None:
    chance = random.Random(2)
    for _ in range(8):
        _run_and_kill(MAKER, tmp_path / "store.sqlite", chance.uniform(0, 0.02))
        with Store(tmp_path / "store.sqlite", "rescue") as store:
            store.add_version(store.latest_version + 1, 0.0, b"version")


def _with_journal(folder: Path) -> tuple[Path, dict[int, bytes]]:
    """Return a store as a loss of power leaves it, nothing of its journal moved yet."""
    path, messages = folder / "store.sqlite", {}
    with Store(path, "rescue") as store:
        for number in range(1, 31):
            messages[number] = random.Random(number).randbytes(9000)
            store.add_version(number, float(number), messages[number])
            store.keep_map(("a", "x"), 0, float(number), messages[number])
        for ending in ("", "-wal"):
            shutil.copy(f"{path}{ending}", folder / f"crashed.sqlite{ending}")
    return folder / "crashed.sqlite", messages


def test_a_journal_cut_at_any_byte_leaves_a_store_of_whole_versions(tmp_path: Path) -> None:
    crashed, messages = _with_journal(tmp_path)
    journal = Path(f"{crashed}-wal").read_bytes()
    assert len(journal) > 30 * 9000
    chance, reached = random.Random(3), set()
    for number in range(100):
        copy = tmp_path / f"{number}.sqlite"
        shutil.copy(crashed, copy)
        Path(f"{copy}-wal").write_bytes(journal[: chance.randrange(len(journal) + 1)])
        with Store(copy, "rescue") as store:
            latest = store.latest_version
            reached.add(latest)
            assert [store.version(n) for n in range(1, latest + 1)] == [
                messages[n] for n in range(1, latest + 1)
            ]
            store.add_version(latest + 1, 0.0, b"the next one")
    assert len(reached) > 20


def test_a_journal_with_any_byte_wrong_leaves_a_store_of_whole_versions(tmp_path: Path) -> None:
    crashed, messages = _with_journal(tmp_path)
    journal = Path(f"{crashed}-wal").read_bytes()
    chance = random.Random(4)
    for number in range(50):
        copy, damaged = tmp_path / f"{number}.sqlite", bytearray(journal)
        damaged[chance.randrange(len(journal))] ^= 1 << chance.randrange(8)
        shutil.copy(crashed, copy)
        Path(f"{copy}-wal").write_bytes(damaged)
        with Store(copy, "rescue") as store:
            for version in range(1, store.latest_version + 1):
                assert store.version(version) in (messages[version], None)


def test_each_version_waits_for_the_disk_and_a_map_does_not(tmp_path: Path) -> None:
    with Store(tmp_path / "store.sqlite", "rescue") as store:
        asked: list[str] = []
        store._database._connection.set_trace_callback(asked.append)
        store.keep_map(("a", "x"), 0, 1.0, b"map")
        before, asked[:] = list(asked), []
        store.add_version(1, 2.0, b"version")
    assert [sql for sql in before if "synchronous" in sql] == ["PRAGMA synchronous = NORMAL"]
    assert [sql for sql in asked if "synchronous" in sql] == ["PRAGMA synchronous = FULL"]
