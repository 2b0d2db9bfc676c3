"""The coordinator as a process: a real router, a real server, sessions of robots and watchers."""

from __future__ import annotations

import itertools
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np
import pytest
import zenoh

import mapweave_protocol
from mapweave.maps import JointMap
from mapweave_fusion_server.store import Store
from mapweave_protocol.link.asking import ask_joint_maps, ask_robot_map
from mapweave_protocol.link.assembler import MapAssembler
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.codec import decode, encode
from mapweave_protocol.wire.messages import (
    JointMapMessage,
    JointStatusMessage,
    MapMessage,
    MapVersion,
    StatusMessage,
)
from mapweave_protocol.wire.queries import JointQuery

HISTORY = 300  # versions: more than wait at a subscriber

if TYPE_CHECKING:
    from pathlib import Path

    from tests.fusion_server.conftest import (
        Found,
        MakeAlignments,
        MakeMap,
        Network,
        ServerProcess,
        StartServer,
    )


def test_who_listened_before_sees_joining_and_parting_as_versions_1_2_3_4(
    network: Network,
    start_server: StartServer,
    found: Found,
    make_alignments: MakeAlignments,
) -> None:
    start_server()
    watcher = network.watcher()
    map_a, map_b, alignments = found
    with network.robot("a") as a, network.robot("b") as b:
        a.publish_map(map_a)
        seen = [watcher.next()]
        b.publish_map(map_b)
        seen.append(watcher.next())
        a.publish_alignments(alignments)
        seen.append(watcher.next())
        later = replace(map_b, version=2)
        a.publish_alignments(make_alignments(map_a, later, "refused", reason="walls in the way"))
        seen.append(watcher.next())
    assert [joint.version for joint in seen] == [1, 2, 3, 4]
    apart, together = [["a/0"], ["b/0"]], [["a/0", "b/0"]]
    assert [network.groups(joint) for joint in seen] == [[["a/0"]], apart, together, apart]
    assert [a.reason for a in seen[3].alignments] == ["revoked in version 4: walls in the way"]


@pytest.mark.usefixtures("finished_team")
def test_who_comes_after_the_team_has_finished_gets_the_latest_joint_map(
    network: Network,
) -> None:
    latest = next(
        mapweave_protocol.joint_maps(
            network.team, connect=[network.endpoint], timeout=network.patience
        )
    )
    assert latest.version == 3
    assert network.groups(latest) == [["a/0", "b/0"]]


@pytest.mark.usefixtures("finished_team")
def test_queries_give_the_latest_one_version_all_since_or_a_reason(
    network: Network,
) -> None:
    connection = network.connect()

    def versions(query: JointQuery) -> list[int]:
        return [answer.version for answer in ask_joint_maps(connection, network.team, query)]

    assert versions(JointQuery()) == [3]
    assert versions(JointQuery(version=2)) == [2]
    assert versions(JointQuery(since=1)) == [2, 3]
    assert versions(JointQuery(since=3)) == []
    [reply] = connection.get(f"{keys.JOINT_QUERY.build(team=network.team)}?version=4")
    assert reply.err is not None
    assert "no version 4" in reply.err.payload.to_string()


def test_the_last_map_of_a_robot_that_is_gone_can_be_asked_for(
    network: Network, finished_team: ServerProcess, found: Found
) -> None:
    finished_team.wait_for_log("a is gone")
    message = ask_robot_map(network.connect(), network.team, "a")
    assert message is not None
    robot_map = MapAssembler().update(message)
    assert robot_map is not None
    [submap], [sent] = robot_map.submaps, found[0].submaps
    np.testing.assert_allclose(submap.map.segments, sent.map.segments, atol=0.01)
    assert ask_robot_map(network.connect(), network.team, "nobody") is None


def test_a_server_that_comes_after_the_robots_have_finished_learns_what_they_found(
    network: Network, start_server: StartServer, found: Found
) -> None:
    watcher = network.watcher()
    map_a, map_b, alignments = found
    with network.robot("a") as a, network.robot("b") as b:
        a.publish_map(map_a)
        b.publish_map(map_b)
        a.publish_alignments(alignments)
        start_server()
        while network.groups(watcher.next()) != [["a/0", "b/0"]]:
            pass


def test_hostile_messages_are_dropped_and_told_of(
    network: Network, start_server: StartServer, make_map: MakeMap
) -> None:
    server = start_server()
    watcher = network.watcher()
    mallory = network.connect()
    robot = f"mapweave/v2/{network.team}/agent/m"
    someone = encode(MapMessage.pack(make_map("a")))
    payloads = b"", b"\xc1", b"\xdd\xff\xff\xff\xff", someone[:-7], someone
    names = f"{robot}/map", f"{robot}/alignment/m/a"
    nobody = f"mapweave/v2/{network.team}/agent/M !"
    deadline = time.monotonic() + network.patience
    # Again and again: what is put before a session knows who listens goes nowhere.
    while not all(f"{name}: refused" in server.log for name in names):
        assert time.monotonic() < deadline, server.log
        for payload, name in itertools.product(payloads, names):
            mallory.put(name, payload)
        time.sleep(0.2)
    for payload in payloads:  # now, as one line a kind is told: it would be told instead
        mallory.put(f"{nobody}/map", payload)
    with (
        mallory.liveliness().declare_token(f"mapweave/v2/{network.team}/live/agent/M !/x"),
        network.robot("a") as a,
    ):
        a.publish_map(make_map("a"))
        assert network.groups(watcher.next()) == [["a/0"]]
    assert server.stop() == 0
    assert "messages were not valid and dropped" in server.log
    assert "Traceback" not in server.log


def test_a_map_that_did_not_come_is_asked_for(
    network: Network, start_server: StartServer, make_map: MakeMap
) -> None:
    start_server()
    watcher, silent = network.watcher(), network.connect()
    parts = {"team": network.team, "robot": "a"}
    robot_map = make_map("a")

    def answer(query: zenoh.Query) -> None:
        with query:
            query.reply(keys.MAP.build(**parts), encode(MapMessage.pack(robot_map)))

    counts = dict.fromkeys(("scans_seen", "scans_placed", "components", "submaps"), 1)
    fields = {"robot": "a", "boot": robot_map.boot, "stamp": 0.0, "state": "finished"}
    status = StatusMessage.model_validate({**counts, **fields, "map_version": robot_map.version})
    with silent.declare_queryable(keys.AGENT_QUERY.build(**parts), answer):
        end, joint = time.monotonic() + network.patience, None
        while joint is None and time.monotonic() < end:
            silent.put(keys.STATUS.build(**parts), encode(status))
            joint = watcher.within(0.5)
        assert joint is not None
        assert network.groups(joint) == [["a/0"]]


def test_two_coordinators_of_a_team_say_so_both(start_server: StartServer, tmp_path: Path) -> None:
    servers = [start_server(), start_server(store=tmp_path / "other.sqlite")]
    for server in servers:
        server.wait_for_log("2 coordinators of the team are here")


@pytest.mark.usefixtures("finished_team")
def test_a_coordinator_says_what_it_holds(network: Network, found: Found) -> None:
    heard: list[bytes] = []
    key = keys.JOINT_STATUS.build(team=network.team)
    with network.connect().declare_subscriber(key, lambda s: heard.append(s.payload.to_bytes())):
        deadline = time.monotonic() + network.patience
        while not heard and time.monotonic() < deadline:
            time.sleep(0.05)
    status = decode(JointStatusMessage, heard[0])
    assert (status.version, status.pending) == (3, False)
    map_a, map_b, alignments = found
    assert status.maps == (MapVersion.of(map_a), MapVersion.of(map_b))
    assert status.alignments == ((alignments.reference, alignments.other),)
    assert {name: place.frame for name, place in status.frames.items()} == {
        "a/0": "a/0",
        "b/0": "a/0",
    }


def test_who_listened_before_a_coordinator_with_a_long_history_gets_the_latest_then_the_next(
    network: Network, start_server: StartServer, make_map: MakeMap, tmp_path: Path
) -> None:
    with Store(tmp_path / "store.sqlite", network.team) as store:
        for version in range(1, HISTORY + 1):
            message = JointMapMessage.pack(JointMap(version, (), ()), store.series)
            store.add_version(version, 0.0, encode(message))
    with ThreadPoolExecutor() as pool:
        heard = pool.submit(_versions, network, 2)
        time.sleep(1.0)  # it listens, most likely; if not, it gets the same
        start_server()
        with network.robot("a") as a:
            a.publish_map(make_map("a"))
            assert heard.result(network.patience) == [HISTORY, HISTORY + 1]


def _versions(network: Network, count: int) -> list[int]:
    joints = mapweave_protocol.joint_maps(
        network.team, connect=[network.endpoint], timeout=network.patience
    )
    return [joint.version for joint in islice(joints, count)]
