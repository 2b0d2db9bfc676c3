"""The wire: bytes a robot sends for each metre it drives, counted between it and the router.

All that Zenoh sends is counted, from the start to 10 s after a robot's last scan. Beside it stand
key scans of the same run, compressed, and occupancy grids. Ends with 1 where a bar is missed.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import zenoh

from benchmarks.logs import find_logs
from benchmarks.relay import Relay, relay_to
from benchmarks.tables import OUTPUT, format_table, write_json
from mapweave.maps import RobotMap
from mapweave_deploy.run.key_scans import key_scan_bytes
from mapweave_deploy.run.launcher import (
    ROUTER_PATIENCE,
    Plan,
    free_endpoint,
    start_agent,
    start_router,
    start_server,
)
from mapweave_deploy.run.occupancy import grid_bytes
from mapweave_deploy.run.processes import ProcessGroup
from mapweave_deploy.run.team_plan import Member, simulated_team, team_from_logs
from mapweave_protocol.link.asking import ask_robot_map
from mapweave_protocol.link.assembler import MapAssembler
from mapweave_protocol.link.inbox import Inbox, status_reader
from mapweave_protocol.link.session import open_session
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.keys import JOINT_MAP, STATUS
from mapweave_protocol.wire.messages import MapMessage, StatusMessage

DEMO = "office"
BAR = 250.0  # [bytes] a metre
SHARE = 0.5  # of compressed key scans
JOINT_BAR = 2000.0  # [bytes/s] of versions of the joint map, mean over any minute
MINUTE = 60.0  # [s]
AFTER = 10.0  # [s] that are counted after a robot's last scan
IDLE = 10.0  # [s] that Zenoh's own keep-alive is measured
HEAD = ["run", "joint B/s", "robot", "m", "up B/m", "bar", "ratio", "down B/m"]
HEAD += ["key scans B/m", "bar", "ratio"]
HEAD += ["map kB", "grid kB", "deflated kB", "by topic B/m"]


@dataclass(frozen=True, slots=True)
class Bytes:
    """What one robot sent and got.

    Attributes
    ----------
    run
        Log or world, and rate.
    metres
        Driven, by the log's poses.
    up, down
        Sent and received [bytes].
    joint
        Versions of the joint map in the minute in which most came [bytes/s].
    topics
        Payloads that it sent, by kind of message, and all else that passed [bytes].
    key_scans
        Its scans half a metre or half a radian apart, compressed [bytes].
    once, grid, deflated
        Its last map in one message, and as an occupancy grid, plain and compressed [bytes].
    """

    run: str
    robot: str
    metres: float
    up: int
    down: int
    joint: float
    topics: dict[str, int]
    key_scans: int
    once: int
    grid: int
    deflated: int

    @property
    def enough(self) -> bool:
        """Whether it reaches all bars."""
        few = self.up <= min(BAR * self.metres, SHARE * self.key_scans)
        return few and self.joint <= JOINT_BAR


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which logs, how fast, how many robots."""
    parser.add_argument("--logs", default=f"fr079,intel,{DEMO}", help="cut up (%(default)s)")
    parser.add_argument("--rates", default="max,1", help="times real time (%(default)s)")
    parser.add_argument("--robots", type=int, default=3, metavar="N", help="in a team (3)")
    parser.add_argument("--scans", type=int, metavar="N", help="of each robot, the first ones")
    parser.add_argument("--output", type=Path, default=OUTPUT / "wire.json", help="(%(default)s)")


def run(options: argparse.Namespace) -> None:
    """Run teams as processes behind relays, print the table; end with 1 where it is too much."""
    rows: list[Bytes] = []
    with tempfile.TemporaryDirectory() as folder:
        for name in options.logs.split(","):
            members = _members(name, options.robots, Path(folder))
            if options.scans is not None:
                members = [_beginning(member, options.scans) for member in members]
            for rate in options.rates.split(","):
                rows += count(f"{name} {rate}", members, rate)
                print(tell(rows[-len(members) :]), flush=True)
                write_json(options.output, [asdict(row) for row in rows])
    print(f"Zenoh's own keep-alive: {keep_alive():.0f} B/s up")
    if not all(row.enough for row in rows):
        sys.exit(1)


def _members(name: str, robots: int, folder: Path) -> list[Member]:
    if name == DEMO:
        return simulated_team(DEMO, robots, 1, folder)
    (log,) = find_logs([name])
    return team_from_logs([log.path], robots)


def _beginning(member: Member, scans: int) -> Member:
    first, behind = member.scans
    return replace(member, scans=(first, min(first + scans, behind)))


def count(run_name: str, members: list[Member], rate: str) -> list[Bytes]:
    """Return what each robot of a team sent and got."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        crew = stack.enter_context(ProcessGroup(folder))
        plan = Plan("bench", members, rate, free_endpoint(), folder / "store", folder / "s", None)
        start_router(crew, plan)
        session = stack.enter_context(open_session([plan.listen], patience=ROUTER_PATIENCE))
        inbox = Inbox()
        stack.enter_context(session.declare_subscriber(STATUS.pattern(team=plan.team), inbox.put))
        versions: list[tuple[float, int]] = []
        stack.enter_context(_counting(session, plan.team, versions))
        start_server(crew, plan, plan.store)
        relays = {m.robot: stack.enter_context(relay_to(plan.listen)) for m in members}
        for member in members:
            start_agent(crew, replace(plan, listen=relays[member.robot].endpoint), member)
        counted = _follow(crew, inbox, relays)
        maps = {member.robot: _last_map(session, plan.team, member.robot) for member in members}
    joint = busiest_minute(versions)
    return [_row(run_name, m, maps[m.robot], joint, *counted[m.robot]) for m in members]


@contextmanager
def _counting(
    session: zenoh.Session, team: str, versions: list[tuple[float, int]]
) -> Iterator[None]:
    """Note when each version of the joint map comes [s], and its size."""

    def note(sample: zenoh.Sample) -> None:
        versions.append((time.monotonic(), len(sample.payload)))

    with session.declare_subscriber(JOINT_MAP.build(team=team), note):
        yield


def busiest_minute(sent: Sequence[tuple[float, int]]) -> float:
    """Return what was sent in the minute in which most was [bytes/s].

    Parameters
    ----------
    sent
        When [s], ascending, and how much [bytes].
    """
    minutes = ([size for t, size in sent if at <= t < at + MINUTE] for at, _ in sent)
    return max(map(sum, minutes), default=0) / MINUTE


def _follow(
    crew: ProcessGroup, inbox: Inbox, relays: dict[str, Relay]
) -> dict[str, tuple[int, int, StatusMessage]]:
    """Return by robot what passed, up and down, until `AFTER` it had finished, and its status."""
    reader = status_reader()
    ends: dict[str, float] = {}
    last: dict[str, StatusMessage] = {}
    counted: dict[str, tuple[int, int, StatusMessage]] = {}
    while len(counted) < len(relays):
        crew.check()
        arrival = inbox.get(0.1)
        status = reader.read(arrival) if arrival is not None else None
        if status is not None:
            last[status.robot] = status
            if status.state == "finished":
                ends.setdefault(status.robot, time.monotonic() + AFTER)
        for robot, end in ends.items():
            if robot not in counted and time.monotonic() >= end:
                if relays[robot].connections > 1:
                    print(f"{robot}: {relays[robot].connections} connections: one was given up")
                counted[robot] = relays[robot].up, relays[robot].down, last[robot]
    return counted


def _last_map(session: zenoh.Session, team: str, robot: str) -> RobotMap:
    message = ask_robot_map(session, team, robot)
    held = None if message is None else MapAssembler().update(message)
    if held is None:
        raise SystemExit(f"{robot}: the coordinator has no map of it")
    return held


def _row(
    name: str,
    member: Member,
    robot_map: RobotMap,
    joint: float,
    up: int,
    down: int,
    status: StatusMessage,
) -> Bytes:
    plain, deflated = grid_bytes(member, robot_map)
    topics: dict[str, int] = {kind: sent.bytes for kind, sent in status.sent.items()}
    # Where nobody subscribes, as to poses here, what is published does not travel.
    topics["Zenoh"] = up - sum(size for kind, size in topics.items() if kind != "pose")
    once = len(encode(MapMessage.pack(robot_map)))
    metres, scans = driven(member), key_scan_bytes(member, robot_map)
    return Bytes(name, member.robot, metres, up, down, joint, topics, scans, once, plain, deflated)


def driven(member: Member) -> float:
    """Return how far a robot drove by the poses in its log [m]."""
    first, behind = member.scans
    part = member.truth_pose[(member.truth_index >= first) & (member.truth_index < behind)]
    return float(np.hypot(*np.diff(part[:, :2], axis=0).T).sum())


def keep_alive() -> float:
    """Return what a session that does nothing sends [bytes/s]."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        crew = stack.enter_context(ProcessGroup(folder))
        plan = Plan("bench", [], "max", free_endpoint(), folder / "store", folder / "s", None)
        start_router(crew, plan)
        relay = stack.enter_context(relay_to(plan.listen))
        stack.enter_context(open_session([relay.endpoint], patience=ROUTER_PATIENCE))
        time.sleep(1.0)
        before = relay.up
        time.sleep(IDLE)
        return (relay.up - before) / IDLE


def tell(rows: Sequence[Bytes]) -> str:
    """Return the table as text."""
    return format_table(HEAD, [_cells(row) for row in rows])


def _cells(row: Bytes) -> list[str]:
    sent, bar = row.up / row.metres, SHARE * row.key_scans / row.metres
    topics = ", ".join(f"{kind} {size / row.metres:.0f}" for kind, size in row.topics.items())
    return [
        row.run,
        f"{row.joint:.0f}",
        row.robot,
        f"{row.metres:.0f}",
        f"{sent:.0f}",
        f"{BAR:.0f}",
        f"{sent / BAR:.2f}",
        f"{row.down / row.metres:.0f}",
        f"{row.key_scans / row.metres:.0f}",
        f"{bar:.0f}",
        f"{sent / bar:.2f}",
        *(f"{size / 1000:.1f}" for size in (row.once, row.grid, row.deflated)),
        topics,
    ]
