"""What scans saw: how much of it a map explains, and how much of it two stretches share."""

from collections.abc import Sequence

import numpy as np
import shapely
from scipy.spatial import KDTree

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.scan.scan import Scan

MAX_RANGE = 12.0  # [m] of the returns that count
NEAR_LINE = 0.10  # [m] within which a segment explains a return
CELL = 0.15  # [m]
MIN_RETURNS = 2  # in a cell that counts
NEAR_CELL = 0.25  # [m] within which cells of two stretches are in common
METRES_A_CELL = 0.10


def returns_at(scans: Sequence[Scan], poses: FloatArray) -> FloatArray:
    """Return the (k, 2) returns under 12 m of `scans` taken at (n, 3) `poses`, their frame [m]."""
    placed = [np.empty((0, 2))]
    for scan, pose in zip(scans, poses, strict=True):
        near = scan.hits & (np.nan_to_num(scan.ranges, nan=np.inf) < MAX_RANGE)
        placed.append(se2.transform_points(pose, scan.points[near]))
    return np.concatenate(placed)


def explained_share(points: FloatArray, segments: FloatArray) -> float:
    """Return the share of (k, 2) `points` within 10 cm of some of the (n, 4) `segments` [m]."""
    tree = shapely.STRtree(shapely.linestrings(segments.reshape(-1, 2, 2)))
    near = tree.query(shapely.points(points), predicate="dwithin", distance=NEAR_LINE)[0]
    return len(np.unique(near)) / max(len(points), 1)


def wall_cells(points: FloatArray) -> FloatArray:
    """Return the (m, 2) middles of cells of 0.15 m that hold two `points` (k, 2) or more [m]."""
    cells, counts = np.unique(np.floor(points / CELL).astype(np.int64), axis=0, return_counts=True)
    return np.asarray((cells[counts >= MIN_RETURNS] + 0.5) * CELL, dtype=np.float64)


def metres_in_common(first: FloatArray, second: FloatArray) -> float:
    """Return the metres of wall that two sets of `wall_cells` have in common.

    The cells of one within 0.25 m of the other's count 0.10 m each; the mean of both ways, so
    that it does not matter which comes first.
    """
    if len(first) == 0 or len(second) == 0:
        return 0.0
    return METRES_A_CELL * (_cells_near(first, second) + _cells_near(second, first)) / 2


def _cells_near(cells: FloatArray, others: FloatArray) -> int:
    distance, _ = KDTree(others).query(cells, distance_upper_bound=NEAR_CELL)
    return int(np.isfinite(distance).sum())
