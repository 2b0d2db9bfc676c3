"""A log replayed through every source: the same scans placed, where the file's scans are.

Each source is an agent as a process (`Agent.feed`: in this one), beside a router. A recording is
played as fast as can be; to the others each scan is given at its time, `--speed` times as fast as
the robot drove, and not before the one before it is mapped, so that none is skipped however slow
the machine is, and the agent maps as live ones do. Compared are the
poses that are said scan by scan with those that the same scans have in one process, and where the
submaps lie in the end. Messages hold ranges and angles as 32-bit numbers: all sources but the log
itself are compared with a bag of the log; how much the rounding does is a row of its own.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import zenoh
from rosbags.rosbag2 import StoragePlugin

import mapweave_agent
from benchmarks.logs import find_logs, load_scans
from benchmarks.ros_scans import ROS2, angles_of, laser_scan, ranges_of, ros1_bag, ros2_bag
from benchmarks.tables import OUTPUT, format_table, write_json
from mapweave.commands.progress import track
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.io.readers import read_scans
from mapweave.io.readers.ros_bags.laser_messages import LASER_SCAN
from mapweave.mapping.mapper import Mapper
from mapweave.maps import RobotMap
from mapweave.scan.scan import Scan
from mapweave_agent.past_runs import StateFolder
from mapweave_deploy.run.launcher import free_endpoint
from mapweave_protocol.link.session import open_session
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.codec import decode
from mapweave_protocol.wire.messages import PoseMessage, StatusMessage

TEAM, ROBOT = "sources", "r1"
MAPWEAVE = str(Path(sys.executable).with_name("mapweave"))
PATIENCE = 600.0  # [s]
SPEED = 8.0  # times real time
UNSAID = 60.0  # [s] after which a scan is taken to be mapped of which no pose is said
FURTHEST, TURNED = 0.01, 0.1  # [m], [°] off the file's: the bar
ITSELF, ROUNDED = "the log itself", "rounded, as in a bag"
TYPE = "sensor_msgs::msg::dds_::LaserScan_"
NATIVE = {
    "ros2, rmw_zenoh": f"0/scan/{TYPE}/{ROS2.hash_rihs01(LASER_SCAN)}",
    "ros2, rmw_zenoh of Humble": f"0/scan/{TYPE}/TypeHashNotSupported",
    "ros2, zenoh-bridge-ros2dds": "scan",
}
HEAD = ["log", "source", "scans", "placed", "of the file", "skipped", "poses said"]
HEAD += ["furthest mm", "most turned °", "submaps mm"]


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of the scans of a log by one source.

    Attributes
    ----------
    same
        Whether the scans that were placed are those of the file, in the same submaps.
    said
        How many poses were heard; those of a recording that is played fast may be dropped.
    furthest, turned
        [m], [°] between a pose that was said and that of the file's scan, at most.
    submaps
        [m] between where a submap lies in the end and where it does in the file's map, at most.
    """

    log: str
    source: str
    scans: int
    placed: int
    expected: int
    skipped: int
    same: bool
    said: int
    furthest: float
    turned: float
    submaps: float

    @property
    def held(self) -> bool:
        """Whether the bar is."""
        close = max(self.furthest, self.submaps) <= FURTHEST and self.turned <= TURNED
        return self.same and close and not self.skipped


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which logs, how much of them, and which sources."""
    parser.add_argument("--logs", nargs="+", default=["fr079"], metavar="NAME")
    parser.add_argument("--scans", type=int, default=sys.maxsize, metavar="N", help="the first N")
    parser.add_argument("--only", default="", metavar="WORD", help="sources that WORD is a part of")
    parser.add_argument(
        "--speed", type=float, default=SPEED, metavar="X", help=f"times real time, live ({SPEED:g})"
    )


def run(options: argparse.Namespace) -> None:
    """Replay, print, write."""
    outcomes: list[Outcome] = []
    for log in find_logs(options.logs):
        scans = load_scans(log)[: options.scans]
        expected = _mapped(scans)
        rounded = _mapped(_rounded(scans))
        outcomes.append(_compared(log.name, ROUNDED, expected, rounded, 0))
        for name, replay in _sources(log.path, options.speed).items():
            if options.only in name:
                of_file = expected if name == ITSELF else rounded
                outcomes.append(_compared(log.name, name, of_file, *_replayed(replay, scans)))
                print(outcomes[-1])
    print(format_table(HEAD, [_row(outcome) for outcome in outcomes]))
    write_json(OUTPUT / "sources.json", [asdict(outcome) for outcome in outcomes])
    if not all(outcome.held for outcome in outcomes if outcome.source != ROUNDED):
        sys.exit(1)


@dataclass(frozen=True, slots=True, eq=False)
class Mapped:
    """A map, and (3,) by its index the pose that each scan had when it was placed."""

    robot_map: RobotMap
    poses: dict[int, FloatArray]


def _mapped(scans: Sequence[Scan]) -> Mapped:
    mapper, poses = Mapper(ROBOT, prompt=True), {}
    for scan in track(scans, "mapping the file", len(scans)):
        placement = mapper.add(scan)
        if placement.pose is not None:
            poses[scan.index] = placement.pose
    return Mapped(mapper.finish(), poses)


def _rounded(scans: Sequence[Scan]) -> list[Scan]:
    """Return `scans` as a bag has them."""
    with tempfile.TemporaryDirectory() as folder:
        return list(read_scans(ros1_bag(Path(folder), scans)))


class Place:
    """A router, a folder for the agent's state and others, and what the agent says of itself."""

    def __init__(self, session: zenoh.Session, endpoint: str, folder: Path) -> None:
        self.endpoint, self.folder = endpoint, folder
        self.state = folder / "state"
        self.poses: dict[int, FloatArray] = {}
        self._session = session
        self._status: StatusMessage | None = None
        self._mapped = -1
        self._changed = threading.Condition()
        where = {"team": TEAM, "robot": ROBOT}
        self._heard = [
            session.declare_subscriber(keys.POSE.build(**where), self._hear_pose),
            session.declare_subscriber(keys.STATUS.build(**where), self._hear_status),
        ]

    def publisher(self, key: str) -> zenoh.Publisher:
        """Return what says messages on the network."""
        return self._session.declare_publisher(key)

    def wait_until_here(self) -> None:
        """Return when the agent has said that it is there."""
        with self._changed:
            self._changed.wait_for(lambda: self._status is not None, PATIENCE)

    def wait_until_mapped(self, index: int) -> None:
        """Return when the scan of `index` is."""
        with self._changed:
            self._changed.wait_for(lambda: self._mapped >= index, UNSAID)

    def wait_until_finished(self) -> int:
        """Return how many scans were skipped, once the agent has mapped all."""
        with self._changed:
            self._changed.wait_for(lambda: self._says("finished"), PATIENCE)
            if self._status is None or not self._says("finished"):
                raise SystemExit(f"the agent has not finished: {self._status}")
            return self._status.scans_skipped

    def _says(self, state: str) -> bool:
        return self._status is not None and self._status.state == state

    def _hear_pose(self, sample: zenoh.Sample) -> None:
        told = decode(PoseMessage, sample.payload.to_bytes())
        with self._changed:
            self._mapped = told.scan_index
            if told.found:
                self.poses[told.scan_index] = np.array(told.pose)
            self._changed.notify_all()

    def _hear_status(self, sample: zenoh.Sample) -> None:
        with self._changed:
            self._status = decode(StatusMessage, sample.payload.to_bytes())
            self._changed.notify_all()

    @contextmanager
    def agent(self, *options: str, **more: Any) -> Iterator["subprocess.Popen[str]"]:  # noqa: ANN401
        """Run an agent for the length of a block, at whose end it leaves."""
        where = ("--robot", ROBOT, "--team", TEAM, "--connect", self.endpoint)
        command = [MAPWEAVE, "agent", *where, "--state", str(self.state), *options]
        with subprocess.Popen(command, text=True, **more) as process:
            try:
                yield process
            finally:
                process.terminate()


Replay = Callable[[Place, Sequence[Scan]], int]


def _sources(log: Path, speed: float) -> dict[str, Replay]:
    """Return by its name what replays scans, and returns how many were skipped."""
    return {
        ITSELF: partial(_recording, lambda _folder, _scans: log),
        "bag of ROS 1": partial(_recording, ros1_bag),
        "bag of ROS 2, db3": partial(_recording, partial(ros2_bag, StoragePlugin.SQLITE3)),
        "bag of ROS 2, mcap": partial(_recording, partial(ros2_bag, StoragePlugin.MCAP)),
        **{name: partial(_topic, key, speed) for name, key in NATIVE.items()},
        "lines of JSON": partial(_lines, speed),
        "Agent.feed": partial(_fed, speed),
    }


def _replayed(replay: Replay, scans: Sequence[Scan]) -> tuple[Mapped, int]:
    endpoint = free_endpoint()
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        router = stack.enter_context(subprocess.Popen([MAPWEAVE, "router", "--listen", endpoint]))
        stack.callback(router.terminate)
        session = stack.enter_context(open_session([endpoint], patience=PATIENCE))
        place = Place(session, endpoint, Path(folder))
        skipped = replay(place, scans)
        (past,) = StateFolder(place.state).runs(ROBOT, time.time())
        return Mapped(past.map, place.poses), skipped


def _recording(
    write: Callable[[Path, Sequence[Scan]], Path], place: Place, scans: Sequence[Scan]
) -> int:
    source = str(write(place.folder, scans))
    until = f":{len(scans)}"
    with place.agent("--source", source, "--rate", "max", "--scans", until):
        return place.wait_until_finished()


def _live(scans: Sequence[Scan], speed: float) -> Iterator[Scan]:
    """Yield each scan not before its time, so many times as fast as the robot drove."""
    begun = time.monotonic()
    for scan in scans:
        due = begun + (scan.stamp - scans[0].stamp) / speed
        time.sleep(max(0.0, due - time.monotonic()))
        yield scan


def _topic(key: str, speed: float, place: Place, scans: Sequence[Scan]) -> int:
    publisher = place.publisher(key)
    with place.agent("--source", "ros2:/scan?domain=0", "--scans", f":{len(scans)}"):
        matching: Any = publisher.matching_status  # its stub says bool
        while not matching.matching:
            time.sleep(0.1)
            matching = publisher.matching_status
        for index, scan in enumerate(_live(scans, speed)):
            publisher.put(bytes(ROS2.serialize_cdr(laser_scan(ROS2, scan), LASER_SCAN)))
            place.wait_until_mapped(index)
        return place.wait_until_finished()


def _lines(speed: float, place: Place, scans: Sequence[Scan]) -> int:
    with place.agent("--source", "-", stdin=subprocess.PIPE) as process:
        assert process.stdin is not None
        place.wait_until_here()
        for index, scan in enumerate(_live(scans, speed)):
            line = {"stamp": scan.stamp, "ranges": ranges_of(scan).tolist(), **angles_of(scan)}
            process.stdin.write(json.dumps(line).replace("Infinity", "null") + "\n")
            process.stdin.flush()
            place.wait_until_mapped(index)
        process.stdin.close()
        return place.wait_until_finished()


def _fed(speed: float, place: Place, scans: Sequence[Scan]) -> int:
    with mapweave_agent.Agent(
        ROBOT, TEAM, connect=place.endpoint, state=place.state, patience=PATIENCE
    ) as agent:
        for index, scan in enumerate(_live(scans, speed)):
            agent.feed(ranges_of(scan), stamp=scan.stamp, **angles_of(scan))
            place.wait_until_mapped(index)
    return agent.skipped


def _compared(log: str, source: str, expected: Mapped, found: Mapped, skipped: int) -> Outcome:
    maps = expected.robot_map, found.robot_map
    scans, placed = _indices(maps[0]), _indices(maps[1])
    both = sorted(found.poses.keys() & expected.poses.keys())
    off = se2.between(*(np.array([of.poses[k] for k in both]) for of in (expected, found)))
    apart = [
        np.hypot(*(one.pose - other.pose)[:2])
        for one, other in zip(maps[0].submaps, maps[1].submaps, strict=False)
    ]
    return Outcome(
        log,
        source,
        len(expected.poses),
        sum(map(len, placed)),
        sum(map(len, scans)),
        skipped,
        placed == scans,
        len(found.poses),
        float(np.hypot(off[:, 0], off[:, 1]).max()),
        float(np.degrees(np.abs(off[:, 2]).max())),
        float(max(apart)),
    )


def _indices(robot_map: RobotMap) -> list[list[int]]:
    """Return which scans each submap has."""
    return [submap.trajectory.scan_index.tolist() for submap in robot_map.submaps]


def _row(outcome: Outcome) -> list[str]:
    counts = outcome.scans, outcome.placed, outcome.expected, outcome.skipped, outcome.said
    apart = [f"{metres * 1e3:.2f}" for metres in (outcome.furthest, outcome.submaps)]
    turned = f"{outcome.turned:.3f}"
    return [outcome.log, outcome.source, *map(str, counts), apart[0], turned, apart[1]]
