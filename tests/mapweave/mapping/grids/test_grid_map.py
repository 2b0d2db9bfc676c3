"""Another program's grid as a map: within a cell, facing the free side, and comparable."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy
import shapely
from numpy.typing import NDArray

from mapweave.fusion.align import align
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.io.export import export
from mapweave.io.grids.map_server import read_grid
from mapweave.io.readers import read_scans
from mapweave.mapping.grids.cells import GridCells
from mapweave.mapping.grids.grid_map import map_of_grid
from mapweave.mapping.grids.virtual_scans import VirtualLaser, VirtualScanParameters
from mapweave.mapping.grids.wall_cells import MIN_CELLS
from mapweave.mapping.mapper import Mapper
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave.scan.free_space import from_rings
from tests.mapweave.buildings import BUILDING, SLANTED, part, scans_along

RESOLUTION = 0.05
A_CELL = 2**0.5 * RESOLUTION  # [m] across


def stored(lines: LineMap, pose: FloatArray) -> RobotMap:
    return RobotMap("a", "0", 1, (Submap(0, 0, pose, lines, Trajectory.empty()),))


def distance(points: FloatArray, walls: FloatArray) -> FloatArray:
    """(n,) [m] from `points` (n, 2) to the nearest of (k, 4) `walls`."""
    lines = shapely.MultiLineString(walls.reshape(-1, 2, 2).tolist())
    return np.asarray(shapely.distance(shapely.points(points), lines))


def along(walls: FloatArray) -> FloatArray:
    """(n, 2) points on (k, 4) walls, some 5 cm apart."""
    shares = np.linspace(0, 1, 200)[:, None, None]
    return np.asarray((walls[:, :2] + shares * (walls[:, 2:] - walls[:, :2])).reshape(-1, 2))


def middles(cells: NDArray[np.bool_]) -> FloatArray:
    """(n, 2) [m] of those that are true."""
    return np.asarray((np.argwhere(cells)[:, ::-1] + 0.5) * RESOLUTION)


def worn(rng: np.random.Generator) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Walls and free cells of two rooms with a door."""
    wall = np.zeros((160, 240), dtype=np.bool_)
    wall[[20, 139], 20:220] = wall[20:140, [20, 120, 219]] = True
    wall[70:90, 120] = False
    for _ in range(12):  # drawn again, some cells aside
        row, column = rng.integers(22, 110), rng.choice([20, 120, 219])
        wall[row : row + 20, column + rng.integers(-4, 5)] = True
        row, column = rng.choice([20, 139]), rng.integers(22, 190)
        wall[row + rng.integers(-4, 5), column : column + 20] = True
    for row, column in rng.integers(30, 130, size=(30, 2)):  # things that stood about
        wall[row : row + rng.integers(1, 6), column : column + rng.integers(1, 6)] = True
    for row, column in rng.integers(20, 130, size=(30, 2)):
        wall[row : row + 6, column : column + 6] = False
    free = np.zeros_like(wall)
    free[25:135, 25:215] = True
    return wall, free & ~wall


@pytest.mark.parametrize("turn", [0.0, 0.3, -2.0])
def test_what_was_exported_is_read_back_within_a_cell(turn: float, tmp_path: Path) -> None:
    lines, pose = part(BUILDING, 0, 30), np.array([0.31, -0.22, turn])
    export(stored(lines, pose), tmp_path / "map.yaml")
    found = map_of_grid(read_grid(tmp_path / "map.yaml"), "g").lines(0)
    expected = lines.moved(pose)
    for one, other in ((found, expected), (expected, found)):
        apart = distance(along(one.segments), other.segments)
        assert np.quantile(apart, 0.99) < A_CELL
        assert apart.max() < 2 * RESOLUTION  # the tips of corners
    free = [from_rings(each.free_space) for each in (found, expected)]
    assert shapely.symmetric_difference(*free).area < 0.04 * free[1].area


def check_walls_and_cells(cells: GridCells) -> None:
    """Check that each wall is within a cell of cells, and each run of seen cells of a wall."""
    here = replace(cells, origin=np.zeros(3))
    found = map_of_grid(here, "g").lines(0).segments
    laser = VirtualLaser(here, VirtualScanParameters())
    assert list(laser.scans())
    off, _ = scipy.spatial.KDTree(middles(cells.wall)).query(along(found))
    assert np.max(off) < A_CELL
    left = laser.seen.copy()
    left[left] = distance(middles(left), found) > A_CELL
    runs, _ = scipy.ndimage.label(left, np.ones((3, 3)))
    sizes = np.bincount(runs[left], minlength=1)
    assert sizes[sizes >= MIN_CELLS].sum() <= 0.005 * laser.seen.sum()  # of no straight line


@pytest.mark.parametrize("seed", range(4))
def test_walls_are_where_cells_are_though_they_were_drawn_twice_with_gaps_and_clutter(
    seed: int,
) -> None:
    wall, free = worn(np.random.default_rng(seed))
    check_walls_and_cells(GridCells(wall, free, RESOLUTION, np.zeros(3)))


@pytest.mark.slow
@pytest.mark.parametrize("log", ["seattle", "intel-lab", "fr079"])
def test_walls_are_where_cells_are_in_grids_of_recorded_logs(
    log: str, data_dir: Path, tmp_path: Path
) -> None:
    mapper = Mapper("r1")
    for scan in read_scans(data_dir / f"{log}.log.gz"):
        mapper.add(scan)
    export(mapper.finish(), tmp_path / "map.yaml")
    check_walls_and_cells(read_grid(tmp_path / "map.yaml"))


def test_a_walls_visible_side_is_the_free_one() -> None:
    wall, free = np.zeros((60, 60), dtype=np.bool_), np.zeros((60, 60), dtype=np.bool_)
    wall[10:50, [10, 49]] = wall[[10, 49], 10:50] = True
    free[11:49, 11:49] = True
    found = map_of_grid(GridCells(wall, free, RESOLUTION, np.zeros(3)), "g").lines(0)
    middle = found.segments.reshape(-1, 2, 2).mean(axis=1)
    direction = found.segments[:, 2:] - found.segments[:, :2]
    to_centre = np.array([1.5, 1.5]) - middle
    assert len(found.segments) >= 4
    assert (direction[:, 0] * to_centre[:, 1] - direction[:, 1] * to_centre[:, 0] > 0).all()


def test_a_wall_that_is_free_on_both_sides_is_seen_from_both() -> None:
    wall, free = np.zeros((60, 100), dtype=np.bool_), np.zeros((60, 100), dtype=np.bool_)
    free[1:59, 1:99] = True
    wall[[0, 59], :] = wall[:, [0, 99]] = True
    wall[10:50, 50] = True
    free[wall] = False
    found = map_of_grid(GridCells(wall, free, RESOLUTION, np.zeros(3)), "g").lines(0)
    inner = found.segments[np.abs(found.segments[:, [0, 2]] - 2.525).max(axis=1) < 0.05]
    upwards = inner[:, 3] > inner[:, 1]
    assert upwards.any() and (~upwards).any()


def test_the_grids_origin_and_its_turn_are_the_maps_frame() -> None:
    wall, free = np.zeros((60, 80), dtype=np.bool_), np.zeros((60, 80), dtype=np.bool_)
    wall[[0, 59], :] = wall[:, [0, 79]] = True
    free[1:59, 1:79] = True
    origin = np.array([3.0, -2.0, 0.5])
    here = map_of_grid(GridCells(wall, free, RESOLUTION, np.zeros(3)), "g").lines(0)
    there = map_of_grid(GridCells(wall, free, RESOLUTION, origin), "g").lines(0)
    np.testing.assert_allclose(there.segments, se2.transform_segments(origin, here.segments))
    np.testing.assert_allclose(
        there.free_space[0], se2.transform_points(origin, here.free_space[0])
    )


def test_a_grid_is_joined_with_the_map_of_a_robot_that_was_there(tmp_path: Path) -> None:
    export(stored(part(SLANTED, 0, 30), np.zeros(3)), tmp_path / "map.yaml")
    grid = map_of_grid(read_grid(tmp_path / "map.yaml"), "g")
    mapper = Mapper("r")
    scans, poses = scans_along(SLANTED, [(3, 1), (13, 1), (13, -3), (13, 1), (27, 1)], 1)
    for scan in scans:
        mapper.add(scan)
    (alignment,) = align(grid, mapper.finish())
    assert alignment.decision == "accepted"
    x, y, turn = se2.between(poses[0], alignment.transform)
    assert np.hypot(x, y) < 0.1 and abs(turn) < 0.02


def test_unknown_cells_stop_the_view_and_are_no_walls() -> None:
    """Free to the left, unknown to the right: the way on is no wall."""
    wall, free = np.zeros((60, 120), dtype=np.bool_), np.zeros((60, 120), dtype=np.bool_)
    wall[[10, 49], 10:100] = wall[10:50, 10] = True
    wall[10:50, 99] = True  # behind what nobody saw
    free[11:49, 11:60] = True
    found = map_of_grid(GridCells(wall, free, RESOLUTION, np.zeros(3)), "g").lines(0)
    assert found.segments[:, [0, 2]].max() < 4.0
    assert max(ring[:, 0].max() for ring in found.free_space) < 3.1


def test_rooms_that_only_touch_at_corners_of_cells_are_not_seen_from_each_other() -> None:
    """A diagonal wall, one cell thick: 8-connected, as grids are drawn."""
    wall, free = np.zeros((80, 80), dtype=np.bool_), np.ones((80, 80), dtype=np.bool_)
    wall[[0, 79], :] = wall[:, [0, 79]] = True
    numbers = np.arange(80)
    wall[numbers, numbers] = True
    free[wall] = False
    free &= np.add.outer(-numbers, numbers) > 0  # one side is known
    found = map_of_grid(GridCells(wall, free, RESOLUTION, np.zeros(3)), "g").lines(0)
    ends = found.segments.reshape(-1, 2)
    assert (ends[:, 0] - ends[:, 1] > -0.1).all()


def test_a_grid_in_which_no_wall_can_be_seen_is_an_empty_map() -> None:
    cells: NDArray[np.bool_] = np.zeros((60, 60), dtype=np.bool_)
    wall, free = cells.copy(), cells.copy()
    wall[5, 5], free[40:50, 40:50] = True, True
    assert map_of_grid(GridCells(wall, free, RESOLUTION, np.zeros(3)), "g").submaps == ()
