"""A mark that a person sets on a robot's map is where it should be, whatever comes of the map."""

import json
from pathlib import Path

import ezdxf.filemanagement
import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.io.map_files import read_joint, write_joint
from mapweave.maps import JointMap
from tests.fusion_server.by_hand.conftest import exported, walk
from tests.fusion_server.conftest import MakeAlignments, Network, StartServer
from tests.people import Operator

START_A, START_B = (1.0, 1.0, 0.3), (3.0, 2.0, 1.0)
SECOND = se2.compose(START_B, [2.0, 0.5, 0.2])  # b's second submap in the room
VICTIM = se2.transform_points(SECOND, [0.5, 0.3])  # (2,) in the room [m]
DRIFT = (0.4, -0.3, 0.02)  # by which that submap is off until b closes a loop
TOLERANCE = 0.1  # [m]


def seen_by_b(place: FloatArray) -> FloatArray:
    """Return a (2,) place in the room [m] in b's frame."""
    return se2.transform_points(se2.inverse(START_B), place)


def expect_victim(joint: JointMap, place: FloatArray, folder: Path) -> None:
    """Assert that the victim is at a (2,) place [m], in the map and in what it is exported to."""
    file = folder / f"joint-{joint.version}.json"
    write_joint(file, joint)
    [mark] = [mark for component in read_joint(file).components for mark in component.marks]
    assert (mark.label, mark.by, mark.component) == ("victim", "anna", "b/0")
    features = json.loads(exported(file, ".geojson").read_text())["features"]
    [point] = [f for f in features if f["properties"]["kind"] == "mark"]
    assert point["properties"]["label"] == "victim"
    drawing = ezdxf.filemanagement.readfile(exported(file, ".dxf"))
    [drawn] = drawing.modelspace().query('POINT[layer=="b_0 marks"]')
    picture = exported(file, ".svg").read_text()
    assert ">victim<" in picture
    for found in (mark.position, point["geometry"]["coordinates"], drawn.dxf.location.xyz[:2]):
        np.testing.assert_allclose(found, place, atol=TOLERANCE)


@pytest.mark.slow
def test_a_mark_is_at_its_place_before_and_after_joining_after_a_loop_and_after_parting(
    network: Network,
    start_server: StartServer,
    make_alignments: MakeAlignments,
    anna: Operator,
    tmp_path: Path,
) -> None:
    start_server()
    watcher = network.watcher()
    map_a, map_b = walk("a", START_A), walk("b", START_B, second=DRIFT)
    a_to_b = tuple(se2.between(START_A, START_B))
    believed = se2.transform_points(np.array(DRIFT), seen_by_b(VICTIM))
    with network.robot("a") as a, network.robot("b") as b:
        a.publish_map(map_a)
        watcher.next()
        b.publish_map(map_b)
        watcher.next()
        x, y = believed
        anna.orders("mark", "b", "victim", f"--at={x:.3f},{y:.3f}")
        expect_victim(watcher.next(), believed, tmp_path)

        a.publish_alignments(make_alignments(map_a, map_b, transform=a_to_b))
        joined = watcher.next()
        assert network.groups(joined) == [["a/0", "b/0"]]
        expect_victim(joined, se2.transform_points(np.array(a_to_b), believed), tmp_path)

        corrected = walk("b", START_B, version=2)
        b.publish_map(corrected)
        in_a = se2.transform_points(se2.inverse(START_A), VICTIM)
        expect_victim(watcher.next(), in_a, tmp_path)

        refused = make_alignments(map_a, corrected, "refused", reason="only 2 m in common")
        a.publish_alignments(refused)
        parted = watcher.next()
        assert network.groups(parted) == [["a/0"], ["b/0"]]
        expect_victim(parted, seen_by_b(VICTIM), tmp_path)


def test_a_mark_is_taken_back_by_its_label_and_survives_a_restart_until_then(
    network: Network, start_server: StartServer, anna: Operator
) -> None:
    server = start_server()
    watcher = network.watcher()
    with network.robot("b") as b:
        b.publish_map(walk("b", START_B))
        watcher.next()
    said = anna.orders("mark", "b/0", "door open", "--at", "7")
    assert said.startswith("door open: marked on b/0, order ")
    [component] = watcher.next().components
    [mark] = component.marks
    seventh = se2.compose([2.0, 0.5, 0.2], [0.4, 0.0, 0.0])
    np.testing.assert_allclose(mark.position, seventh[:2], atol=0.03)  # as poses travel
    server.stop()
    start_server()
    assert [m.label for c in anna.latest().components for m in c.marks] == ["door open"]
    watcher.within(1.0)
    anna.orders("mark", "b", "door open", "--undo")
    assert [m for c in anna.latest().components for m in c.marks] == [] or (
        watcher.next().components[0].marks == ()
    )


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (("mark", "b", "victim", "--at", "99"), "--at: scan 99 is not in the map of b"),
        (("mark", "b/7", "victim", "--at", "1"), "no coordinator of team T has a map of b/7"),
        (("mark", "b", "victim"), "expected --at SCAN or --at=X,Y, or --undo in its place"),
        (("mark", "b", "victim", "--undo"), "no operator's mark 'victim' on the map of b is"),
        (("pin", "a/0", "b/0", "--reason", "so"), "no coordinator of team T has a map of a/0"),
        (("forbid", "b/0", "b/0", "--reason", "so"), "b/0: expected two components"),
        (("forbid", "a/0", "b/0", "--undo", "--reason", "so"), "nothing forbidden between a/0"),
        (("forget", "c", "--reason", "so"), "c: there is no map of it"),
        (("forget", "b@other", "--reason", "so"), "b@other: its runs are first"),
        (("forget", "b", "--undo", "--reason", "so"), "no order to forget b is in force"),
    ],
)
def test_what_cannot_be_ordered_is_said_in_one_line(
    network: Network,
    start_server: StartServer,
    anna: Operator,
    words: tuple[str, ...],
    problem: str,
) -> None:
    start_server()
    watcher = network.watcher()
    with network.robot("b") as b:
        b.publish_map(walk("b", START_B))
        watcher.next()
    done = anna.types(*words)
    assert done.returncode == 1
    assert done.stderr.startswith(f"mapweave: {problem.replace(' T ', f' {network.team} ')}")
    assert len(done.stderr.splitlines()) == 1
