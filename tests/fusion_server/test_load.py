"""Who sends much, or is slow to listen, does so at nobody's cost but its own."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import zenoh

from mapweave_protocol.link import session as link
from mapweave_protocol.link.inbox import Inbox
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.codec import decode, encode
from mapweave_protocol.wire.messages import JointStatusMessage, MapMessage
from tests.fusion_server.conftest import PATIENCE, MakeMap, Network, StartServer

FLOOD = 3000  # maps: several times as many seconds of reading as between two words of a coordinator
ROUNDS = 60
BALLAST = 32 * 2**20  # [bytes]


def _held(inbox: Inbox) -> dict[str, int]:
    """Return the versions of maps that a coordinator says it holds, when it says so next."""
    arrival = inbox.newest(PATIENCE)
    assert arrival is not None
    status = decode(JointStatusMessage, arrival.payload)
    return {held.robot: held.version for held in status.maps}


def test_a_flood_of_one_robot_s_maps_does_not_delay_another_s(
    network: Network, start_server: StartServer, make_map: MakeMap
) -> None:
    flood = [encode(MapMessage.pack(make_map("a", n + 1))) for n in range(FLOOD)]
    start_server()
    session, said = network.connect(), Inbox()
    status = keys.JOINT_STATUS.build(team=network.team)
    key, wait = keys.MAP.build(team=network.team, robot="a"), zenoh.CongestionControl.BLOCK
    with network.robot("a"), network.robot("b") as b, session.declare_subscriber(status, said.put):
        for payload in flood:
            session.put(key, payload, congestion_control=wait)
        b.publish_map(make_map("b"))
        while "b" not in (held := _held(said)):
            assert held.get("a", 0) < FLOOD, "all that came before was read first"
        assert held["a"] < FLOOD


DECLARING = (
    link.declare_map_publisher,
    link.declare_alignment_publisher,
    link.declare_marks_publisher,
    link.declare_joint_publisher,
    link.declare_status_publisher,
    link.declare_pose_publisher,
)


@pytest.mark.parametrize("declare", DECLARING, ids=lambda declare: declare.__name__)
def test_nobody_waits_for_who_is_slow_to_take_what_is_published(
    network: Network, declare: Callable[[zenoh.Session, str], zenoh.Publisher]
) -> None:
    # Told to block, Zenoh would stop the publisher and all who listen for 5 s.
    publisher = declare(network.connect(), keys.JOINT_MAP.build(team=network.team))
    assert publisher.congestion_control == zenoh.CongestionControl.DROP
    publisher.undeclare()  # type: ignore[no-untyped-call]


FOLLOW = """
import sys
import mapweave_protocol
for joint in mapweave_protocol.joint_maps(sys.argv[1], connect=sys.argv[2], since=0):
    print(joint.version, flush=True)
"""


@contextmanager
def _follower(network: Network, log: Path) -> Iterator["subprocess.Popen[bytes]"]:
    """Have somebody who writes down which versions come, in a process of his own."""
    with log.open("wb") as told:
        process = subprocess.Popen(
            [sys.executable, "-c", FOLLOW, network.team, network.endpoint], stdout=told
        )
    try:
        yield process
    finally:
        process.kill()
        process.wait(PATIENCE)


def _wait_for_versions(log: Path, last: int) -> None:
    """Wait until all versions up to the `last` are written down, in order and once each."""
    deadline = time.monotonic() + PATIENCE
    while (told := log.read_text().split()) != [str(n + 1) for n in range(last)]:
        assert time.monotonic() < deadline, told
        time.sleep(0.05)


def test_a_subscriber_that_stands_still_keeps_no_version_from_the_others_and_catches_up(
    network: Network, start_server: StartServer, make_map: MakeMap, tmp_path: Path
) -> None:
    start_server()
    watcher, session = network.watcher(), network.connect()
    # More than networks keep for somebody who does not read; of those here he alone listens to it.
    ballast = keys.JOINT_STATUS.build(team=network.team)
    log = tmp_path / "versions"
    with network.robot("a") as a, _follower(network, log) as stopped:
        for version in range(1, ROUNDS + 1):
            if version == 2:  # he has begun
                _wait_for_versions(log, 1)
                stopped.send_signal(signal.SIGSTOP)
            session.put(ballast, bytes(BALLAST // ROUNDS))
            a.publish_map(make_map("a", version))
            assert watcher.next().version == version
        stopped.send_signal(signal.SIGCONT)
        _wait_for_versions(log, ROUNDS)
