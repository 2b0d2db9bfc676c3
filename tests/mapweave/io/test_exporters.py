"""Grids, paths and drawings, read back by readers that know nothing of what wrote them."""

import math
import sys
from dataclasses import dataclass
from pathlib import Path

import ezdxf.filemanagement
import numpy as np
import pytest
import shapely
from ezdxf.document import Drawing
from ezdxf.entities.line import Line
from ezdxf.entities.lwpolyline import LWPolyline
from numpy.random import Generator
from numpy.typing import NDArray
from ruamel.yaml import YAML

from mapweave.errors import FileError, MissingExtraError
from mapweave.geometry.arrays import FloatArray
from mapweave.io.export import export
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave.pictures.scene import robot_scenes
from tests.mapweave.whole_maps import joint_map, robot_map, true_poses


@dataclass(frozen=True)
class Loaded:
    """A grid as a map server has it, by its own rules: free 0, occupied 100, unknown -1."""

    cells: NDArray[np.int8]  # rows upwards
    resolution: float
    origin: list[float]

    def at(self, points: FloatArray) -> NDArray[np.int8]:
        """Return the cells that points (n, 2) are in."""
        column, row = ((points - self.origin[:2]) / self.resolution).astype(int).T
        found: NDArray[np.int8] = self.cells[row, column]
        return found

    @property
    def middles(self) -> FloatArray:
        """(rows, columns, 2) the middle of each cell."""
        rows, columns = np.indices(self.cells.shape)
        numbers = np.stack([columns, rows], axis=-1).astype(np.float64)
        middles: FloatArray = (numbers + 0.5) * self.resolution + self.origin[:2]
        return middles


def load_grid(path: Path) -> Loaded:
    settings = YAML(typ="safe").load(path.read_text())
    magic, size, maximum, pixels = (path.parent / settings["image"]).read_bytes().split(b"\n", 3)
    assert (magic, maximum, settings["mode"], settings["negate"]) == (b"P5", b"255", "trinary", 0)
    columns, rows = map(int, size.split())
    picture = np.frombuffer(pixels, dtype=np.uint8).reshape(rows, columns)[::-1]
    occupancy = (255 - picture.astype(float)) / 255
    cells = np.full(picture.shape, -1, dtype=np.int8)
    cells[occupancy > settings["occupied_thresh"]] = 100
    cells[occupancy < settings["free_thresh"]] = 0
    return Loaded(cells, settings["resolution"], settings["origin"])


def square(*, walls: list[list[float]] | None = None) -> RobotMap:
    """Return a room of 2 m by 1 m, seen through; its walls at half a cell."""
    corners = [[0.025, 0.025], [2.025, 0.025], [2.025, 1.025], [0.025, 1.025]]
    segments = walls or [[*a, *b] for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    line_map = LineMap(
        np.array(segments),
        np.zeros(len(segments), dtype=np.int64),
        np.ones(len(segments), dtype=np.int64),
        (np.array(corners),),
    )
    path = Trajectory(np.array([0, 1]), np.array([1e9 + 0.125, math.nan]), np.zeros((2, 3)))
    return RobotMap("a", "boot", 1, (Submap(0, 0, np.zeros(3), line_map, path),))


def test_a_grid_is_occupied_at_walls_free_within_and_unknown_without(tmp_path: Path) -> None:
    export(square(), tmp_path / "room.yaml")
    grid = load_grid(tmp_path / "room.yaml")
    assert grid.cells.shape == (20 + 3, 40 + 3)  # a wall's cell at the far side, and the margin
    expected = np.full(grid.cells.shape, -1)
    expected[1:22, 1:42] = 100
    expected[2:21, 2:41] = 0
    np.testing.assert_array_equal(grid.cells, expected)
    assert grid.origin == [-0.05, -0.05, 0.0]


def test_unknown_cells_are_unknown_also_to_who_rounds_differently(tmp_path: Path) -> None:
    export(square(), tmp_path / "room.yaml")
    text = (tmp_path / "room.yaml").read_text()
    assert "free_thresh: 0.196\n" in text
    assert 205 in (tmp_path / "room.pgm").read_bytes().split(b"\n", 3)[3]
    assert np.float32(0.196) < np.float32(50 / 255)  # a map server computes in 32 or in 64 bits


def test_every_wall_is_in_a_cell_and_no_unknown_cell_is_free(
    rng: Generator, tmp_path: Path
) -> None:
    known = robot_map(rng)
    export(known, tmp_path / "map.yaml")
    grid, (scene,) = load_grid(tmp_path / "map.yaml"), robot_scenes(known)
    ends = scene.map.segments.reshape(-1, 2)
    middles = scene.map.segments.reshape(-1, 2, 2).mean(axis=1)
    assert (grid.at(np.concatenate([ends, middles])) == 100).all()
    seen = shapely.union_all([shapely.Polygon(ring) for ring in scene.map.free_space])
    free, unknown = grid.middles[grid.cells == 0], grid.middles[grid.cells == -1]
    assert len(free) > 1000 < len(unknown)
    assert shapely.contains_xy(seen, *free.T).all()
    assert not shapely.contains_xy(seen, *unknown.T).any()


@pytest.mark.parametrize("suffix", [".yaml", ".tum"])
def test_of_several_components_the_largest_is_written_and_the_others_are_named(
    suffix: str, rng: Generator, tmp_path: Path
) -> None:
    path = tmp_path / f"map{suffix}"
    export(robot_map(rng, components=(0, 1, 1)), path)
    text = path.read_text()
    assert text.startswith("# component a/1")
    assert "# left out, in frames of their own: a/0\n" in text


def test_a_map_too_large_for_a_grid_is_refused(tmp_path: Path) -> None:
    far = square(walls=[[0.0, 0.0, 1e6, 1e6]])
    with pytest.raises(FileError, match=r"the map is 1000000 m by 1000000 m; expected"):
        export(far, tmp_path / "map.yaml")
    assert list(tmp_path.iterdir()) == []


def test_a_name_that_yaml_would_misread_is_quoted(tmp_path: Path) -> None:
    export(square(), tmp_path / 'a: "b" #1.yaml')
    assert load_grid(tmp_path / 'a: "b" #1.yaml').cells.any()


def test_a_path_has_the_pose_of_each_scan_that_has_a_stamp(rng: Generator, tmp_path: Path) -> None:
    known = robot_map(rng)
    export(known, tmp_path / "path.tum")
    rows = np.loadtxt(tmp_path / "path.tum")
    (scene,) = robot_scenes(known)
    stamp = np.concatenate([part.stamp for part in scene.paths])
    pose = np.concatenate([part.pose for part in scene.paths])[np.isfinite(stamp)]
    np.testing.assert_allclose(rows[:, 0], stamp[np.isfinite(stamp)])
    np.testing.assert_allclose(rows[:, 1:3], pose[:, :2], atol=1e-6)
    np.testing.assert_allclose(np.hypot(rows[:, 6], rows[:, 7]), 1.0, atol=1e-8)
    turned = np.exp(2j * np.arctan2(rows[:, 6], rows[:, 7]))
    np.testing.assert_allclose(turned, np.exp(1j * pose[:, 2]), atol=1e-8)
    assert not rows[:, 3:6].any()


def test_stamps_since_1970_keep_their_fractions(tmp_path: Path) -> None:
    export(square(), tmp_path / "path.tum")
    assert (tmp_path / "path.tum").read_text().splitlines()[1].startswith("1000000000.125000")


def test_a_joint_map_has_no_path(rng: Generator, tmp_path: Path) -> None:
    maps = [robot_map(rng, "a"), robot_map(rng, "b")]
    with pytest.raises(FileError, match="a joint map holds no paths; expected a robot's map"):
        export(joint_map(maps, true_poses(maps)), tmp_path / "path.tum")


def lines_on(drawing: Drawing, layer: str) -> FloatArray:
    found = drawing.modelspace().query(f'LINE[layer=="{layer}"]')
    return np.array(
        [[*line.dxf.start.vec2, *line.dxf.end.vec2] for line in found if isinstance(line, Line)]
    )


def polylines_on(drawing: Drawing, layer: str) -> list[LWPolyline]:
    found = drawing.modelspace().query(f'LWPOLYLINE[layer=="{layer}"]')
    return [line for line in found if isinstance(line, LWPolyline)]


def test_a_drawing_has_each_components_walls_floor_and_path_on_layers_of_their_own(
    rng: Generator, tmp_path: Path
) -> None:
    known = robot_map(rng, components=(0, 0, 1))
    export(known, tmp_path / "map.dxf")
    drawing = ezdxf.filemanagement.readfile(tmp_path / "map.dxf")
    assert not drawing.audit().has_errors
    assert drawing.units == 6  # metres
    for scene in robot_scenes(known):
        name = scene.name.replace("/", "_")
        walls = lines_on(drawing, f"{name} walls")
        np.testing.assert_allclose(walls, scene.map.segments, atol=1e-3)
        rings = polylines_on(drawing, f"{name} free space")
        assert all(ring.closed for ring in rings)
        for ring, polygon in zip(rings, scene.map.free_space, strict=True):
            np.testing.assert_allclose(list(ring.vertices()), polygon, atol=1e-3)
        paths = polylines_on(drawing, f"{name} path")
        assert [len(path) for path in paths] == [len(part.pose) for part in scene.paths]


def test_a_drawing_of_a_joint_map_has_a_layer_for_each_robot(
    rng: Generator, tmp_path: Path
) -> None:
    maps = [robot_map(rng, "a"), robot_map(rng, "b")]
    joint = joint_map(maps, true_poses(maps))
    export(joint, tmp_path / "joint.dxf")
    drawing = ezdxf.filemanagement.readfile(tmp_path / "joint.dxf")
    walls = lines_on(drawing, "a_0 + b_0 walls")
    np.testing.assert_allclose(walls, joint.components[0].map.segments, atol=1e-3)
    for name, pose in joint.components[0].robots.items():
        (start,) = drawing.modelspace().query(f'POINT[layer=="robot {name.replace("/", "_")}"]')
        np.testing.assert_allclose(start.dxf.location.vec2, pose[:2], atol=1e-3)


def test_without_ezdxf_a_drawing_names_the_extra(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "ezdxf.filemanagement", None)
    with pytest.raises(MissingExtraError, match=r"mapweave\[dxf\]"):
        export(square(), tmp_path / "map.dxf")
    assert list(tmp_path.iterdir()) == []
