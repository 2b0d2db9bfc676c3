"""Processes of a team: none outlives it, and who died is told in one line."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from mapweave_deploy.run.launcher import free_endpoint
from mapweave_deploy.run.processes import Child, ChildDiedError, ProcessGroup

DEADLINE = 20.0  # [s]


def start_router(crew: ProcessGroup, name: str = "router", stage: int = 0) -> Child:
    """Start a router, which runs until it is stopped, and wait until it does."""
    child = crew.start(name, stage, ["router", "--listen", free_endpoint()])
    until(lambda: "listening" in child.log.read_text())
    return child


def until(condition: Callable[[], bool]) -> None:
    """Wait for a condition; fail when it does not come about."""
    deadline = time.monotonic() + DEADLINE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def is_alive(pid: int) -> bool:
    """Return whether a process runs; one that ended but was not waited for does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_all_processes_have_ended_when_the_block_ends(tmp_path: Path) -> None:
    with ProcessGroup(tmp_path) as crew:
        children = [start_router(crew, name, stage) for stage, name in enumerate("abc")]
        crew.check()
    assert [child.process.poll() for child in children] == [0, 0, 0]


def test_all_processes_have_ended_when_the_block_fails(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="oh"), ProcessGroup(tmp_path) as crew:
        child = start_router(crew)
        raise RuntimeError("oh")
    assert child.process.poll() is not None


def test_higher_stages_are_stopped_without_the_lower_ones(tmp_path: Path) -> None:
    with ProcessGroup(tmp_path) as crew:
        low, high = start_router(crew, "low", 0), start_router(crew, "high", 1)
        crew.stop(lowest_stage=1)
        assert high.process.poll() == 0
        assert low.process.poll() is None
        crew.check()


def test_who_is_nicer_gives_way_with_all_it_starts(tmp_path: Path) -> None:
    with ProcessGroup(tmp_path) as crew:
        child = crew.start("router", 0, ["router", "--listen", free_endpoint()], niceness=3)
        until(lambda: "listening" in child.log.read_text())
        threads = [int(each.name) for each in Path(f"/proc/{child.process.pid}/task").iterdir()]
        nicer = os.getpriority(os.PRIO_PROCESS, 0) + 3
        assert {os.getpriority(os.PRIO_PROCESS, thread) for thread in threads} == {nicer}


def test_a_killed_process_is_told_by_its_name_and_signal(tmp_path: Path) -> None:
    with ProcessGroup(tmp_path) as crew:
        child = start_router(crew, "agent r2")
        child.process.kill()
        child.process.wait()
        with pytest.raises(ChildDiedError, match=r"agent r2 was killed by SIGKILL.*listening"):
            crew.check()


def test_of_processes_that_are_not_needed_it_is_told_once_how_they_ended(tmp_path: Path) -> None:
    with ProcessGroup(tmp_path) as crew:
        start_router(crew)
        words = ["router", "--listen", "nonsense"]
        lost = crew.start("agent r2", 2, words, needed=False)
        lost.process.wait()
        crew.check()
        (told,) = crew.take_lost()
        assert (told.name, told.status) == ("agent r2", 1)
        assert crew.take_lost() == []


def test_a_failed_process_is_told_with_its_last_words(tmp_path: Path) -> None:
    with ProcessGroup(tmp_path) as crew:
        child = crew.start("router", 0, ["router", "--listen", "nonsense"])
        child.process.wait()
        with pytest.raises(ChildDiedError, match=r"router ended \(1\).*endpoint nonsense") as told:
            crew.check()
        assert "\n" not in str(told.value)


def test_a_process_that_does_not_stop_is_killed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mapweave_deploy.run.processes.GRACE", 0.1)
    with ProcessGroup(tmp_path) as crew:
        child = start_router(crew)
        os.kill(child.process.pid, signal.SIGSTOP)  # it cannot take SIGTERM
    assert child.process.poll() == -signal.SIGKILL


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel's death signal is Linux's")
def test_processes_die_with_a_launcher_that_is_killed(tmp_path: Path) -> None:
    script = (
        "import sys, time; from pathlib import Path\n"
        "from mapweave_deploy.run.processes import ProcessGroup\n"
        "from mapweave_deploy.run.launcher import free_endpoint\n"
        f"crew = ProcessGroup(Path({str(tmp_path)!r}))\n"
        "child = crew.start('router', 0, ['router', '--listen', free_endpoint()])\n"
        "while 'listening' not in child.log.read_text(): time.sleep(0.02)\n"
        "print(child.process.pid, flush=True); time.sleep(60)\n"
    )
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE) as launcher:
        assert launcher.stdout is not None
        child = int(launcher.stdout.readline())
        assert is_alive(child)
        launcher.kill()
    until(lambda: not is_alive(child))
