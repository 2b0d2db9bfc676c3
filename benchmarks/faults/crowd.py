"""Twenty robots on one machine: is every update there, how late, and does memory stay as it is.

A router, a coordinator and the agents, as processes; the robots drive through one office, as long
as is asked for, in real time. All that they publish is heard at the router.
"""

import argparse
import sys
import tempfile
import threading
import time
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from queue import Empty, SimpleQueue

import numpy as np
import zenoh

from benchmarks.faults.outages import latest_version
from benchmarks.faults.trial import TrialError, until
from benchmarks.faults.usage import Usage
from benchmarks.tables import OUTPUT, format_table, write_json
from mapweave_deploy.run.launcher import (
    Plan,
    free_endpoint,
    start_agent,
    start_router,
    start_server,
)
from mapweave_deploy.run.processes import ProcessGroup
from mapweave_deploy.run.team_plan import Member
from mapweave_deploy.sim.lidar import LidarParameters, measure
from mapweave_deploy.sim.office import office
from mapweave_deploy.sim.simulation import scan_line
from mapweave_deploy.sim.trajectories import TourParameters, plan_tours
from mapweave_fusion_server.store import Store
from mapweave_protocol.link.inbox import (
    Arrival,
    joint_reader,
    joint_status_reader,
    map_reader,
    status_reader,
)
from mapweave_protocol.link.session import declare_subscriber, open_session
from mapweave_protocol.wire.keys import JOINT_MAP, JOINT_STATUS, MAP, STATUS
from mapweave_protocol.wire.messages import JointStatusMessage, StatusMessage

TEAM, STORE = "crowd", "store.sqlite"
SAMPLED = 2.0  # [s] between two looks at the processes
SKEW = 0.02  # [s] by which the coordinator may hear a map before we do
MOST_LATE = 2.0  # [s], the 99th percentile, from a map to a version of the joint map with it
MOST_GROWN = 0.1  # of memory, in the second half of the run; maps grow as long as robots drive
LEAST_GROWN = 16.0  # [MiB] that are nothing


@dataclass
class Heard:
    """What went over the router.

    Attributes
    ----------
    inbox
        What has arrived, and when [s since 1970].
    maps
        By robot, the versions of its map and when each came [s since 1970].
    versions
        When each version of the joint map came [s since 1970].
    robots, coordinator
        What each has said last.
    """

    inbox: SimpleQueue[tuple[Arrival, float]] = field(default_factory=SimpleQueue)
    maps: dict[str, dict[int, float]] = field(default_factory=dict)
    versions: dict[int, float] = field(default_factory=dict)
    robots: dict[str, StatusMessage] = field(default_factory=dict)
    coordinator: JointStatusMessage | None = None

    def put(self, sample: zenoh.Sample) -> None:
        """Take in what comes; when it came is noted before anything is made of it."""
        gone = sample.kind == zenoh.SampleKind.DELETE
        arrival = Arrival(str(sample.key_expr), sample.payload.to_bytes(), gone)
        self.inbox.put((arrival, time.time()))

    def hear(self, over: threading.Event) -> None:
        """Take in what comes until it is over."""
        maps, joints = map_reader(), joint_reader()
        statuses, coordinators = status_reader(), joint_status_reader()
        while not over.is_set():
            try:
                arrival, now = self.inbox.get(timeout=0.1)
            except Empty:
                continue
            if maps.reads(arrival) and (one := maps.read(arrival)) is not None:
                self.maps.setdefault(one.robot, {}).setdefault(one.version, now)
            elif joints.reads(arrival) and (joint := joints.read(arrival)) is not None:
                self.versions.setdefault(joint.version, now)
            elif statuses.reads(arrival) and (status := statuses.read(arrival)) is not None:
                self.robots[status.robot] = status
            elif coordinators.reads(arrival):
                self.coordinator = coordinators.read(arrival) or self.coordinator


def missed(heard: Heard, robots: Sequence[str], stored: int) -> Iterator[str]:
    """Yield what did not arrive, in words."""
    said = heard.coordinator
    held = {} if said is None else {each.robot: each.version for each in said.maps}
    for robot in robots:
        last = heard.robots[robot].map_version
        if held.get(robot) != last:
            yield f"{robot}: version {last} of its map, {held.get(robot)} at the coordinator"
        for peer in robots:
            holds = {each.robot: each.version for each in heard.robots[peer].holds}
            if peer != robot and holds.get(robot) != last:
                yield f"{robot}: version {last} of its map, {holds.get(robot)} at {peer}"
    if lacking := set(range(1, stored + 1)) - set(heard.versions):
        yield f"versions {sorted(lacking)} of the joint map never heard"


def delays(heard: Heard, begun: Sequence[float]) -> list[float]:
    """Return how long each map took until a version came that was begun after it [s].

    Parameters
    ----------
    begun
        When each version was begun [s since 1970], version 1 first.
    """
    found = []
    for came in (at for versions in heard.maps.values() for at in versions.values()):
        version = bisect_left(begun, came - SKEW) + 1
        if version in heard.versions:
            found.append(heard.versions[version] - came)
    return found


def took(heard: Heard, begun: Sequence[float]) -> list[float]:
    """Return how long each version that came took since it was `begun` [s], version 1 first."""
    versions = enumerate(begun, start=1)
    return [heard.versions[n] - at for n, at in versions if n in heard.versions]


def drive(folder: Path, robots: int, seconds: float) -> list[Member]:
    """Write logs of so many robots that drive through one office, and return the robots."""
    world, lidar = office(1), LidarParameters()
    tour = TourParameters(length=0.4 * seconds, candidates=2)
    tours = plan_tours(world, robots, tour, np.random.default_rng(1))
    nothing = np.empty(0, dtype=np.int64)
    team = []
    for number, way in enumerate(tours, start=1):
        rng, log = np.random.default_rng(number), folder / f"r{number}.log"
        poses = list(zip(way.stamp.tolist(), way.pose, strict=True))
        poses = [(stamp, pose) for stamp, pose in poses if stamp <= seconds]
        lines = (scan_line(measure(world, p, lidar, rng), stamp, lidar) for stamp, p in poses)
        log.write_text("".join(lines), encoding="ascii")
        scans = 0, len(poses)
        team.append(Member(f"r{number}", log, scans, "office", nothing, np.empty((0, 3))))
    return team


@contextmanager
def _hearing(plan: Plan) -> Iterator[Heard]:
    heard, over = Heard(), threading.Event()
    thread = threading.Thread(target=heard.hear, args=(over,))
    put, team = heard.put, plan.team
    with (
        open_session([plan.listen], patience=60.0) as session,
        declare_subscriber(session, MAP.pattern(team=team), put, history=64),
        declare_subscriber(session, JOINT_MAP.build(team=team), put, history=16),
        session.declare_subscriber(STATUS.pattern(team=team), put),
        session.declare_subscriber(JOINT_STATUS.build(team=team), put),
    ):
        thread.start()
        try:
            yield heard
        finally:
            over.set()
            thread.join()


def run_crowd(folder: Path, robots: int, seconds: float) -> tuple[Heard, Usage, list[str]]:
    """Run the team to its end; return what was heard of it, what it took, and what was missed."""
    store, listen = folder / STORE, free_endpoint()
    team = drive(folder, robots, seconds)
    plan = Plan(TEAM, team, "1", listen, store, folder / "states", None)
    usage = Usage()
    with ProcessGroup(folder) as crew:
        start_router(crew, plan)
        with _hearing(plan) as heard:
            start_server(crew, plan, store)
            log = folder / "server.log"
            until(lambda: log.exists() and "coordinating" in log.read_text(), "a coordinator")
            for member in team:
                start_agent(crew, plan, member)
            while not _parked(heard, plan.robots):
                crew.check()
                usage.look({child.name: child.process.pid for child in crew.children})
                time.sleep(SAMPLED)
            with suppress(TrialError):  # told by `missed`
                until(lambda: not list(missed(heard, plan.robots, latest_version(store))), "all")
            lacking = list(missed(heard, plan.robots, latest_version(store)))
    return heard, usage, lacking


def _parked(heard: Heard, robots: Sequence[str]) -> bool:
    said = [heard.robots.get(robot) for robot in robots]
    return all(status is not None and status.state == "finished" for status in said)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say how many, and how long."""
    parser.add_argument("--robots", type=int, default=20, metavar="N", help="how many (20)")
    parser.add_argument(
        "--seconds", type=float, default=600.0, metavar="S", help="of driving (600)"
    )
    parser.add_argument("--output", type=Path, default=OUTPUT / "crowd", help="folder")


def run(options: argparse.Namespace) -> None:
    """Run the crowd, print what it took and what was missed; fail if a bar was not held."""
    with tempfile.TemporaryDirectory() as folder:
        heard, usage, lacking = run_crowd(Path(folder), options.robots, options.seconds)
        with Store(Path(folder) / STORE, TEAM) as store:
            begun = [at for _, at in store.versions_created(0, 10**6)]
    late = delays(heard, begun)
    p50, p99 = np.percentile(late, [50, 99]) if late else (np.inf, np.inf)
    parts = np.array_split(took(heard, begun), 4)
    quarters = [np.percentile(part, [50, 99]) for part in parts if len(part)]
    figures = usage.figures()
    rows = [[each.name, *(f"{n:.1f}" for n in each.numbers)] for each in figures]
    print(format_table(["process", "MiB at half", "MiB at the end", "CPU s/s"], rows))
    counted = sum(map(len, heard.maps.values()))
    print(
        f"{counted} maps of {options.robots} robots, {len(begun)} versions; missed: {lacking or 0}"
    )
    print(f"from a map to its version: p50 {p50:.2f} s, p99 {p99:.2f} s, bar: {MOST_LATE:g} s")
    told = ", ".join(f"{half:.2f} and {most:.2f} s" for half, most in quarters)
    print(f"of that, a version took, p50 and p99 of each quarter of them: {told}")
    grown = [each.name for each in figures if each.has_grown(MOST_GROWN, LEAST_GROWN)]
    print(f"memory grew by more than {MOST_GROWN:.0%} in the second half: {grown or 'none'}")
    outcome = {"p50": p50, "p99": p99, "missed": lacking, "usage": [asdict(f) for f in figures]}
    outcome["took"] = np.array(quarters).tolist()
    write_json(options.output / "crowd.json", outcome)
    if lacking or grown or p99 > MOST_LATE:
        sys.exit(1)
