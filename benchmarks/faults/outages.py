"""Outages at random moments of a team's links, ended when its robots are parked: what is missing.

Two robots map the same rooms; one link, or several, or the router, fails before they have finished
and comes back after. What everybody had when it came back is to be everywhere 5 s later: maps and
alignments at the coordinator, maps at the peers, versions at a subscriber.
"""

import argparse
import random
import sqlite3
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.faults.trial import (
    COORDINATOR,
    SUBSCRIBER,
    Trial,
    TrialError,
    team_on_trial,
    two_in_the_same_rooms,
    until,
)
from benchmarks.tables import OUTPUT, format_table, write_json
from mapweave_protocol.link.inbox import Inbox, joint_status_reader, status_reader
from mapweave_protocol.link.session import open_session
from mapweave_protocol.link.subscriber import joint_maps
from mapweave_protocol.wire.keys import JOINT_STATUS, STATUS
from mapweave_protocol.wire.messages import JointStatusMessage, MapVersion, StatusMessage
from mapweave_protocol.wire.pairs import is_older, states_of

RATE, DRIVE = 4.0, 11.0  # times real time, and how long the robots then map [s]
SHORTEST, LONGEST = 1.0, 30.0  # [s] of an outage
AFTER = 5.0  # [s] after its end, when nothing may be missing
HOW = "severed", "silent", "router"


@dataclass(frozen=True)
class Outage:
    """What fails, and when.

    Attributes
    ----------
    links
        Which ones; all where the router does.
    how
        Connections are cut, or nothing passes, or the router is killed and started again.
    begin
        After the robots began to map [s].
    length
        At the least [s].
    """

    links: tuple[str, ...]
    how: str
    begin: float
    length: float

    @classmethod
    def drawn(cls, seed: int) -> "Outage":
        """Return the outage that `seed` determines."""
        draw = random.Random(seed)
        length = draw.uniform(SHORTEST, LONGEST)
        begin = max(0.5, DRIVE - draw.uniform(0.2, length))
        names = ["r1", "r2", COORDINATOR, SUBSCRIBER]
        links = tuple(draw.sample(names, draw.choice((1, 1, 2))))
        return cls(links, draw.choice(HOW), begin, length)


@dataclass
class Said:
    """What robots and coordinator have said last, heard at the router."""

    inbox: Inbox = field(default_factory=Inbox)
    robots: dict[str, StatusMessage] = field(default_factory=dict)
    coordinator: JointStatusMessage | None = None

    def hear(self) -> None:
        """Take in what has come."""
        robots, coordinators = status_reader(), joint_status_reader()
        while (arrival := self.inbox.get(0.0)) is not None:
            if robots.reads(arrival) and (status := robots.read(arrival)) is not None:
                self.robots[status.robot] = status
            elif coordinators.reads(arrival):
                self.coordinator = coordinators.read(arrival) or self.coordinator


@dataclass(frozen=True)
class There:
    """What there was when the links came back."""

    maps: tuple[MapVersion, ...]
    alignments: tuple[tuple[MapVersion, MapVersion], ...]
    version: int

    @classmethod
    def is_on_disk_of(cls, trial: Trial) -> "There":
        """Return what robots and coordinator of a trial have on disk."""
        runs = [run for robot in trial.plan.robots for run in trial.kept(robot)]
        found = [(each.reference, each.other) for run in runs for each in run.found]
        return cls(tuple(run.state for run in runs), tuple(found), latest_version(trial.plan.store))


def latest_version(store: Path) -> int:
    """Return the latest version in a store that is in use."""
    with sqlite3.connect(f"file:{store}?mode=ro", uri=True) as connection:
        [(number,)] = connection.execute("SELECT coalesce(max(number), 0) FROM version")
    return int(number)


def missing(there: There, said: Said, delivered: list[int]) -> Iterator[str]:
    """Yield what is not where it should be, in words."""
    holds = said.coordinator
    for state in there.maps:
        if holds is None or state not in holds.maps:
            yield f"map of {state.robot} at the coordinator"
        for robot, status in said.robots.items():
            if robot != state.robot and state not in status.holds:
                yield f"map of {state.robot} at {robot}"
    held = [] if holds is None else holds.alignments
    for ends in there.alignments:
        same = [each for each in held if states_of(each).keys() == states_of(ends).keys()]
        if not same or is_older(same[0], ends):
            yield "alignment at the coordinator"
    if max(delivered, default=0) < there.version:
        yield f"versions {max(delivered, default=0) + 1} to {there.version} at the subscriber"
    if delivered != list(range(1, len(delivered) + 1)):
        yield f"order of the versions at the subscriber: {delivered}"


def try_out(seed: int, folder: Path) -> tuple[Outage, list[str]]:
    """Run a team through the outage of a seed; return what was missing in the end."""
    outage = Outage.drawn(seed)
    with (
        team_on_trial(folder, two_in_the_same_rooms(), f"{RATE:g}") as trial,
        _subscriber(trial) as delivered,
        _hearing(trial) as said,
    ):
        trial.start_coordinator()
        until(lambda: trial.says("server", "coordinating"), "a coordinator")
        for robot in trial.plan.robots:
            trial.start_robot(robot)
        until(lambda: all(map(trial.kept, trial.plan.robots)), "robots that map")
        time.sleep(outage.begin)
        with _failing(trial, outage):
            time.sleep(outage.length)
            for robot in trial.plan.robots:
                until(_finished(trial, robot), f"{robot} to park")
        there = There.is_on_disk_of(trial)
        time.sleep(AFTER)
        said.hear()
        return outage, list(missing(there, said, delivered))


def _finished(trial: Trial, robot: str) -> Callable[[], bool]:
    return lambda: trial.says(f"agent-{robot}", "finished:")


@contextmanager
def _failing(trial: Trial, outage: Outage) -> Iterator[None]:
    if outage.how == "router":
        trial.end("router", kill=True)
        yield
        trial.start_router()
        return
    links = [trial.links[name] for name in outage.links]
    for link in links:
        (link.silence if outage.how == "silent" else link.sever)()
    yield
    for link in links:
        link.restore()


@contextmanager
def _subscriber(trial: Trial) -> Iterator[list[int]]:
    """Give the versions that a subscriber gets, as they come."""
    delivered: list[int] = []
    over = threading.Event()
    with ThreadPoolExecutor(1) as thread:
        done = thread.submit(_collect, trial, delivered, over)
        try:
            yield delivered
        finally:
            over.set()
            done.result()


def _collect(trial: Trial, delivered: list[int], over: threading.Event) -> None:
    endpoint = trial.links[SUBSCRIBER].endpoint
    versions = joint_maps(trial.plan.team, connect=[endpoint], stopping=over.is_set)
    delivered.extend(joint.version for joint in versions)


@contextmanager
def _hearing(trial: Trial) -> Iterator[Said]:
    said, team = Said(), trial.plan.team
    with (
        open_session([trial.plan.listen], patience=60.0) as session,
        session.declare_subscriber(STATUS.pattern(team=team), said.inbox.put),
        session.declare_subscriber(JOINT_STATUS.build(team=team), said.inbox.put),
    ):
        yield said


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which outages."""
    parser.add_argument("--seeds", type=int, default=50, metavar="N", help="how many (50)")
    parser.add_argument("--first", type=int, default=1, metavar="N", help="the first one (1)")
    parser.add_argument("--at-once", type=int, default=2, metavar="N", help="in parallel (2)")
    parser.add_argument("--output", type=Path, default=OUTPUT / "outages", help="folder")


def run(options: argparse.Namespace) -> None:
    """Try all outages, print what was missing after each; fail if anything was."""
    seeds = range(options.first, options.first + options.seeds)
    with ThreadPoolExecutor(options.at_once) as threads:
        results = list(threads.map(_try, seeds))
    rows = [
        [str(seed), outage.how, ", ".join(outage.links), f"{outage.begin:.1f}",
         f"{outage.length:.1f}", "; ".join(lacks) or "nothing"]
        for seed, (outage, lacks) in zip(seeds, results, strict=True)
    ]  # fmt: skip
    whole = sum(not lacks for _, lacks in results)
    print(format_table(["seed", "how", "links", "begin s", "length s", "missing"], rows))
    print(f"nothing missing {AFTER:.0f} s after the return: {whole} of {len(results)}, bar: all")
    write_json(options.output / "outages.json", rows)
    if whole < len(results):
        sys.exit(1)


def _try(seed: int) -> tuple[Outage, list[str]]:
    with tempfile.TemporaryDirectory() as folder:
        try:
            result = try_out(seed, Path(folder))
        except TrialError as error:
            result = Outage.drawn(seed), [str(error)]
    print(f"seed {seed}: {'; '.join(result[1]) or 'nothing missing'}")
    return result
