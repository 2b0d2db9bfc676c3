"""What a person orders goes before evidence, is told under the person's name, and is taken back."""

import http.client
import json
import re
import signal
import subprocess
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.io.map_files import read_joint, write_joint
from mapweave.maps import RobotMap, Submap
from mapweave.orders import OrderEffect, OrderKind
from mapweave_protocol.link.asking import ask_orders
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.keys import ORDER
from tests.fusion_server.by_hand.conftest import walk
from tests.fusion_server.conftest import (
    MAPWEAVE,
    MakeAlignments,
    Network,
    ServerProcess,
    StartServer,
)
from tests.people import Operator

START_A, START_B = (1.0, 1.0, 0.3), (3.0, 2.0, -2.0)
A_TO_B = se2.between(START_A, START_B)


def _with(robot_map: RobotMap, submaps: tuple[Submap, ...]) -> RobotMap:
    return replace(robot_map, submaps=submaps)


def _shifted(submap: Submap, motion: FloatArray) -> Submap:
    return replace(submap, pose=se2.compose(motion, submap.pose))


def _numbered(submap: Submap, component: int) -> Submap:
    return replace(submap, component=component)


@pytest.mark.slow
def test_a_pin_joins_moves_with_the_maps_and_is_undone(
    network: Network, start_server: StartServer, anna: Operator, tmp_path: Path
) -> None:
    server = start_server()
    watcher = network.watcher()
    with network.robot("a") as a, network.robot("b") as b:
        a.publish_map(walk("a", START_A))
        watcher.next()
        b.publish_map(walk("b", START_B))
        assert network.groups(watcher.next()) == [["a/0"], ["b/0"]]
        x, y, turn = A_TO_B
        where = f"--transform={x:.3f},{y:.3f},{np.degrees(turn):.2f}"
        anna.orders("pin", "a/0", "b/0", where, "--reason", "same door")
        pinned = watcher.next()
        [component] = pinned.components
        np.testing.assert_allclose(component.robots["b/0"], A_TO_B, atol=0.05)
        [alignment] = pinned.alignments
        assert alignment.reason == "pinned by anna: same door"
        write_joint(tmp_path / "joint.json", pinned)
        [order] = read_joint(tmp_path / "joint.json").orders
        assert (order.by, order.kind, order.reason) == ("anna", OrderKind.PIN, "same door")
        assert (order.reference, order.other) == ("a/0", "b/0")
        [written] = json.loads((tmp_path / "joint.json").read_text())["orders"]
        np.testing.assert_allclose(written["transform"], A_TO_B, atol=0.01)

        # All of b is corrected: in its frame everything lies elsewhere, the rooms are still one.
        shift = np.array([5.0, -2.0, 0.4])
        moved = walk("b", START_B, version=2)
        submaps = tuple(_shifted(submap, shift) for submap in moved.submaps)
        b.publish_map(_with(moved, submaps))
        [component] = watcher.next().components
        expected = se2.compose(A_TO_B, se2.inverse(shift))
        np.testing.assert_allclose(component.robots["b/0"], expected, atol=0.1)
    server.stop(signal.SIGKILL)
    start_server()
    assert network.groups(anna.latest()) == [["a/0", "b/0"]]
    anna.orders("pin", "b/0", "a/0", "--undo", "--reason", "wrong door")
    joint = watcher.next()
    while joint.orders:
        joint = watcher.next()
    assert network.groups(joint) == [["a/0"], ["b/0"]]


@pytest.mark.slow
def test_what_was_found_is_confirmed_without_saying_how_it_lies(
    network: Network, start_server: StartServer, make_alignments: MakeAlignments, anna: Operator
) -> None:
    start_server()
    watcher = network.watcher()
    map_a, map_b = walk("a", START_A), walk("b", START_B)
    with network.robot("a") as a, network.robot("b") as b:
        a.publish_map(map_a)
        watcher.next()
        b.publish_map(map_b)
        watcher.next()
        doubtful = make_alignments(
            map_a, map_b, "ambiguous", transform=tuple(A_TO_B), evidence={"common": 9.0}
        )
        a.publish_alignments(doubtful)
        assert network.groups(watcher.next()) == [["a/0"], ["b/0"]]
        anna.orders("pin", "b/0", "a/0", "--reason", "I was there")
        joint = watcher.next()
    [alignment] = joint.alignments
    assert alignment.decision == "accepted"
    assert alignment.reason == "pinned by anna: I was there; 40 m of wall in common"
    assert network.groups(joint) == [["a/0", "b/0"]]


@pytest.mark.slow
def test_what_is_forbidden_comes_apart_and_stays_apart_until_it_is_taken_back(
    network: Network, start_server: StartServer, make_alignments: MakeAlignments, anna: Operator
) -> None:
    server = start_server()
    watcher = network.watcher()
    map_a, map_b = walk("a", START_A), walk("b", START_B)
    with network.robot("a") as a, network.robot("b") as b:
        a.publish_map(map_a)
        watcher.next()
        b.publish_map(map_b)
        watcher.next()
        a.publish_alignments(make_alignments(map_a, map_b, transform=tuple(A_TO_B)))
        assert network.groups(watcher.next()) == [["a/0", "b/0"]]
        anna.orders("forbid", "a/0", "b/0", "--reason", "two floors")
        parted = watcher.next()
        assert network.groups(parted) == [["a/0"], ["b/0"]]
        [alignment] = parted.alignments
        told = "revoked in version 4: forbidden by anna: two floors; 40 m of wall in common"
        assert alignment.reason == told
        again = walk("b", START_B, version=2)
        a.publish_alignments(
            make_alignments(map_a, again, transform=tuple(A_TO_B), confidence=0.99)
        )
        b.publish_map(again)
        joint = watcher.next()
        while joint.version < 5 or not joint.orders:
            joint = watcher.next()
        assert network.groups(joint) == [["a/0"], ["b/0"]]
    server.wait_for_log("anna forbids a/0 and b/0: two floors")
    said = anna.orders(
        "forbid", "a/0", "b/0", "--undo", "--reason", "one floor after all", "--json"
    )
    taken_back = json.loads(said)
    assert taken_back["order"] == joint.orders[0].id
    assert (taken_back["kind"], taken_back["taken_back"]) == ("forbid", True)
    assert taken_back["components"] == ["a/0", "b/0"]
    while joint.orders:
        joint = watcher.next()
    assert network.groups(joint) == [["a/0", "b/0"]]
    server.wait_for_log("taken back: anna forbids a/0 and b/0")


def _post(server: ServerProcess, wish: dict[str, str]) -> int:
    """Return the status of what the server's page answers to an order."""
    server.wait_for_log("live page: ")
    found = re.search(r"live page: http://([^/]+)/#token=(\S+)", server.log)
    assert found is not None
    connection = http.client.HTTPConnection(found[1], timeout=Network.patience)
    headers = {"Content-Type": "application/json", "X-Mapweave-Token": found[2]}
    connection.request("POST", "/api/orders", json.dumps(wish), headers)
    status = connection.getresponse().status
    connection.close()
    return status


@pytest.mark.slow
def test_what_is_ordered_on_the_page_is_in_the_next_version_and_kept_by_the_coordinator(
    network: Network, start_server: StartServer, make_alignments: MakeAlignments, anna: Operator
) -> None:
    server = start_server("--http", "127.0.0.1:0")
    watcher = network.watcher()
    map_a, map_b = walk("a", START_A), walk("b", START_B)
    with network.robot("a") as a, network.robot("b") as b:
        a.publish_map(map_a)
        watcher.next()
        b.publish_map(map_b)
        watcher.next()
        a.publish_alignments(make_alignments(map_a, map_b, transform=tuple(A_TO_B)))
        assert network.groups(watcher.next()) == [["a/0", "b/0"]]
    wish = {"kind": "forbid", "reference": "a/0", "other": "b/0", "by": "ben", "reason": "no"}
    assert _post(server, wish) == 202
    parted = watcher.next()
    assert network.groups(parted) == [["a/0"], ["b/0"]]
    [order] = parted.orders
    assert (order.by, order.reason) == ("ben", "no")
    server.stop()
    start_server()
    [kept] = ask_orders(network.connect(), network.team) or []
    assert kept.id == order.id
    anna.orders("forbid", "a/0", "b/0", "--undo", "--reason", "yes")


@pytest.mark.slow
def test_what_a_robot_mapped_leaves_the_joint_map_by_an_order_only_and_comes_back(
    network: Network, start_server: StartServer, anna: Operator
) -> None:
    server = start_server()
    watcher = network.watcher()
    with network.robot("a") as a:
        a.publish_map(walk("a", START_A))
        watcher.next()
    with network.robot("a") as a:
        later = walk("a", START_A, boot="second")
        renumbered = tuple(_numbered(submap, 1) for submap in later.submaps)
        a.publish_map(_with(later, renumbered))
        assert network.groups(watcher.next()) == [["a/0"], ["a/1"]]
    said = anna.orders("forget", "a@first", "--reason", "driven by hand")
    assert said.startswith("a: forgotten: first, order ")
    joint = watcher.next()
    assert network.groups(joint) == [["a/1"]]
    [order] = joint.orders
    assert (order.robot, order.boots, order.effect) == ("a", ("first",), OrderEffect.IN_FORCE)
    server.stop()
    start_server()
    assert network.groups(anna.latest()) == [["a/1"]]
    anna.orders("forget", "a", "--undo", "--reason", "it was fine")
    while joint.orders:
        joint = watcher.next()
    assert network.groups(joint) == [["a/0"], ["a/1"]]


@pytest.mark.slow
def test_who_watches_is_told_of_marks_and_orders(
    network: Network, start_server: StartServer, anna: Operator, tmp_path: Path
) -> None:
    start_server()
    watcher = network.watcher()
    with network.robot("a") as a:
        a.publish_map(walk("a", START_A))
        watcher.next()
    where = ["--team", network.team, "--connect", network.endpoint]
    said = tmp_path / "said"
    with said.open("w") as out, subprocess.Popen([MAPWEAVE, "watch", *where], stdout=out) as watch:
        try:
            _wait_for(said, "joint map 1")
            anna.orders("mark", "a", "victim", "--at", "3")
            _wait_for(said, "anna marks 'victim' at ")
            anna.orders("forget", "a", "--reason", "driven by hand")
            _wait_for(said, "anna forgets a@first: driven by hand")
        finally:
            watch.terminate()


def _wait_for(file: Path, text: str) -> None:
    deadline = time.monotonic() + Network.patience
    while text not in file.read_text():
        assert time.monotonic() < deadline, file.read_text()
        time.sleep(0.1)


def test_an_order_heard_twice_is_one_order(
    network: Network, start_server: StartServer, anna: Operator
) -> None:
    start_server()
    watcher = network.watcher()
    with network.robot("a") as a:
        a.publish_map(walk("a", START_A))
        watcher.next()
    anna.orders("mark", "a", "victim", "--at", "3")
    assert len(watcher.next().components[0].marks) == 1
    connection = network.connect()
    [order] = ask_orders(connection, network.team) or []
    key = ORDER.build(team=network.team, name="anna", order="mark")
    connection.put(key, encode(order))
    assert watcher.within(1.0) is None
