"""What other programs get is what the map holds."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from numpy.random import Generator

from mapweave.cli import main
from mapweave.errors import FileError
from mapweave.io.export import EXPORT_SUFFIXES, export
from mapweave.io.exporters.geojson import DECIMALS
from mapweave.io.map_files import write_joint, write_map
from mapweave.maps import JointMap, LineMap, RobotMap, Trajectory
from mapweave.pictures.scene import robot_scenes
from tests.mapweave.whole_maps import joint_map, robot_map, true_poses

DRAWINGS = [suffix for suffix in EXPORT_SUFFIXES if suffix not in (".yaml", ".tum", ".mcap")]
TOLERANCE = 0.51 * 10.0**-DECIMALS


def exported(some_map: RobotMap | JointMap, folder: Path) -> dict[str, Any]:
    """Return the GeoJSON of `some_map`, read strictly: no NaN, which JSON does not have."""
    path = folder / "map.geojson"
    export(some_map, path)
    content: dict[str, Any] = json.loads(path.read_text(), parse_constant=pytest.fail)
    return content


def of_kind(content: dict[str, Any], kind: str, component: str | None = None) -> list[Any]:
    return [
        feature
        for feature in content["features"]
        if feature["properties"]["kind"] == kind
        and component in (None, feature["properties"]["component"])
    ]


def line_map_of(features: list[Any]) -> LineMap:
    """Return the walls of polyline features as a line map."""
    lines = [
        [f["geometry"]["coordinates"]]
        if f["geometry"]["type"] == "LineString"
        else f["geometry"]["coordinates"]
        for f in features
    ]
    return LineMap(
        np.concatenate([np.reshape(each, (-1, 4)) for each in lines]),
        np.repeat(np.arange(len(lines)), [len(each) for each in lines]),
        np.concatenate([f["properties"]["support"] for f in features]),
    )


def test_geojson_holds_every_wall_in_its_polyline_with_its_support(
    rng: Generator, tmp_path: Path
) -> None:
    known = robot_map(rng, components=(0, 0, 1))
    content = exported(known, tmp_path)
    for component in known.components:
        expected = known.lines(component)
        found = line_map_of(of_kind(content, "polyline", f"a/{component}"))
        np.testing.assert_allclose(found.segments, expected.segments, rtol=0, atol=TOLERANCE)
        np.testing.assert_array_equal(found.polyline, expected.polyline)
        np.testing.assert_array_equal(found.support, expected.support)


def test_geojson_holds_the_free_space_as_closed_counter_clockwise_rings(
    rng: Generator, tmp_path: Path
) -> None:
    """RFC 7946, 3.1.6; the map's own rings may run either way."""
    known = robot_map(rng)
    expected = known.lines(0).free_space
    found = of_kind(exported(known, tmp_path), "free_space")
    assert len(found) == len(expected)
    for feature, ring in zip(found, expected, strict=True):
        (coordinates,) = feature["geometry"]["coordinates"]
        assert coordinates[0] == coordinates[-1]
        assert shapely.LinearRing(coordinates).is_ccw
        difference = shapely.Polygon(coordinates).symmetric_difference(shapely.Polygon(ring))
        assert difference.area < 0.05


def test_geojson_holds_each_stretch_of_the_path_with_its_scans(
    rng: Generator, tmp_path: Path
) -> None:
    """Consecutive submaps of a component make one line; while the robot was elsewhere is none."""
    known = robot_map(rng, components=(0, 1, 0))
    content = exported(known, tmp_path)
    found = of_kind(content, "trajectory")
    assert [f["properties"]["component"] for f in found] == ["a/0", "a/0", "a/1"]
    paths = [path for scene in robot_scenes(known) for path in scene.paths]
    for feature, path in zip(found, paths, strict=True):
        coordinates = np.array(feature["geometry"]["coordinates"])
        np.testing.assert_allclose(coordinates, path.pose[:, :2], rtol=0, atol=TOLERANCE)
        assert feature["properties"]["scan_index"] == path.scan_index.tolist()
    unknown = [stamp for f in found for stamp in f["properties"]["stamp"] if stamp is None]
    assert len(unknown) == 1


def test_geojson_of_a_joint_map_holds_confidence_and_each_robots_place(
    rng: Generator, tmp_path: Path
) -> None:
    maps = [robot_map(rng, "a"), robot_map(rng, "b")]
    joint = joint_map(maps, true_poses(maps))
    content = exported(joint, tmp_path)
    polylines = of_kind(content, "polyline")
    confidence = np.concatenate([f["properties"]["confidence"] for f in polylines])
    expected = joint.components[0]
    np.testing.assert_allclose(confidence, expected.segment_confidence, rtol=0, atol=TOLERANCE)
    assert content["components"] == [
        {"component": "a/0 + b/0", "robots": ["a/0", "b/0"], "confidence": 0.93}
    ]
    places = {
        f["properties"]["origin_of"]: [*f["geometry"]["coordinates"], f["properties"]["theta"]]
        for f in of_kind(content, "robot")
    }
    assert list(places) == ["a/0", "b/0"]
    for name, pose in expected.robots.items():
        np.testing.assert_allclose(places[name], pose, rtol=0, atol=TOLERANCE)


def test_geojson_says_that_its_coordinates_are_nowhere_on_earth(
    rng: Generator, tmp_path: Path
) -> None:
    content = exported(robot_map(rng), tmp_path)
    assert content["type"] == "FeatureCollection"
    assert content["crs"] is None
    # RFC 7946, 7.1: what belongs to other GeoJSON types may not stand in a collection.
    assert not {"coordinates", "geometry", "geometries", "properties"} & content.keys()
    assert "not longitude and latitude" in content["frame"]


def test_a_path_of_one_scan_is_a_point(rng: Generator, tmp_path: Path) -> None:
    """A GeoJSON line has two positions or more."""
    known = robot_map(rng, stretches=[(0.0, 12.0)], components=[0])
    whole = known.submaps[0]
    one = type(whole.trajectory)(
        whole.trajectory.scan_index[:1], whole.trajectory.stamp[:1], whole.trajectory.pose[:1]
    )
    submap = type(whole)(0, 0, whole.pose, whole.map, one)
    content = exported(RobotMap("a", "boot", 1, (submap,)), tmp_path)
    (feature,) = of_kind(content, "trajectory")
    assert feature["geometry"]["type"] == "Point"


@pytest.mark.parametrize("suffix", EXPORT_SUFFIXES)
def test_the_same_map_gives_the_same_bytes(suffix: str, rng: Generator, tmp_path: Path) -> None:
    known = robot_map(rng)
    first, second = tmp_path / "first", tmp_path / "second"
    for folder in (first, second):
        folder.mkdir()
        export(known, folder / f"map{suffix}")
    assert {file.name: file.read_bytes() for file in first.iterdir()} == {
        file.name: file.read_bytes() for file in second.iterdir()
    }


@pytest.mark.parametrize("suffix", [".yaml", ".tum"])
def test_a_grid_or_a_path_of_nothing_is_refused(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"nothing{suffix}"
    for nothing in (RobotMap("a", "boot", 0, ()), JointMap(1, (), ())):
        with pytest.raises(FileError, match="expected"):
            export(nothing, path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("walls", [0, 1])
def test_a_path_is_of_where_the_robot_drove_also_where_no_wall_is_of_its_own(
    walls: int, rng: Generator, tmp_path: Path
) -> None:
    stored, driven = robot_map(rng, components=(0, 1, 1)).submaps[:2]
    stored = replace(stored, trajectory=Trajectory.empty())
    driven = replace(driven, map=LineMap.empty())
    path = tmp_path / "driven.tum"
    export(RobotMap("a", "boot", 0, (stored, driven)[1 - walls :]), path)
    head, *lines = path.read_text().splitlines()
    assert head.startswith("# component a/1")
    assert sum(not line.startswith("#") for line in lines) == len(driven.trajectory.stamp)


@pytest.mark.parametrize("suffix", DRAWINGS)
def test_a_map_of_nothing_can_be_exported(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"nothing{suffix}"
    export(RobotMap("a", "boot", 0, ()), path)
    export(JointMap(1, (), ()), path)
    assert path.stat().st_size > 0


@pytest.mark.parametrize("suffix", [".txt", "", ".pgm", ".bag"])
def test_an_unknown_suffix_is_refused_and_the_known_ones_named(
    suffix: str, rng: Generator, tmp_path: Path
) -> None:
    path = tmp_path / f"map{suffix}"
    with pytest.raises(FileError) as refusal:
        export(robot_map(rng), path)
    assert ".svg, .png, .geojson" in str(refusal.value)
    assert not path.exists()


@pytest.mark.parametrize("suffix", [*DRAWINGS, ".yaml"])
def test_an_existing_file_survives_a_failure(suffix: str, rng: Generator, tmp_path: Path) -> None:
    known = robot_map(rng)
    known.submaps[0].map.segments[0, 0] = np.nan
    path = tmp_path / f"map{suffix}"
    path.write_text("what was there")
    with pytest.raises((ValueError, FileError), match=r"NaN|nan|JSON"):
        export(known, path)
    assert path.read_text() == "what was there"
    assert list(tmp_path.iterdir()) == [path]


def test_the_command_reads_either_kind_of_map(rng: Generator, tmp_path: Path) -> None:
    maps = [robot_map(rng, "a"), robot_map(rng, "b")]
    write_map(tmp_path / "map.json", maps[0])
    write_joint(tmp_path / "joint.json", joint_map(maps, true_poses(maps)))
    for name in ("map", "joint"):
        output = tmp_path / f"{name}.geojson"
        assert main(["export", str(tmp_path / f"{name}.json"), str(output)]) == 0
        assert json.loads(output.read_text())["features"]


def test_the_command_fails_in_one_line_that_names_the_file(
    rng: Generator, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "map.json"
    write_map(source, robot_map(rng))
    wrong: list[tuple[Path, Path]] = [
        (source, tmp_path / "map.bag"),
        (source, tmp_path / "no" / "folder.svg"),
        (tmp_path / "missing.json", tmp_path / "map.svg"),
    ]
    for given, output in wrong:
        assert main(["export", str(given), str(output)]) == 1
        lines = capsys.readouterr().err.splitlines()
        assert len(lines) == 1
        assert str(given) in lines[0] or str(output) in lines[0]
    assert list(tmp_path.iterdir()) == [source]
