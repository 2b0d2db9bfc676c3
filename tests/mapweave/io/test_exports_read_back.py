"""Exports read back by the libraries of their own formats: shapely, evo and mcap."""

import json
import math
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from numpy.random import Generator

from mapweave.errors import MissingExtraError
from mapweave.io.export import export
from mapweave.maps import RobotMap
from mapweave.pictures.scene import robot_scenes
from tests.mapweave.whole_maps import joint_map, robot_map, true_poses

MILLIMETRE = 1e-3

READ_PATH = """
import json, sys
from evo.tools.file_interface import read_tum_trajectory_file
path = read_tum_trajectory_file(sys.argv[1])
print(json.dumps([path.timestamps.tolist(), path.poses_se3.__len__(),
                  [p[:2, 3].tolist() + [float(p[1, 0]), float(p[0, 0])] for p in path.poses_se3]]))
"""


def test_evo_reads_a_path_as_it_is(rng: Generator, tmp_path: Path) -> None:
    known = robot_map(rng)
    export(known, tmp_path / "path.tum")
    # It writes settings into the home that it finds.
    done = subprocess.run(
        [sys.executable, "-c", READ_PATH, str(tmp_path / "path.tum")],
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
        env={**os.environ, "HOME": str(tmp_path), "MPLBACKEND": "agg"},
    )
    stamps, count, rows = json.loads(done.stdout.splitlines()[-1])
    (scene,) = robot_scenes(known)
    stamp = np.concatenate([part.stamp for part in scene.paths])
    pose = np.concatenate([part.pose for part in scene.paths])[np.isfinite(stamp)]
    assert count == len(pose)
    np.testing.assert_allclose(stamps, stamp[np.isfinite(stamp)], atol=1e-6)
    x, y, sine, cosine = np.array(rows).T
    np.testing.assert_allclose(np.column_stack([x, y]), pose[:, :2], atol=MILLIMETRE)
    np.testing.assert_allclose(np.exp(1j * np.arctan2(sine, cosine)), np.exp(1j * pose[:, 2]))


def test_shapely_reads_walls_and_free_space_as_they_are(rng: Generator, tmp_path: Path) -> None:
    known = robot_map(rng)
    export(known, tmp_path / "map.geojson")
    features = json.loads((tmp_path / "map.geojson").read_text())["features"]
    (scene,) = robot_scenes(known)

    def union(kind: str) -> shapely.Geometry:
        chosen = [
            shapely.from_geojson(json.dumps(feature["geometry"]))
            for feature in features
            if feature["properties"]["kind"] == kind
        ]
        return shapely.union_all(chosen)

    walls = shapely.MultiLineString(scene.map.segments.reshape(-1, 2, 2).tolist())
    assert shapely.hausdorff_distance(union("polyline"), walls) < MILLIMETRE
    free = shapely.union_all([shapely.Polygon(ring) for ring in scene.map.free_space])
    assert shapely.symmetric_difference(union("free_space"), free).area < MILLIMETRE * free.length


def messages(path: Path) -> list[tuple[str, int, Any]]:
    """Return topic, time [ns] and content of all messages, as an independent reader has them."""
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        return [
            (channel.topic, message.log_time, decoded)
            for _, channel, message, decoded in reader.iter_decoded_messages()
        ]


def on(found: list[tuple[str, int, Any]], topic: str) -> list[Any]:
    return [content for name, _, content in found if name == topic]


def test_mcap_reads_walls_free_space_and_path_as_they_are(rng: Generator, tmp_path: Path) -> None:
    known = robot_map(rng, components=(0, 0, 1))
    export(known, tmp_path / "map.mcap")
    found, scenes = messages(tmp_path / "map.mcap"), robot_scenes(known)
    (walls,), (free,) = on(found, "/walls"), on(found, "/free_space")
    assert [e.id for e in walls.entities] == [e.frame_id for e in walls.entities] == ["a/0", "a/1"]
    for scene, wall, floor in zip(scenes, walls.entities, free.entities, strict=True):
        points = np.array([[p.x, p.y] for p in wall.lines[0].points])
        np.testing.assert_allclose(points.reshape(-1, 4), scene.map.segments, atol=MILLIMETRE)
        assert len(wall.lines[0].colors) == len(points)
        for loop, ring in zip(floor.lines, scene.map.free_space, strict=True):
            np.testing.assert_allclose([[p.x, p.y] for p in loop.points], ring, atol=MILLIMETRE)
    poses = [pose for told in on(found, "/path/a") for pose in told.poses]
    expected = np.concatenate([path.pose for scene in scenes for path in scene.paths])
    np.testing.assert_allclose(
        [[p.position.x, p.position.y] for p in poses], expected[:, :2], atol=MILLIMETRE
    )


def test_playing_a_recording_drives_the_sensor_in_the_order_of_time(
    rng: Generator, tmp_path: Path
) -> None:
    known = robot_map(rng)
    export(known, tmp_path / "map.mcap")
    (scene,) = robot_scenes(known)
    stamp = np.concatenate([path.stamp for path in scene.paths])
    pose = np.concatenate([path.pose for path in scene.paths])
    known_at = np.isfinite(stamp)
    order = np.argsort(stamp[known_at], kind="stable")
    drive = [(t, m) for topic, t, m in messages(tmp_path / "map.mcap") if topic == "/tf"]
    np.testing.assert_allclose([t * 1e-9 for t, _ in drive], stamp[known_at][order], atol=1e-6)
    for (_, told), expected in zip(drive, pose[known_at][order], strict=True):
        (transform,) = told.transforms
        assert (transform.parent_frame_id, transform.child_frame_id) == ("a/0", "a/0/sensor")
        turned = 2 * math.atan2(transform.rotation.z, transform.rotation.w)
        found = [transform.translation.x, transform.translation.y]
        np.testing.assert_allclose(found, expected[:2], atol=MILLIMETRE)
        assert math.remainder(turned - expected[2], 2 * math.pi) == pytest.approx(0, abs=1e-6)


def test_of_a_joint_map_walls_are_coloured_by_confidence(rng: Generator, tmp_path: Path) -> None:
    maps = [robot_map(rng, "a"), robot_map(rng, "b")]
    joint = joint_map(maps, true_poses(maps))
    (component,) = joint.components
    sure = np.linspace(0, 1, len(component.segment_confidence))
    coloured = replace(joint, components=(replace(component, segment_confidence=sure),))
    export(coloured, tmp_path / "joint.mcap")
    (walls,) = on(messages(tmp_path / "joint.mcap"), "/walls")
    colours = np.array([[c.r, c.g] for c in walls.entities[0].lines[0].colors])
    np.testing.assert_allclose(colours[::2, 1], 0.6 * sure, atol=1e-6)
    np.testing.assert_array_equal(colours[::2], colours[1::2])


def test_the_same_map_gives_the_same_recording_and_an_empty_one_a_readable_one(
    rng: Generator, tmp_path: Path
) -> None:
    known = robot_map(rng)
    for name in ("one", "other"):
        export(known, tmp_path / f"{name}.mcap")
    assert (tmp_path / "one.mcap").read_bytes() == (tmp_path / "other.mcap").read_bytes()
    export(RobotMap("a", "0", 1, ()), tmp_path / "empty.mcap")
    assert [topic for topic, _, _ in messages(tmp_path / "empty.mcap")] == [
        "/walls",
        "/free_space",
        "/marks",
    ]


def test_without_foxglove_a_recording_names_the_extra(
    rng: Generator, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "foxglove", None)
    with pytest.raises(MissingExtraError, match=r"mapweave\[foxglove\]"):
        export(robot_map(rng), tmp_path / "map.mcap")
    assert list(tmp_path.iterdir()) == []
