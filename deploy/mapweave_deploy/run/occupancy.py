"""How large the same scans are as an occupancy grid, which is what others send."""

import zlib
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.io.readers import read_scans
from mapweave.maps import RobotMap
from mapweave.scan.scan import Scan
from mapweave_deploy.run.evaluation import component_path
from mapweave_deploy.run.team_plan import Member

Grid: TypeAlias = NDArray[np.int8]

CELL = 0.05  # [m], the usual size
UNKNOWN, FREE, OCCUPIED = -1, 0, 100  # as in nav_msgs/OccupancyGrid of ROS
TRACED = 200  # scans at most are traced for free space: more of them free hardly another cell


def grid_bytes(member: Member, robot_map: RobotMap) -> tuple[int, int]:
    """Return the bytes of a robot's scans as occupancy grids, one a component: plain, deflated.

    One byte a cell, over the bounding box of what the scans saw from where they were placed.
    """
    scans = scans_of(member, robot_map)
    plain = deflated = 0
    for component in robot_map.components:
        index, poses = component_path(robot_map, component)
        grid = draw_grid([scans[int(number)] for number in index], poses).tobytes()
        plain += len(grid)
        deflated += len(zlib.compress(grid, 9))
    return plain, deflated


def scans_of(member: Member, robot_map: RobotMap) -> dict[int, Scan]:
    """Return by index the scans that `robot_map` places."""
    placed = {int(i) for submap in robot_map.submaps for i in submap.trajectory.scan_index}
    scans = read_scans(member.log, on_warning=lambda _: None)
    return {scan.index: scan for scan in scans if scan.index in placed}


def draw_grid(scans: Sequence[Scan], poses: FloatArray) -> Grid:
    """Return the (rows, columns) occupancy grid of `scans` taken at `poses` (m, 3) [m, m, rad]."""
    ends = [
        se2.transform_points(pose, scan.points[scan.hits])
        for scan, pose in zip(scans, poses, strict=True)
    ]
    seen = np.concatenate([poses[:, :2], *ends])
    origin = np.min(seen, axis=0)
    columns, rows = _cells(np.max(seen, axis=0)[None], origin)[0] + 1
    grid = np.full((rows, columns), UNKNOWN, dtype=np.int8)
    every = max(1, len(scans) // TRACED)
    for pose, points in zip(poses[::every], ends[::every], strict=True):
        _mark(grid, _cells(_along_beams(pose[:2], points), origin), FREE)
    _mark(grid, _cells(np.concatenate(ends), origin), OCCUPIED)
    return grid


def _along_beams(origin: FloatArray, ends: FloatArray) -> FloatArray:
    """Return (k, 2) points a cell apart on the beams from `origin` (2,) to `ends` (n, 2) [m]."""
    beams = ends - origin
    lengths = np.linalg.norm(beams, axis=1)
    steps = np.arange(0.0, np.max(lengths, initial=0.0), CELL)
    beam, step = np.nonzero(steps[None] < lengths[:, None])
    points: FloatArray = origin + (steps[step] / lengths[beam])[:, None] * beams[beam]
    return points


def _cells(points: FloatArray, origin: FloatArray) -> IntArray:
    """Return the (n, 2) column and row of `points` (n, 2) [m]."""
    return np.asarray(np.floor((points - origin) / CELL), dtype=np.int64)


def _mark(grid: Grid, cells: IntArray, value: int) -> None:
    grid[cells[:, 1], cells[:, 0]] = value
