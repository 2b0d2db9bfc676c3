"""The processes of a team: started, watched, and stopped without leaving one behind."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from mapweave.errors import MapweaveError

GRACE = 20.0  # [s] to stop; the coordinator publishes its last version then
TOLD_LINES = 3  # of a dead process's log


class ChildDiedError(MapweaveError):
    """A process of the team that ended while it was needed.

    Parameters
    ----------
    name
        Such as ``agent r2``.
    status
        Its exit status; negative: the signal that killed it.
    log
        What it wrote.
    """

    def __init__(self, name: str, status: int, log: Path) -> None:
        how = f"was killed by {signal.Signals(-status).name}" if status < 0 else f"ended ({status})"
        said = " | ".join(last_lines(log, TOLD_LINES)) or "it wrote nothing"
        super().__init__(f"{name} {how}; its last words: {said} (all: {log})")
        self.name = name
        self.status = status
        self.log = log


@dataclass(frozen=True, slots=True)
class Child:
    """A process; those of a higher stage are stopped before those of a lower one.

    Without one that is `needed`, the others cannot go on.
    """

    name: str
    stage: int
    process: subprocess.Popen[bytes]
    log: Path
    needed: bool = True

    @property
    def death(self) -> ChildDiedError | None:
        """How it ended; None while it runs."""
        status = self.process.poll()
        return None if status is None else ChildDiedError(self.name, status, self.log)

    def terminate(self) -> None:
        """Ask it to stop; what it has started is its own business."""
        self.process.terminate()

    def kill(self) -> None:
        """Kill it and what it has started, also where it is gone itself already."""
        with suppress(ProcessLookupError):  # nobody is left
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()


class ProcessGroup:
    """Processes that end with the ``with`` block, however that ends.

    Parameters
    ----------
    logs
        Folder for what each one writes.
    """

    def __init__(self, logs: Path) -> None:
        self.children: list[Child] = []
        self._logs = logs

    def start(
        self,
        name: str,
        stage: int,
        arguments: Sequence[str],
        environment: Mapping[str, str] | None = None,
        niceness: int = 0,
        *,
        needed: bool = True,
    ) -> Child:
        """Start ``mapweave`` with `arguments` as a process of its own, so much nicer than this one.

        It gets a process group of its own too: a Ctrl-C at the terminal reaches the launcher only,
        which stops the others in their order.
        """
        log = self._logs / f"{name.replace(' ', '-')}.log"
        leash = [sys.executable, "-m", "mapweave_deploy.run.parent_death", str(os.getpid())]
        with log.open("ab") as output:
            process = subprocess.Popen(
                [*leash, *arguments],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                process_group=0,
                env={**os.environ, **(environment or {})},
            )
        if niceness:
            own = os.getpriority(os.PRIO_PROCESS, 0)
            os.setpriority(os.PRIO_PROCESS, process.pid, own + niceness)
        child = Child(name, stage, process, log, needed)
        self.children.append(child)
        return child

    def check(self) -> None:
        """Raise ChildDiedError if a process has ended that is needed."""
        for child in self.children:
            if child.needed and (death := child.death) is not None:
                raise death

    def take_lost(self) -> list[ChildDiedError]:
        """Return how processes ended that are not needed, once each; nothing they started stays."""
        lost = []
        for child in list(self.children):
            if not child.needed and (death := child.death) is not None:
                lost.append(death)
                child.kill()
                self.children.remove(child)
        return lost

    def stop(self, lowest_stage: int = 0) -> None:
        """Stop the processes from `lowest_stage` up, the highest stage first."""
        for stage in sorted({child.stage for child in self.children}, reverse=True):
            if stage >= lowest_stage:
                self._stop_stage([c for c in self.children if c.stage == stage])
        self.children = [child for child in self.children if child.stage < lowest_stage]

    def _stop_stage(self, children: list[Child]) -> None:
        for child in children:
            child.terminate()
        deadline = time.monotonic() + GRACE
        for child in children:
            try:
                child.process.wait(max(0.0, deadline - time.monotonic()))
            except subprocess.TimeoutExpired:
                child.kill()

    def __enter__(self) -> "ProcessGroup":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        children = list(self.children)
        try:
            self.stop()
        finally:
            # What is left of them, and all of them on a second Ctrl-C.
            for child in children:
                child.kill()


def last_lines(path: Path, count: int) -> list[str]:
    """Return the last `count` lines of a text file that say something."""
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    return [line.strip() for line in lines if line.strip(" ^~")][-count:]
