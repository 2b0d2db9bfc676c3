"""What starting the program costs, what an agent holds, and what the commit before took."""

import itertools
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from benchmarks.logs import Log, find_logs
from benchmarks.same_results import install_commit
from benchmarks.speed.rows import Report
from mapweave_deploy.run.launcher import AGENT, ROUTER, free_endpoint
from mapweave_deploy.run.processes import ProcessGroup

REPEATED = 5
FIRST_SCAN = """
import sys
import mapweave_agent.command
from mapweave.io.readers import read_scans
from mapweave.mapping.mapper import Mapper
Mapper().add(next(iter(read_scans(sys.argv[1]))))
"""
SAMPLED = 0.25  # [s] between two looks at an agent's memory
PATIENCE = 120.0  # [s] for an agent to play its log
IDLE = 8  # looks in a row that find an agent idle: it has nothing to do any more
FEW = 20  # scans that the commit before maps to tell its start from the rest
TICKS = os.sysconf("SC_CLK_TCK")  # of the kernel's clock, in a second


def measure_starts(report: Report, log: str) -> None:
    """Measure ``mapweave --help`` and an agent's way to its first scan, each in a process."""
    _keep_bytecode()
    row = report.time("start", "mapweave --help", _children("-m", "mapweave", "--help"))
    report.reach("mapweave --help", row.median, 250, "ms")
    report.time("start", "import mapweave", _children("-c", "import mapweave"))
    for found in find_logs([log]):
        words = "-c", FIRST_SCAN, str(found.path)
        row = report.time("start", "agent's imports, one scan", _children(*words))
        report.reach("tracking process, start to first scan", row.median, 600, "ms")


def _keep_bytecode() -> None:
    """Let processes keep the bytecode of what they import, as is usual, whatever is set here.

    Compiling all of it anew at each start takes longer than the rest of it, and 10 MB.
    """
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


def _children(*words: str) -> list[float]:
    _start(words)  # there is bytecode from now on
    return [_spent(lambda: _start(words)) for _ in range(REPEATED)]


def _start(words: tuple[str, ...]) -> None:
    subprocess.run([sys.executable, *words], check=True, capture_output=True)


def _spent(work: Callable[[], object]) -> float:
    """Return the processor time [s] of the processes that `work` starts and waits for."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    work()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measure_agent(report: Report, log: str, most: int) -> None:
    """Measure what an agent that maps `most` scans of `log` holds in memory, at the most."""
    if not Path("/proc/self/smaps_rollup").is_file():
        report.leave_out("an agent's memory", "there is no /proc/self/smaps_rollup here")
        return
    _keep_bytecode()
    for found in find_logs([log]):
        with tempfile.TemporaryDirectory() as folder, ProcessGroup(Path(folder)) as crew:
            largest, total = _hold(crew, found, most)
        report.reach("agent, largest process (PSS)", largest, 120, "MB")
        report.reach("agent, all processes (PSS)", total, 260, "MB")


def _hold(crew: ProcessGroup, log: Log, most: int) -> tuple[float, float]:
    """Return the most that one process, and all, of an agent hold [MB], until it is idle."""
    listen, end = free_endpoint(), time.monotonic() + PATIENCE
    crew.start("router", ROUTER, ["router", "--listen", listen])
    words = ["--robot", "r1", "--log", str(log.path), "--scans", f"0:{most}" if most else ":"]
    played = ["--rate", "max", "--team", "speed", "--connect", listen]
    agent = crew.start("agent r1", AGENT, ["agent", *words, *played]).process.pid
    largest = total = 0.0
    spent = idle = 0
    while time.monotonic() < end and idle < IDLE:
        time.sleep(SAMPLED)
        family = _family(agent)
        sizes = [_megabytes(pid) for pid in family]
        largest, total = max(largest, *sizes), max(total, sum(sizes))
        now = sum(map(_ticks, family))
        idle, spent = (idle + 1 if now - spent < 0.1 * SAMPLED * TICKS else 0), now
    return largest, total


def _family(pid: int) -> list[int]:
    """Return a process and all that it started."""
    tasks = Path(f"/proc/{pid}/task").glob("*/children")
    children = [int(child) for task in tasks for child in task.read_text().split()]
    return [pid, *itertools.chain.from_iterable(map(_family, children))]


def _megabytes(pid: int) -> float:
    """Return a process's share of the memory it maps [MB of 1e6 bytes]."""
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    (held,) = [line.split()[1] for line in lines if line.startswith("Pss:")]
    return int(held) * 1024 / 1e6


def _ticks(pid: int) -> int:
    """Return the processor time of a process [ticks of the kernel's clock]."""
    after_name = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return int(after_name[11]) + int(after_name[12])


def measure_before(report: Report, commit: str, log: str, most: int, now: float) -> None:
    """Measure ``mapweave map`` of `commit` on the same scans, which take `now` [ms] each."""
    for found in find_logs([log]):
        each = _mapping_of(commit, found, most)
        row = report.time("map, all included, start left out", f"{commit}, {most} scans", [each])
        report.reach(f"map, all included: {commit} / now", row.median / now, 20, at_least=True)


def _mapping_of(commit: str, log: Log, most: int) -> float:
    """Return what ``mapweave map`` of `commit` takes a scan, its start left out [s]."""
    with tempfile.TemporaryDirectory() as folder:
        tree = install_commit(commit, Path(folder))

        def spent(scans: int) -> float:
            words = "map", log.path, "--scans", f"0:{scans}", "--output", f"{folder}/map.json"
            return _spent(lambda: tree.run(*words))

        return (spent(most) - spent(FEW)) / (most - FEW)
