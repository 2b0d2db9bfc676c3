"""What scans saw through: the free space as a raster, and the segments that are not there."""

from typing import NamedTuple, cast

import numpy as np
import scipy
from numpy.typing import NDArray

from mapweave.kernels.loading import COMPILED
from mapweave.kernels.point_map import Bools, Floats, Ints

Cells = NDArray[np.uint8]
Floats32 = NDArray[np.float32]


class Sights(NamedTuple):
    """What several scans saw through, their beams one after the other.

    Attributes
    ----------
    angles, clear
        (b,) of each beam [rad], and how far it saw nothing [m].
    start
        (n + 1,) where the beams of each scan begin, and b.
    poses
        (n, 3) of the sensor [m, m, rad].
    """

    angles: Floats
    clear: Floats
    start: Ints
    poses: Floats

    def beams(self) -> Floats:
        """Return (n, 2) angle of the first beam of each scan, and between its beams [rad]."""
        first, last = self.angles[self.start[:-1]], self.angles[self.start[1:] - 1]
        return np.column_stack([first, (last - first) / np.maximum(np.diff(self.start) - 1, 1)])


class Grid(NamedTuple):
    """Cells of `cell` [m] from the corner `origin` (2,) on; rows along x."""

    origin: Floats
    cell: float
    rows: int
    columns: int


def clear_cells_numpy(sights: Sights, margin: float, grid: Grid) -> Cells:
    """Twin of `clear_cells`."""
    cells = np.zeros((grid.rows, grid.columns), dtype=np.uint8)
    for pose, first, last in zip(sights.poses, sights.start[:-1], sights.start[1:], strict=True):
        reach = np.maximum(sights.clear[first:last] - margin, 0.0)
        angle = pose[2] + sights.angles[first:last]
        rim = pose[:2] + reach[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        edges = np.flatnonzero(np.diff(np.concatenate([[0], reach > 0, [0]])))
        for begin, end in zip(edges[::2], edges[1::2], strict=True):
            ring = (np.vstack([pose[:2], rim[begin:end]]) - grid.origin) / grid.cell - 0.5
            if end - begin >= 2:
                cells |= _inside(ring, grid.rows, grid.columns)
    return cells


def _inside(ring: Floats, rows: int, columns: int) -> Cells:
    """Tell which cells have their centres, at whole numbers, inside a ring (k, 2)."""
    toggles = np.zeros((rows, columns + 1), dtype=np.int64)
    for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        low, high = np.clip(np.ceil(sorted((a[0], b[0]))), 0, rows).astype(np.int64)
        row = np.arange(low, high)
        if len(row):
            column = np.ceil(a[1] + (row - a[0]) / (b[0] - a[0]) * (b[1] - a[1]))
            np.add.at(toggles, (row, np.clip(column, 0, columns).astype(np.int64)), 1)
    return (np.cumsum(toggles, axis=1)[:, :-1] % 2).astype(np.uint8)


def from_core_numpy(free: Cells, depth: int) -> Floats32:
    """Twin of `from_core`."""
    inside = scipy.ndimage.distance_transform_edt(np.pad(free, 1))
    core = np.rint(inside**2) >= depth**2
    if not core.any():
        return np.full(core.shape, depth + 1, dtype=np.float32)
    squared = np.rint(scipy.ndimage.distance_transform_edt(~core) ** 2)
    away: Floats32 = np.sqrt(np.minimum(squared, (depth + 1) ** 2)).astype(np.float32)
    return away


_CORNERS = ((0, 0), (1, 0), (1, 1), (0, 1), (0, 0))  # of a square, counterclockwise
_BEYOND = ((0, -1), (1, 0), (0, 1), (-1, 0))  # the squares beyond its edges


def outlines_numpy(values: Floats32, level: float) -> tuple[Floats, Ints]:
    """Twin of `outlines`."""
    below = values < np.float32(level)
    if below[[0, -1], :].any() or below[:, [0, -1]].any():
        raise ValueError("values: nothing below the level expected at the rim")
    count = sum(
        below[r : len(below) - 1 + r, c : below.shape[1] - 1 + c] * 1 for r, c in _CORNERS[:4]
    )
    rings: list[list[tuple[float, float]]] = []
    seen: set[tuple[int, int, int]] = set()
    for r, c in np.argwhere((count > 0) & (count < 4)).tolist():
        rings.extend(
            _followed(values, below, float(np.float32(level)), (r, c, edge), seen)
            for edge in range(4)
            if (r, c, edge) not in seen and _leaves(below, r, c, edge)
        )
    start = np.cumsum([0, *map(len, rings)], dtype=np.int64)
    return np.array([p for ring in rings for p in ring]).reshape(-1, 2), start


def _ends(r: int, c: int, edge: int) -> tuple[tuple[int, int], tuple[int, int]]:
    (a, b), (x, y) = _CORNERS[edge], _CORNERS[edge + 1]
    return (r + a, c + b), (r + x, c + y)


def _leaves(below: Bools, r: int, c: int, edge: int) -> bool:
    first, second = _ends(r, c, edge)
    return bool(below[first] and not below[second])


def _followed(
    values: Floats32,
    below: Bools,
    level: float,
    at: tuple[int, int, int],
    seen: set[tuple[int, int, int]],
) -> list[tuple[float, float]]:
    """Follow one ring from an edge on at which it leaves what is below, to there again."""
    ring = []
    while at not in seen:
        seen.add(at)
        r, c, edge = at
        (i, j), (x, y) = first, second = _ends(*at)
        a, b = float(values[first]), float(values[second])
        part = (level - a) / (b - a)
        ring.append((i + part * (x - i), j + part * (y - j)))
        back = ((edge - k) % 4 for k in (1, 2, 3))
        edge = next(k for k in back if _leaves(~below, r, c, k))
        at = r + _BEYOND[edge][0], c + _BEYOND[edge][1], (edge + 2) % 4
    return ring


def clear_cells(sights: Sights, margin: float, grid: Grid) -> Cells:
    """Return (rows, columns) 1 for each cell of `grid` that a scan saw through, else 0.

    A cell counts by its centre, `margin` [m] are kept from what beams hit, and a beam without a
    neighbour that saw through anything clears nothing.

    Raises
    ------
    ValueError
        Where lengths do not agree.
    """
    if COMPILED is None:
        return clear_cells_numpy(sights, margin, grid)
    reach = np.maximum(sights.clear - margin, 0.0)
    return cast(
        "Cells", COMPILED.clear_cells(sights.angles, reach, sights.start, sights.poses, *grid)
    )


def from_core(free: Cells, depth: int) -> Floats32:
    """Return (rows + 2, columns + 2) distances [cells] from what lies `depth` cells deep in `free`.

    They count up to `depth` + 1; there is a cell more at each side, and beyond nothing is free.

    Raises
    ------
    ValueError
        Where `depth` is not in 1 to 100.
    """
    compute = from_core_numpy if COMPILED is None else COMPILED.from_core
    return cast("Floats32", compute(free, depth))


def outlines(values: Floats32, level: float) -> tuple[Floats, Ints]:
    """Return the rings inside which (rows, columns) `values` are below `level`.

    Values are linear between neighbours; two that touch across a square are apart.

    Returns
    -------
    points
        (n, 2) row and column; a ring has on its left what is below.
    start
        (k + 1,) where each ring begins, and n.

    Raises
    ------
    ValueError
        Where something at the rim is below the level.
    """
    compute = outlines_numpy if COMPILED is None else COMPILED.outlines
    return cast("tuple[Floats, Ints]", compute(values, level))
