"""What the peers get to see: walls and occupancy grids from the corrected poses."""

from collections.abc import Sequence

import numpy as np

from benchmarks.coverage import MAX_RANGE, returns_at, wall_cells
from benchmarks.logs import Log, load_scans, load_truth
from benchmarks.peer_types import Grid, View
from benchmarks.stretches import Part
from mapweave.commands.progress import track
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.scan.scan import Scan

CELL = 0.10  # [m] of the grids: AKAZE and ORB do better on it than on 0.05 m, the other usual one
APART = 0.05  # [m] between the points of walls
MARGIN = 1.0  # [m] of unknown around a grid
OCCUPIED = 0.25  # share of the beams at a cell that end there; GMapping's occ_thresh
WALL, FREE, UNKNOWN = 0, 254, 205  # grey, as map_server writes its pictures


def view_stretches(log: Log, count: int, cell: float = CELL) -> list[View]:
    """Cut `log` into `count` stretches as the fusion benchmark does and view each."""
    scans = load_scans(log)
    truth = load_truth(log, np.array([scan.stamp for scan in scans]))
    bounds = [round(len(scans) * k / count) for k in range(count + 1)]
    views = []
    for k in track(range(count), f"viewing {log.name}", count):
        inside = scans[bounds[k] : bounds[k + 1]]
        known = [scan for scan in inside if np.isfinite(truth[scan.index, 0])]
        poses = truth[[scan.index for scan in known]]
        views.append(view(f"{log.name} {k + 1}/{count}", log, known, poses, cell))
    return views


def view(name: str, log: Log, scans: Sequence[Scan], poses: FloatArray, cell: float = CELL) -> View:
    """Return what `scans` saw at the (n, 3) `poses`, in the frame of the first of them.

    The side of its grid's pixels is `cell` [m].
    """
    start = poses[0]
    placed = se2.between(start, poses)
    walls = thin(returns_at(scans, placed), APART)
    grid = render(scans, placed, cell)
    cells = wall_cells(returns_at(scans, poses))
    return View(name, log, walls, grid, cells, Part(start, 0.0, walls))


def thin(points: FloatArray, cell: float) -> FloatArray:
    """Return the mean of the (n, 2) `points` in each cell [m] that holds some."""
    held, counts = np.unique(
        np.floor(points / cell), axis=0, return_inverse=True, return_counts=True
    )[1:]
    sums = [np.bincount(held.ravel(), weights=axis) for axis in points.T]
    return np.asarray(np.column_stack(sums) / counts[:, None])


def render(scans: Sequence[Scan], poses: FloatArray, cell: float) -> Grid:
    """Return the occupancy grid that returns under 12 m of `scans` at (n, 3) `poses` make."""
    ends = returns_at(scans, poses)
    both = np.concatenate([ends, poses[:, :2]])
    corner = both.min(axis=0) - MARGIN
    columns, rows = np.ceil((both.max(axis=0) + MARGIN - corner) / cell).astype(int)
    hits, passes = np.zeros(rows * columns), np.zeros(rows * columns)

    def pixel(points: FloatArray) -> tuple[np.ndarray, ...]:
        column, row = np.floor((points - corner) / cell).astype(np.int64).T
        return (row * columns + column,)

    np.add.at(hits, pixel(ends), 1)
    for scan, pose in zip(scans, poses, strict=True):
        np.add.at(passes, pixel(_passed(scan, pose, cell)), 1)
    seen = hits + passes
    image = np.where(seen > 0, FREE, UNKNOWN)
    image[(hits > 0) & (hits >= OCCUPIED * seen)] = WALL
    return Grid(image.reshape(rows, columns).astype(np.uint8), corner, cell)


def _passed(scan: Scan, pose: FloatArray, cell: float) -> FloatArray:
    """Return (k, 2) points along the beams of `scan` at `pose`, a `cell` [m] apart, one short."""
    ends = returns_at([scan], pose[None])
    ray = ends - pose[:2]
    length = np.hypot(*ray.T)
    along = np.arange(0.0, MAX_RANGE, cell)
    beam, step = np.nonzero(along < length[:, None] - cell)
    return np.asarray(pose[:2] + ray[beam] * (along[step] / length[beam])[:, None])
