"""Marks and orders in files: as they were, checked field by field, and shown by every export."""

import copy
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import ezdxf.filemanagement
import numpy as np
import pytest
from numpy.random import Generator

from mapweave.anchors import anchored, placed_marks
from mapweave.errors import FileError
from mapweave.io.export import export
from mapweave.io.map_files import read_joint, read_map, write_joint, write_map
from mapweave.maps import JointMap, RobotMap
from mapweave.marks import Anchor, Mark, PlacedMark
from mapweave.orders import Order, OrderEffect, OrderKind
from mapweave.pictures.layout import arrange
from mapweave.pictures.scene import robot_scenes
from tests.mapweave.whole_maps import joint_map, robot_map, true_poses

PIN = Order("o1", OrderKind.PIN, "anna", 5.5, "same door", "a/0", "b/0", np.array([1.0, 2.0, 0.5]))
BAN = Order(
    "o2", OrderKind.FORBID, "ben", 6.5, "two floors", "a/0", "c/0", effect=OrderEffect.WAITS
)
FORGET = Order("o3", OrderKind.FORGET, "anna", 7.0, "by hand", robot="a", boots=("x", "y"))


def marked(rng: Generator) -> RobotMap:
    """Return a map with a victim and, held by a submap alone, a door."""
    some_map = robot_map(rng)
    found = anchored(some_map.submaps, 0, np.array([1.5, -0.25]))
    assert found is not None
    victim = Mark("m1", "victim", "anna", 1.25, *found)
    door = Mark("m2", "door <b>", "r1", 2.5, Anchor(1, None), np.array([0.5, 0.75]))
    return replace(some_map, marks=(victim, door))


def ordered(rng: Generator) -> JointMap:
    """Return a joint map with a mark, and orders of every kind."""
    maps = [robot_map(rng, "a"), robot_map(rng, "b")]
    joint = joint_map(maps, true_poses(maps))
    mark = PlacedMark("m1", "victim", "anna", 1.25, "b/0", np.array([3.5, -1.25]))
    [component] = joint.components
    return replace(
        joint, components=(replace(component, marks=(mark,)),), orders=(PIN, BAN, FORGET)
    )


def test_the_marks_of_a_robots_map_come_back_as_they_were(rng: Generator, tmp_path: Path) -> None:
    before = marked(rng)
    write_map(tmp_path / "map.json", before)
    after = read_map(tmp_path / "map.json")
    for one, other in zip(before.marks, after.marks, strict=True):
        told = [(m.id, m.label, m.by, m.time, m.anchor) for m in (one, other)]
        assert told[0] == told[1]
        np.testing.assert_allclose(one.position, other.position, atol=1e-4)


def test_the_marks_and_orders_of_a_joint_map_come_back_as_they_were(
    rng: Generator, tmp_path: Path
) -> None:
    write_joint(tmp_path / "joint.json", ordered(rng))
    after = read_joint(tmp_path / "joint.json")
    [mark] = after.components[0].marks
    assert (mark.id, mark.label, mark.by, mark.component) == ("m1", "victim", "anna", "b/0")
    np.testing.assert_allclose(mark.position, [3.5, -1.25])
    for one, other in zip((PIN, BAN, FORGET), after.orders, strict=True):
        assert (one.id, one.kind, one.by, one.time) == (other.id, other.kind, other.by, other.time)
        assert (one.reason, one.effect, one.boots) == (other.reason, other.effect, other.boots)
        assert (one.reference, one.other, one.robot) == (other.reference, other.other, other.robot)
    assert after.orders[0].transform is not None and PIN.transform is not None
    np.testing.assert_allclose(after.orders[0].transform, PIN.transform)


def test_a_file_without_marks_and_orders_does_not_name_them(rng: Generator, tmp_path: Path) -> None:
    maps = [robot_map(rng, "a"), robot_map(rng, "b")]
    write_map(tmp_path / "map.json", maps[0])
    write_joint(tmp_path / "joint.json", joint_map(maps, true_poses(maps)))
    for name in ("map.json", "joint.json"):
        text = (tmp_path / name).read_text()
        assert '"marks"' not in text and '"orders"' not in text


@pytest.mark.parametrize(
    ("file", "steps", "value", "place"),
    [
        ("map", ("marks", 0, "label"), "", "marks[0].label"),
        ("map", ("marks", 0, "label"), "a\u001b[2J", "marks[0].label"),
        ("map", ("marks", 0, "position"), [1.0], "marks[0].position"),
        ("map", ("marks", 0, "by"), "Anna", "marks[0].by"),
        ("map", ("marks", 1, "scan"), -1, "marks[1].scan"),
        ("joint", ("components", 0, "marks", 0, "component"), "b", "marks[0].component"),
        ("joint", ("orders", 0, "kind"), "wish", "orders[0].kind"),
        ("joint", ("orders", 0, "transform"), [1.0, 2.0], "orders[0].transform"),
        ("joint", ("orders", 1, "effect"), "maybe", "orders[1].effect"),
    ],
)
def test_what_is_wrong_with_a_mark_or_an_order_is_named(
    rng: Generator,
    tmp_path: Path,
    file: str,
    steps: tuple[str | int, ...],
    value: object,
    place: str,
) -> None:
    path = tmp_path / "file.json"
    if file == "map":
        write_map(path, marked(rng))
    else:
        write_joint(path, ordered(rng))
    content: Any = json.loads(path.read_text())
    changed = copy.deepcopy(content)
    target = changed
    for step in steps[:-1]:
        target = target[step]
    target[steps[-1]] = value
    path.write_text(json.dumps(changed))
    with pytest.raises(FileError) as refused:
        (read_map if file == "map" else read_joint)(path)
    assert place in str(refused.value)


def test_exports_of_a_robots_map_show_its_marks_where_they_are(
    rng: Generator, tmp_path: Path
) -> None:
    some_map = marked(rng)
    places = {mark.label: mark.position for mark in placed_marks(some_map)}
    for suffix in (".geojson", ".dxf", ".svg", ".png"):
        export(some_map, tmp_path / f"map{suffix}")
    features = json.loads((tmp_path / "map.geojson").read_text())["features"]
    points = [f for f in features if f["properties"]["kind"] == "mark"]
    drawing = ezdxf.filemanagement.readfile(tmp_path / "map.dxf")
    space = drawing.modelspace()
    drawn = {t.dxf.text: t.dxf.insert.xyz[:2] for t in space.query('TEXT[layer=="a_0 marks"]')}
    assert len(points) == len(drawn) == 2
    for point in points:
        label = point["properties"]["label"]
        np.testing.assert_allclose(point["geometry"]["coordinates"], places[label], atol=1e-3)
        np.testing.assert_allclose(drawn[label], places[label], atol=1e-3)
    assert ">victim<" in (tmp_path / "map.svg").read_text()


def test_a_mark_far_out_is_on_the_sheet(rng: Generator) -> None:
    some_map = marked(rng)
    far = replace(some_map.marks[1], position=np.array([80.0, 5.0]))
    [scene] = robot_scenes(replace(some_map, marks=(far,)))
    [placed] = arrange([scene])
    low, high = placed.box
    turn, step = placed.pose[2], placed.pose[:2]
    [mark] = scene.marks
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    at = rotation @ mark.position + step
    assert np.all(low <= at + 1e-9) and np.all(at <= high + 1e-9)
