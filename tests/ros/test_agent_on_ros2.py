"""``mapweave agent --source ros2:…`` as a real process, beside lasers that talk as ROS 2 does."""

import math
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from mapweave.scan.scan import Scan
from mapweave_protocol.link.session import open_session
from tests.agent.test_agent import MAPWEAVE, PATIENCE, Listener
from tests.agent.test_own_agent import assert_mapped, scans_of
from tests.ros.lasers import HUMBLE_HASH, as_message, laser, laser_scan, native_key
from tests.ros.listeners import listening
from tests.ros.moving import TF_MESSAGE, cdr, tf, transform
from tests.ros.test_beside_scans import robot
from tests.ros.test_bridge import children

PEER = Path(__file__).with_name("peer.py")
FORMS = {
    "jazzy": (native_key("/scan"), True),
    "humble": (native_key("/scan", type_hash=HUMBLE_HASH), True),
    "without attachment": (native_key("/scan"), False),
    "bridge": ("scan", False),
}


@contextmanager
def agent(
    endpoint: str, team: str, source: str, *options: str
) -> Iterator["subprocess.Popen[str]"]:
    """Run an agent for the length of a block."""
    where = ["--robot", "a", "--team", team, "--connect", endpoint, "--source", source, *options]
    with subprocess.Popen(
        [MAPWEAVE, "agent", *where], stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            yield process
        finally:
            process.kill()


@pytest.mark.parametrize("form", FORMS)
def test_scans_of_ros_2_are_mapped_as_their_log_is(
    form: str, endpoint: str, team: str, logs: list[Path]
) -> None:
    scans = scans_of(logs[0])
    key, attached = FORMS[form]
    with (
        open_session([endpoint], patience=PATIENCE) as session,
        laser(endpoint, key, attached=attached) as sensor,
        agent(endpoint, team, "ros2:/scan", "--rate", "max", "--scans", f":{len(scans)}"),
    ):
        listener = Listener(session, team)
        sensor.wait_for_listener()
        for scan in scans:
            sensor.say(as_message(scan))
        listener.until(lambda: listener.finished("a"))
    assert_mapped(listener.maps["a"], scans)
    assert listener.statuses["a"].scans_seen == len(scans)


def test_an_independent_ros_2_peer_is_mapped_as_its_log_is(
    endpoint: str, team: str, logs: list[Path], tmp_path: Path
) -> None:
    scans = scans_of(logs[0])
    host, port = endpoint.removeprefix("tcp/").split(":")
    peer = [sys.executable, str(PEER), host, port, str(tmp_path / "messages"), str(logs[0])]
    options = "--rate", "max", "--scans", f":{len(scans)}"
    with (
        open_session([endpoint], patience=PATIENCE) as session,
        agent(endpoint, team, "ros2:/scan?domain=7", *options),
    ):
        listener = Listener(session, team)
        with subprocess.Popen(peer) as process:
            listener.until(lambda: listener.finished("a"))
            process.kill()
    assert_mapped(listener.maps["a"], scans)


def test_ctrl_c_ends_an_agent_that_still_waits_for_scans(endpoint: str, team: str) -> None:
    with (
        open_session([endpoint], patience=PATIENCE) as session,
        agent(endpoint, team, "ros2:/scan?domain=9") as process,
    ):
        listener = Listener(session, team)
        listener.until(lambda: "a" in listener.statuses)
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 0
        assert process.stderr is not None
        assert "Traceback" not in process.stderr.read()


def test_ctrl_c_ends_an_agent_whose_ros_2_router_is_not_there(endpoint: str, team: str) -> None:
    with (
        open_session([endpoint], patience=PATIENCE) as session,
        agent(endpoint, team, "ros2:/scan?connect=tcp/127.0.0.1:1") as process,
    ):
        listener = Listener(session, team)
        listener.until(lambda: "a" in listener.statuses)
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 0


def as_odd_messages(scans: list[Scan]) -> Iterator[bytes]:
    """Yield scans, each written as another sensor would, and between them what is none."""
    for index, scan in enumerate(scans):
        start, step = float(scan.angles[0]), float(scan.angles[1] - scan.angles[0])
        lost = (0.0, np.inf, np.nan, 30.0)[index % 4]
        ranges = np.where(scan.hits, scan.ranges, lost)
        maximum = 30.0 if lost == 30.0 else 100.0
        stamp = (scan.stamp, 0.0, -1.0, 1e9)[index % 4]
        match index % 3:
            case 0:  # fewer beams
                yield laser_scan(ranges[::2], start, 2 * step, stamp, range_max=maximum)
            case 1:  # clockwise
                end = float(scan.angles[-1])
                yield laser_scan(ranges[::-1], end, -step, stamp, range_max=maximum)
            case _:  # closer than it can measure is none
                yield laser_scan(ranges, start, step, stamp, range_min=0.3, range_max=maximum)
        yield (b"", as_message(scan)[:-7], laser_scan(ranges, start, 0.0))[index % 3]


def test_scans_of_every_writing_are_mapped_and_noise_between_them_ends_nothing(
    endpoint: str, team: str, logs: list[Path]
) -> None:
    scans = scans_of(logs[0])
    with (
        open_session([endpoint], patience=PATIENCE) as session,
        laser(endpoint, native_key("/odd")) as sensor,
        agent(endpoint, team, "ros2:/odd", "--rate", "max", "--scans", f":{len(scans)}") as process,
    ):
        listener = Listener(session, team)
        sensor.wait_for_listener()
        for message in as_odd_messages(scans):
            sensor.say(message)
        listener.until(lambda: listener.finished("a"))
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 0
        assert process.stderr is not None
        told = [line for line in process.stderr.read().splitlines() if "refused" in line]
    assert len(listener.maps["a"].components) == 1
    assert listener.statuses["a"].scans_placed == len(scans)
    assert [line.split()[4].partition(":")[0] for line in told] == ["/odd"] * 2


def test_an_agent_places_the_frames_that_its_robot_has_in_its_map(
    endpoint: str, team: str, logs: list[Path]
) -> None:
    scans, network = scans_of(logs[0])[:60], "ros2:?domain=11"
    kinds = {"/tf_static": (TF_MESSAGE, True), "/tf": (TF_MESSAGE, False)}
    with (
        open_session([endpoint], patience=PATIENCE) as session,
        robot(endpoint, 11, kinds) as node,
        laser(endpoint, native_key("/scan", domain=11)) as sensor,
        listening(session, 11, "/tf", TF_MESSAGE) as heard,
    ):
        fixed = transform("base_link", "laser", 0.2, 0.0, math.pi / 2)
        node.put("/tf_static", cdr(tf(fixed), TF_MESSAGE))
        options = "--rate", "max", "--publish", network
        with agent(endpoint, team, "ros2:/scan?domain=11", *options):
            sensor.wait_for_listener()
            for count, scan in enumerate(scans):
                if count >= 20:  # odometry comes up late, and says that the robot stands still
                    moved = transform("odom", "base_link", 1.0, 2.0, 0.5, stamp=scan.stamp)
                    node.put("/tf", cdr(tf(moved), TF_MESSAGE))
                sensor.say(as_message(scan))
                time.sleep(0.05)
            heard.until(lambda message: ("a/map", "odom") in children(message))
    told = [children(message) for message in heard.messages]
    said = [pairs for pairs in told if any(parent == "a/map" for parent, _ in pairs)]
    assert set.union(*said) <= {("a/map", "base_link"), ("a/map", "odom")}
    late = said[next(i for i, pairs in enumerate(said) if ("a/map", "odom") in pairs) :]
    assert all(pairs == {("a/map", "odom")} for pairs in late)  # never two parents again
