"""A team as real processes, each with a link of its own that can fail."""

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.faults.relay import Relay
from mapweave.maps import RobotMap
from mapweave_agent.past_runs import PastRun, StateFolder
from mapweave_deploy.run.launcher import (
    Plan,
    free_endpoint,
    start_agent,
    start_router,
    start_server,
)
from mapweave_deploy.run.processes import Child, ProcessGroup
from mapweave_deploy.run.team_plan import Member

CASE = Path(__file__).parents[2] / "tests" / "cases" / "restart_same_id"
COORDINATOR = "coordinator"
SUBSCRIBER = "subscriber"
PATIENCE = 900.0  # [s] for a machine with much else to do
POLL = 0.05  # [s]


class TrialError(Exception):
    """Something that did not come about in time."""


def two_in_the_same_rooms(scans: tuple[int, int] = (0, 55)) -> list[Member]:
    """Return two robots, with short logs, that can be joined."""
    nothing = np.empty(0, dtype=np.int64)
    return [
        Member(robot, CASE / f"{robot}.log.gz", scans, "rooms", nothing, np.empty((0, 3)))
        for robot in ("r1", "r2")
    ]


@dataclass
class Trial:
    """A team that runs.

    Attributes
    ----------
    plan
        Its router listens there.
    links
        By robot, of the coordinator, and of a subscriber.
    crew
        Its processes.
    """

    plan: Plan
    links: dict[str, Relay]
    crew: ProcessGroup
    folder: Path

    def start_router(self) -> None:
        """Start the router, at the endpoint it had."""
        start_router(self.crew, self.plan)

    def start_coordinator(self) -> None:
        """Start the coordinator on its store."""
        start_server(self.crew, self._over(COORDINATOR), self.plan.store)

    def start_robot(self, robot: str, first: int = 0) -> None:
        """Start a robot's agent, at the scan `first` of its part of the log, or the last of it.

        Who has mapped all of it may have delivered not all of it.
        """
        member = next(each for each in self.plan.members if each.robot == robot)
        begin, behind = member.scans
        scans = min(max(first, begin), behind - 1), behind
        start_agent(self.crew, self._over(robot), replace(member, scans=scans))

    def child(self, name: str) -> Child:
        """Return the process of that name, such as ``agent r1``."""
        return next(each for each in self.crew.children if each.name == name)

    def end(self, name: str, *, kill: bool) -> None:
        """Kill a process, or tell it to end and wait until it has."""
        ending = self.child(name)
        if kill:
            ending.kill()
        else:
            ending.terminate()
            ending.process.wait(PATIENCE)
        self.crew.children.remove(ending)

    def says(self, process: str, words: str) -> bool:
        """Tell whether a process has said some words."""
        log = self.folder / f"{process}.log"
        return log.exists() and words in log.read_text(errors="replace")

    def kept(self, robot: str) -> list[PastRun]:
        """Return a robot's runs on disk, the earliest first."""
        return StateFolder(self.plan.states / robot).runs(robot, time.time())

    def _over(self, name: str) -> Plan:
        """Return the plan of a process that has a link of its own."""
        return replace(self.plan, listen=self.links[name].endpoint) if self.links else self.plan


@contextmanager
def team_on_trial(
    folder: Path, members: list[Member], rate: str, *, delay: float = 0.0, loss: float = 0.0
) -> Iterator[Trial]:
    """Give a team whose router runs, everybody else with a link to it."""
    listen, store = free_endpoint(), folder / "store.sqlite"
    plan = Plan("t", members, rate, listen, store, folder / "states", None)
    with ExitStack() as stack:
        crew = stack.enter_context(ProcessGroup(folder))
        names = [COORDINATOR, SUBSCRIBER, *plan.robots]
        links = {
            name: stack.enter_context(Relay(listen, delay=delay, loss=loss, seed=seed))
            for seed, name in enumerate(names)
        }
        trial = Trial(plan, links, crew, folder)
        trial.start_router()
        yield trial


def until(condition: Callable[[], object], what: str) -> None:
    """Wait for a condition.

    Raises
    ------
    TrialError
        If it does not come about.
    """
    deadline = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > deadline:
            raise TrialError(f"not within {PATIENCE:.0f} s: {what}")
        time.sleep(POLL)


def last_scan(robot_map: RobotMap) -> int:
    """Return the index of the last scan in a map, -1 where there is none."""
    indices = [s.trajectory.scan_index for s in robot_map.submaps if len(s.trajectory.scan_index)]
    return max((int(index[-1]) for index in indices), default=-1)
