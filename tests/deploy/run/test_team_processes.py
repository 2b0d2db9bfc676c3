"""``mapweave team`` as a process: whatever ends it, it leaves no process behind."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from mapweave.io.map_files import read_joint
from mapweave_fusion_server.store import Store

PROGRAM = [sys.executable, "-c", "import sys; from mapweave.cli import main; sys.exit(main())"]
DEADLINE = 60.0  # [s], for a machine with much else to do

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs Linux's /proc")


@contextmanager
def running_team(folder: Path) -> Iterator[tuple["subprocess.Popen[str]", set[int]]]:
    """Run a team of two in real time, which takes minutes; give it and its process groups."""
    command = [*PROGRAM, "team", "--world", "arena", "--robots", "2", "--rate", "1"]
    with subprocess.Popen(
        [*command, "--output", str(folder)], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True,
    ) as team:  # fmt: skip
        try:
            until(lambda: len(_mapping(folder)) == 2)
            yield team, {pid for pid, (parent, _) in _processes().items() if parent == team.pid}
        finally:
            team.kill()


def until(condition: Callable[[], bool]) -> None:
    """Wait for a condition; fail when it does not come about."""
    deadline = time.monotonic() + DEADLINE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def _mapping(folder: Path) -> list[Path]:
    """Return the logs of the agents that have joined their team."""
    return [log for log in folder.glob("processes/agent-*.log") if "joins" in log.read_text()]


def _processes() -> dict[int, tuple[int, int]]:
    """Return of every process that runs its parent and its group."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            state, parent, group = (folder / "stat").read_text().rpartition(")")[2].split()[:3]
        except (FileNotFoundError, ProcessLookupError):
            continue
        if state != "Z":
            found[int(folder.name)] = int(parent), int(group)
    return found


def _nothing_left(groups: set[int]) -> bool:
    return not any(group in groups for _, group in _processes().values())


def _agent(robot: str, groups: set[int]) -> int:
    """Return the process of a robot."""
    [agent] = [
        pid for pid in groups if f"--robot\0{robot}\0" in Path(f"/proc/{pid}/cmdline").read_text()
    ]
    return agent


def test_of_a_killed_agent_it_is_told_at_once_and_the_last_one_ends_the_team_by_name(
    tmp_path: Path,
) -> None:
    with running_team(tmp_path) as (team, groups):
        assert len(groups) == 4  # router, coordinator, two agents
        assert team.stdout is not None
        first, last = (_agent(robot, groups) for robot in ("r2", "r1"))
        os.kill(first, signal.SIGKILL)
        told = next(line for line in team.stdout if line.startswith("agent"))
        assert re.fullmatch(r"agent r2 was killed by SIGKILL;.*; the others go on\n", told)
        assert team.poll() is None
        os.kill(last, signal.SIGKILL)
        assert team.wait(DEADLINE) == 1
        assert team.stderr is not None
        assert re.fullmatch(r"mapweave: agent r1 was killed by SIGKILL.*\n", team.stderr.read())
    until(lambda: _nothing_left(groups))


def test_a_team_that_is_stopped_keeps_what_it_has_and_says_where(tmp_path: Path) -> None:
    with running_team(tmp_path) as (team, _):
        assert team.stdout is not None
        assert any(line.startswith("joint map 1:") for line in team.stdout)
        for _ in range(3):  # shells tell it, then its group; people press twice
            team.send_signal(signal.SIGINT)
            time.sleep(0.2)
        assert team.wait(DEADLINE) == 130
        *_, last = team.stdout
    kept = re.fullmatch(
        r"Kept: the joint map so far, version (\d+): (.*/joint-so-far.json); the store: (.*)\n",
        last,
    )
    assert kept is not None
    assert read_joint(Path(kept[2])).version == int(kept[1])
    with Store(Path(kept[3]), "team") as store:
        assert store.latest_version == int(kept[1])


@pytest.mark.parametrize(
    "how", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)]
)
def test_interrupted_a_team_stops_all_processes_and_leaves_earlier_results(
    tmp_path: Path, how: signal.Signals
) -> None:
    results = [tmp_path / name for name in ("joint.json", "joint.png", "store.sqlite")]
    for result in results:
        result.write_text("earlier")
    with running_team(tmp_path) as (team, groups):
        team.send_signal(how)
        assert team.wait(DEADLINE) == 130
        assert team.stderr is not None
        assert team.stderr.read() == "mapweave: interrupted\n"
        assert _nothing_left(groups)
    assert not list(tmp_path.glob("store-new*"))
    assert [result.read_text() for result in results] == ["earlier"] * 3


@pytest.mark.slow
def test_a_killed_launcher_takes_all_processes_with_it(tmp_path: Path) -> None:
    with running_team(tmp_path) as (team, groups):
        team.kill()
    until(lambda: _nothing_left(groups))


def test_a_team_out_of_time_says_who_is_not_done(tmp_path: Path) -> None:
    for end in ("", "-journal", "-wal", "-shm"):  # as an earlier one that was killed left them
        (tmp_path / f"store-new.sqlite{end}").touch()
    command = [*PROGRAM, "team", "--world", "arena", "--robots", "2", "--rate", "1"]
    told = subprocess.run(
        [*command, "--timeout", "1", "--output", str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert told.returncode == 1
    expected = "mapweave: the team was not done within 1 s, still to come: r1, r2\n"
    assert told.stderr == expected
    assert not list(tmp_path.glob("store*"))


@pytest.mark.parametrize(
    ("arguments", "status", "expected"),
    [
        (["missing.log"], 1, r"mapweave: missing.log: no such file; expected .*\n"),
        (["--world", "office", "some.log"], 2, r"(?s).*expected either logs or --world\n"),
        ([], 2, r"(?s).*expected either logs or --world\n"),
        (["--world", "moon"], 2, r"(?s).*invalid choice: 'moon'.*\n"),
        (
            ["--world", "arena", "--robots", "0"],
            2,
            r"(?s).*'0': expected a whole number, 1 or more\n",
        ),
        (
            ["--world", "arena", "--seed", "x"],
            2,
            r"(?s).*'x': expected a whole number, 0 or more\n",
        ),
        (["--world", "arena", "--team", "A/B"], 1, r"mapweave: team 'A/B': expected .*\n"),
        (["--world", "arena", "--rate", "fast"], 2, r"(?s).*--rate.*'fast'.*\n"),
    ],
)
def test_wrong_arguments_are_told_before_anything_starts(
    tmp_path: Path, arguments: list[str], status: int, expected: str
) -> None:
    told = subprocess.run(
        [*PROGRAM, "team", *arguments], capture_output=True, text=True, cwd=tmp_path, check=False
    )
    assert told.returncode == status
    assert re.fullmatch(expected, told.stderr)
