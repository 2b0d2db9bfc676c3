"""What an agent starts beside itself ends with it, whatever it computes."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

SCRIPT = """
import time
from mapweave_agent.worker import Worker, answer

def serve(pipe, argument):
    answer(pipe, 0, lambda asked: time.sleep(60))

if __name__ == "__main__":
    worker = Worker(serve, None)
    worker._pipe.send("something that takes long")
    print(worker.pid, flush=True)
    time.sleep(60)
"""
SOON = 2.0  # [s]; a comparison takes up to 8
PATIENCE = 30.0  # [s]


@pytest.fixture
def started(tmp_path: Path) -> tuple[subprocess.Popen[str], int]:
    """Return a process and the pid of its worker, which is busy for a minute."""
    script = tmp_path / "started.py"
    script.write_text(SCRIPT)
    process = subprocess.Popen(
        [sys.executable, script], stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    assert process.stdout is not None
    return process, int(process.stdout.readline())


def _is_alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state not in "ZX"


def test_a_worker_that_computes_does_not_outlive_a_parent_that_is_killed(
    started: tuple[subprocess.Popen[str], int],
) -> None:
    process, worker = started
    time.sleep(1.0)  # it is at work by now
    assert _is_alive(worker)
    process.kill()
    process.wait()
    ended = time.monotonic()
    while _is_alive(worker) and time.monotonic() < ended + PATIENCE:
        time.sleep(0.02)
    assert not _is_alive(worker)
    assert process.stdout is not None
    process.stdout.close()


@pytest.mark.parametrize("after", [0.0, 0.05, 0.2])
def test_ctrl_c_while_a_worker_is_being_started_leaves_no_trace_of_it(
    tmp_path: Path, after: float
) -> None:
    script = tmp_path / "started.py"
    script.write_text(SCRIPT.replace("worker = ", "print('begins', flush=True); worker = "))
    process = subprocess.Popen(
        [sys.executable, script],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "begins\n"
    time.sleep(after)
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate(timeout=PATIENCE)
    assert said.count("Traceback") <= 1, said
    assert "spawn_main" not in said
