"""A coordinator that is killed while it writes: what was heard of it stands, and goes on."""

import itertools
import random
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from mapweave_fusion_server.store import Store
from mapweave_protocol.link import session
from mapweave_protocol.link.inbox import Inbox, joint_reader
from mapweave_protocol.link.joint_changes import JointAssembler
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.codec import decode
from mapweave_protocol.wire.messages import JointMapMessage
from tests.fusion_server.conftest import PATIENCE, MakeMap, Network, StartServer

PACE = 0.02  # [s] between two maps of the robot: there is always something to write
LONGEST = 0.5  # [s] from a version that was heard to the kill


class Heard:
    """The versions that a subscriber gets, each under its series and number."""

    def __init__(self) -> None:
        self.versions: dict[tuple[str, int], JointMapMessage] = {}
        self.last = ("", 0)
        self.inbox = Inbox()
        self._reader, self._assembler = joint_reader(), JointAssembler()

    def hear(self, seconds: float) -> None:
        """Take in what comes within so long a time."""
        end = time.monotonic() + seconds
        while (arrival := self.inbox.get(max(0.0, end - time.monotonic()))) is not None:
            message = self._reader.read(arrival)
            whole = None if message is None else self._assembler.update(message)
            if whole is not None:
                self.last = whole.series, whole.version
                assert self.versions.setdefault(self.last, whole) == whole, "a number of two things"

    def wait_for_news(self) -> None:
        """Wait for a version that was not heard before."""
        known, deadline = len(self.versions), time.monotonic() + PATIENCE
        while len(self.versions) == known:
            assert time.monotonic() < deadline
            self.hear(0.05)


@contextmanager
def _mapping(network: Network, make_map: MakeMap) -> Iterator[None]:
    """Have a robot that publishes one map after the other."""
    over = threading.Event()

    def publish() -> None:
        with network.robot("a") as robot:
            for version in itertools.count(1):
                if over.wait(PACE):
                    return
                robot.publish_map(make_map("a", version, components=version % 3 + 1))

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def _kill_while_publishing(
    network: Network, start_server: StartServer, make_map: MakeMap, times: int
) -> Heard:
    heard, chance = Heard(), random.Random(5)
    key = keys.JOINT_MAP.build(team=network.team)
    listening = session.declare_subscriber(network.connect(), key, heard.inbox.put)
    with _mapping(network, make_map), listening:
        for _ in range(times):
            server = start_server()
            heard.wait_for_news()
            heard.hear(chance.uniform(0.0, LONGEST))
            server.stop(signal.SIGKILL)
            heard.hear(0.1)
            with Store(server.store, network.team) as store:
                series, number = heard.last
                assert (store.series, store.damaged) == (series, 0)
                assert store.latest_version >= number
                kept = store.version(number)
                assert kept is not None
                assert decode(JointMapMessage, kept) == heard.versions[heard.last]
    return heard


def test_what_was_heard_of_a_coordinator_that_was_killed_is_in_its_store(
    network: Network, start_server: StartServer, make_map: MakeMap
) -> None:
    heard = _kill_while_publishing(network, start_server, make_map, 3)
    assert len(heard.versions) >= 3


@pytest.mark.slow
def test_a_hundred_kills_of_a_coordinator_lose_nothing_and_give_no_number_twice(
    network: Network, start_server: StartServer, make_map: MakeMap
) -> None:
    heard = _kill_while_publishing(network, start_server, make_map, 100)
    print(f"100 kills: {len(heard.versions)} versions heard, the last one {heard.last[1]}")
    assert len({series for series, _ in heard.versions}) == 1
    assert len(heard.versions) >= 100
