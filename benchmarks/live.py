"""A live lidar: how old scans are when they are mapped, and how soon poses are out.

A simulated robot drives through the office; its scans go over a router as `rmw_zenoh` publishes
them, to ``mapweave agent --source ros2:/scan``, beside a coordinator. Everything is on one machine.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import zenoh
from rosbags.typesys import Stores, get_typestore

from benchmarks.tables import OUTPUT, format_table, write_json
from mapweave.io.readers.ros_bags.laser_messages import LASER_SCAN
from mapweave_deploy.run.launcher import free_endpoint
from mapweave_deploy.sim.lidar import LidarParameters, measure
from mapweave_deploy.sim.office import office
from mapweave_deploy.sim.trajectories import TourParameters, plan_tours
from mapweave_protocol.link.asking import request_statuses
from mapweave_protocol.link.inbox import Arrival
from mapweave_protocol.link.session import open_session
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.codec import decode
from mapweave_protocol.wire.messages import PoseMessage, StatusMessage

TEAM, ROBOT, TOPIC = "live", "r1", "/scan"
DRAINED = 2.0  # [s] after the last scan, in which its pose comes
LATE, WAITED = 50.0, 50.0  # [ms]: a pose after its scan at most; a scan beyond one period
PATIENCE = 30.0  # [s]
HEAD = ["Hz", "sent", "mapped", "skipped", "oldest ms", "pose p50 ms", "pose p99 ms", "components"]


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of the scans of a drive; times in ms."""

    rate: float
    sent: int
    mapped: int
    skipped: int
    oldest: float
    pose_p50: float
    pose_p99: float
    components: int

    def shortfalls(self) -> Iterator[str]:
        """Yield which bars are not held, in words with figure, bar and ratio."""
        lost = self.sent - self.mapped - self.skipped
        if lost:
            yield f"{self.rate:g} Hz: {lost} scans neither mapped nor told as skipped"
        bars = {
            "oldest scan": (self.oldest, 1000 / self.rate + WAITED),
            "pose p99": (self.pose_p99, LATE),
        }
        for name, (figure, bar) in bars.items():
            if figure > bar:
                yield f"{self.rate:g} Hz: {name} {figure:g} ms, bar {bar:g}, {figure / bar:.2f} x"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say how fast and how long."""
    parser.add_argument("--rates", type=float, nargs="+", default=[10.0, 40.0], metavar="HZ")
    parser.add_argument("--seconds", type=float, default=90.0, metavar="S", help="of each drive")


def run(options: argparse.Namespace) -> None:
    """Drive at each rate, print, write."""
    outcomes = [_drive(rate, options.seconds) for rate in options.rates]
    rows = [[f"{value:g}" for value in asdict(outcome).values()] for outcome in outcomes]
    print(format_table(HEAD, rows))
    write_json(OUTPUT / "live.json", [asdict(outcome) for outcome in outcomes])
    short = [line for outcome in outcomes for line in outcome.shortfalls()]
    print("\n".join(short or ["all bars held"]))
    if short:
        sys.exit(1)


def _drive(rate: float, seconds: float) -> Outcome:
    messages = list(_messages(rate, seconds))
    endpoint = free_endpoint()
    reached = ("--team", TEAM, "--connect", endpoint)
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        source = ("--robot", ROBOT, "--source", f"ros2:{TOPIC}", "--state", folder)
        store = ("--store", str(Path(folder) / "store.sqlite"))
        router, server = ("router", "--listen", endpoint), ("server", *reached, *store)
        for command in (router, server, ("agent", *reached, *source)):
            process = subprocess.Popen([str(Path(sys.executable).with_name("mapweave")), *command])
            stack.enter_context(process)
            stack.callback(process.terminate)
        session = stack.enter_context(open_session([endpoint], patience=PATIENCE))
        return _measure(session, rate, messages)


def _measure(session: zenoh.Session, rate: float, messages: list[tuple[float, bytes]]) -> Outcome:
    """Publish `messages`, each with its stamp [s], and hear what the agent says of them."""
    sent: dict[float, float] = {}
    waited: list[float] = []
    statuses: list[StatusMessage] = []

    def hear_pose(sample: zenoh.Sample) -> None:
        stamp = decode(PoseMessage, sample.payload.to_bytes()).stamp
        if stamp is not None and round(stamp, 3) in sent:
            waited.append(time.monotonic() - sent[round(stamp, 3)])

    def hear_status(sample: zenoh.Sample) -> None:
        statuses.append(decode(StatusMessage, sample.payload.to_bytes()))

    def hear_answer(arrival: Arrival) -> None:
        statuses.append(decode(StatusMessage, arrival.payload))

    where = {"team": TEAM, "robot": ROBOT}
    key = f"0{TOPIC}/sensor_msgs::msg::dds_::LaserScan_/TypeHashNotSupported"
    with (
        session.declare_subscriber(keys.POSE.build(**where), hear_pose),
        session.declare_subscriber(keys.STATUS.build(**where), hear_status),
        session.declare_publisher(key) as sensor,
    ):
        while not statuses:
            time.sleep(0.1)
        time.sleep(1.0)  # for its subscription to be known
        started = time.monotonic()
        for number, (stamp, payload) in enumerate(messages):
            time.sleep(max(0.0, started + number / rate - time.monotonic()))
            sent[round(stamp, 3)] = time.monotonic()
            sensor.put(payload)
        time.sleep(DRAINED)
        ages = [s.scan_age for s in statuses if s.scan_age is not None]
        before = len(statuses)
        request_statuses(session, TEAM, hear_answer)  # how it is now, not when it last said so
        while len(statuses) == before:
            time.sleep(0.1)
    last = statuses[-1]
    p50, p99 = np.percentile(waited, [50, 99]) * 1e3
    oldest = round(max(ages) * 1e3, 1)
    times = round(float(p50), 1), round(float(p99), 1)
    counts = len(messages), last.scans_seen, last.scans_skipped
    return Outcome(rate, *counts, oldest, *times, last.components)


def _messages(rate: float, seconds: float) -> Iterator[tuple[float, bytes]]:
    """Yield when each scan of a drive is taken [s], and its message."""
    types, rng = get_typestore(Stores.ROS2_HUMBLE), np.random.default_rng(1)
    world, lidar = office(1), LidarParameters()
    drive = TourParameters(scan_rate=rate, length=0.4 * seconds)
    (tour,) = plan_tours(world, 1, drive, rng)
    for stamp, pose in zip(tour.stamp.tolist(), tour.pose, strict=True):
        if stamp > seconds:
            return
        ranges = measure(world, pose, lidar, rng).astype(np.float32)
        second = int(stamp)
        time_ = types.types["builtin_interfaces/msg/Time"](
            sec=second, nanosec=int((stamp - second) * 1e9)
        )
        scan = types.types[LASER_SCAN](
            header=types.types["std_msgs/msg/Header"](stamp=time_, frame_id="laser"),
            angle_min=float(lidar.angles[0]),
            angle_max=float(lidar.angles[-1]),
            angle_increment=float(lidar.angles[1] - lidar.angles[0]),
            time_increment=0.0,
            scan_time=1 / rate,
            range_min=0.0,
            range_max=lidar.maximum_range,
            ranges=ranges,
            intensities=np.zeros(0, dtype=np.float32),
        )
        yield stamp, bytes(types.serialize_cdr(scan, LASER_SCAN))
