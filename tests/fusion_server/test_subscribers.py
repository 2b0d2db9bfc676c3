"""Subscribers of a real coordinator: the latest at once, then all in order, whatever fails."""

from __future__ import annotations

import secrets
import signal
import subprocess
import sys
import time
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, Any

import pytest

import mapweave_protocol
from benchmarks.faults.relay import Relay
from mapweave.maps import JointMap
from mapweave_fusion_server.store import Store
from mapweave_protocol.link.session import LEASE
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import JointMapMessage, MapVersion

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from mapweave_protocol.wire.messages import AlignmentMessage
    from tests.fusion_server.conftest import (
        Found,
        MakeAlignments,
        MakeMap,
        Network,
        ServerProcess,
        StartServer,
    )

HISTORY = 2000  # versions
WAIT = 40.0  # [s] without anything new, on a machine with much else to do
SUBSCRIBER = """
import sys, mapweave_protocol
for joint in mapweave_protocol.joint_maps(sys.argv[1], connect=sys.argv[2]):
    print(joint.version, flush=True)
"""


@pytest.fixture
def relay(endpoint: str) -> Iterator[Relay]:
    """Return the link of a subscriber."""
    with Relay(endpoint) as link:
        yield link


@pytest.fixture
def long_history(tmp_path: Path, team: str) -> Path:
    """Return a store with many versions."""
    path = tmp_path / "long.sqlite"
    with Store(path, team) as store:
        for number in range(1, HISTORY + 1):
            message = JointMapMessage.pack(JointMap(number, (), ()), store.series)
            store.add_version(number, float(number), encode(message))
    return path


def at(link: Network | Relay) -> dict[str, Any]:
    """Return how a subscriber is to be connected."""
    return {"connect": [link.endpoint], "timeout": WAIT}


def states(message: AlignmentMessage) -> tuple[MapVersion, MapVersion]:
    return message.reference, message.other


def test_versions_made_in_an_outage_of_a_subscriber_arrive_after_it_though_nothing_follows(
    network: Network, start_server: StartServer, make_map: MakeMap, relay: Relay
) -> None:
    start_server()
    watcher = network.watcher()
    with network.robot("a") as a:
        a.publish_map(make_map("a"))
        subscriber = mapweave_protocol.joint_maps(network.team, **at(relay))
        assert next(subscriber).version == watcher.next().version == 1
        relay.sever()
        for version in range(2, 30):  # more than are cached
            a.publish_map(make_map("a", version))
            assert watcher.next().version == version
        relay.restore()
        assert [joint.version for joint in islice(subscriber, 28)] == list(range(2, 30))


def test_maps_and_alignments_of_a_robot_that_came_and_went_in_an_outage_arrive_after_it(
    network: Network, start_server: StartServer, found: Found, relay: Relay
) -> None:
    server = start_server()
    map_a, map_b, by_a = found
    alignments = by_a.model_copy(update={"robot": "b"})
    maps = mapweave_protocol.robot_maps(network.team, **at(relay))
    pairs = mapweave_protocol.alignments(network.team, **at(relay))
    with network.robot("b") as b:
        b.publish_map(map_b)
        assert next(maps).robot == "b"
        b.publish_alignments(alignments)
        assert states(next(pairs)) == states(alignments)
        relay.sever()
        with network.robot("a") as a:
            a.publish_map(map_a)
            b.publish_alignments(later := of_version(alignments, 2))
            server.wait_for_log("a/0 + b/0")
            wait_until_held(server, network, later)
        relay.restore()
        assert next(maps).robot == "a"
        assert states(next(pairs)) == states(later)


def of_version(message: AlignmentMessage, version: int) -> AlignmentMessage:
    """Return the same found between later states of the maps."""
    ends = (end.model_copy(update={"version": version}) for end in states(message))
    return message.model_copy(update=dict(zip(("reference", "other"), ends, strict=True)))


def wait_until_held(server: ServerProcess, network: Network, message: AlignmentMessage) -> None:
    """Wait until the coordinator can give an alignment to who comes later."""
    deadline = time.monotonic() + network.patience
    held: set[tuple[MapVersion, MapVersion]] = set()
    while states(message) not in held:
        assert time.monotonic() < deadline, server.log
        again = mapweave_protocol.alignments(network.team, connect=[network.endpoint], timeout=1.0)
        held |= {states(each) for each in islice(again, 1)}


@pytest.mark.usefixtures("finished_team")
def test_who_comes_when_the_robots_are_gone_gets_their_maps_and_what_they_found(
    network: Network, found: Found
) -> None:
    map_a, map_b, by_a = found
    alignments = by_a.model_copy(update={"robot": "b"})
    maps = mapweave_protocol.robot_maps(network.team, **at(network))
    assert [(m.robot, m.version) for m in islice(maps, 2)] == [("a", 1), ("b", 1)]
    pairs = mapweave_protocol.alignments(network.team, **at(network))
    assert states(next(pairs)) == (MapVersion.of(map_a), MapVersion.of(map_b)) == states(alignments)


@pytest.mark.usefixtures("finished_team")
def test_who_says_since_which_version_gets_what_came_after_it_only(
    network: Network, found: Found, make_map: MakeMap, make_alignments: MakeAlignments
) -> None:
    map_a, _, _ = found
    map_c = make_map("c")
    watcher = network.watcher()
    by_c = make_alignments(map_a, map_c).model_copy(update={"robot": "c"})
    with network.robot("c") as c:
        assert watcher.next().version == 3
        c.publish_map(map_c)
        assert watcher.next().version == 4
        c.publish_alignments(by_c)
        assert watcher.next().version == 5
    parts = at(network) | {"timeout": 4.0}
    assert [m.robot for m in mapweave_protocol.robot_maps(network.team, since=3, **parts)] == ["c"]
    pairs = mapweave_protocol.alignments(network.team, since=3, **parts)
    assert [message.other.robot for message in pairs] == ["c"]
    joints = mapweave_protocol.joint_maps(network.team, since=1, **parts)
    assert [joint.version for joint in joints] == [2, 3, 4, 5]


def test_against_a_long_history_the_latest_comes_first_and_all_come_to_who_asks(
    network: Network, start_server: StartServer, long_history: Path, make_map: MakeMap
) -> None:
    early = mapweave_protocol.joint_maps(network.team, **at(network))
    start_server(store=long_history)
    assert next(early).version == HISTORY
    late = mapweave_protocol.joint_maps(network.team, **at(network))
    assert next(late).version == HISTORY
    every = mapweave_protocol.joint_maps(network.team, **at(network), since=0)
    with network.robot("a") as a:
        a.publish_map(make_map("a"))
        assert [joint.version for joint in islice(every, HISTORY + 1)] == [*range(1, HISTORY + 2)]
        assert next(early).version == next(late).version == HISTORY + 1


def test_a_subscriber_that_was_asleep_longer_than_its_lease_gets_every_version_in_order(
    network: Network, start_server: StartServer, make_map: MakeMap
) -> None:
    start_server()
    watcher = network.watcher()
    with (
        network.robot("a") as a,
        subprocess.Popen(
            [sys.executable, "-c", SUBSCRIBER, network.team, network.endpoint],
            stdout=subprocess.PIPE, text=True,
        ) as subscriber,
    ):  # fmt: skip
        assert subscriber.stdout is not None
        a.publish_map(make_map("a"))
        assert int(subscriber.stdout.readline()) == 1
        subscriber.send_signal(signal.SIGSTOP)
        slept = time.monotonic()
        for version in range(2, 41):
            a.publish_map(make_map("a", version))
            while watcher.next().version < version:
                pass  # a map that came too early would be in the version before
        time.sleep(max(0.0, slept + LEASE + 2.0 - time.monotonic()))
        subscriber.send_signal(signal.SIGCONT)
        assert [int(subscriber.stdout.readline()) for _ in range(39)] == list(range(2, 41))
        subscriber.kill()


def test_of_two_coordinators_both_hold_all_and_a_subscriber_follows_one_until_it_ends(
    network: Network, start_server: StartServer, found: Found, tmp_path: Path
) -> None:
    map_a, map_b, alignments = found
    first = start_server()
    subscriber = mapweave_protocol.joint_maps(network.team, **at(network))
    with network.robot("a") as a, network.robot("b") as b:
        a.publish_map(map_a)
        b.publish_map(map_b)
        a.publish_alignments(alignments)
        seen = [next(subscriber)]
        while not joined(seen[-1]):
            seen.append(next(subscriber))
        second = start_server(store=tmp_path / f"{secrets.token_hex(4)}.sqlite")
        for server in (first, second):
            server.wait_for_log("2 coordinators of the team are here")
        second.wait_for_log(": a/0 + b/0")
        a.publish_map(replace(map_a, version=2))
        seen.append(next(subscriber))
        assert [joint.version for joint in seen] == list(range(1, len(seen) + 1))
        assert joined(seen[-1])
        first.stop(signal.SIGKILL)
        other = next(subscriber)
        while not joined(other):  # its own series, from the beginning
            other = next(subscriber)
    assert other.version <= 3


def joined(joint: JointMap) -> bool:
    return [sorted(component.robots) for component in joint.components] == [["a/0", "b/0"]]


def test_versions_below_none_are_no_versions_to_begin_after() -> None:
    for subscribe in (
        mapweave_protocol.joint_maps,
        mapweave_protocol.robot_maps,
        mapweave_protocol.alignments,
    ):
        with pytest.raises(ValueError, match=r"^since: expected a version"):
            next(iter(subscribe("t", since=-1)))
