"""Maps as the grids of ROS's map_server: a ``.yaml`` that names a ``.pgm`` beside it.

A grid has one frame: of several components it is the one of the most wall, and a comment names
those left out. Walls are occupied, free space is free, the rest is unknown. Unknown cells are
written as 205, an occupancy of 0.1961: with ``free_thresh: 0.196`` they are read as unknown, with
the 0.25 that others write, as free.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

from mapweave.atomic import replace_file
from mapweave.errors import FileError
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import JointMap, LineMap, RobotMap
from mapweave.pictures.scene import Scene, largest, scenes_of

SUFFIX = ".yaml"
RESOLUTION = 0.05  # [m] of a cell; what ROS's own mappers write
OCCUPIED, FREE, UNKNOWN = 0, 254, 205
FREE_THRESHOLD, OCCUPIED_THRESHOLD = 0.196, 0.65
MOST_CELLS = 100_000_000  # a hall of 500 m by 500 m; more is an error in the map

Cells = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """Cells of one component.

    Attributes
    ----------
    cells
        (rows, columns) `OCCUPIED`, `FREE` or `UNKNOWN`; the first row has the smallest y.
    origin
        (2,) the corner of the first cell of the first row [m], component's frame.
    """

    cells: Cells
    origin: FloatArray


def write(some_map: RobotMap | JointMap, path: Path) -> None:
    """Write `some_map` to `path` and its cells beside it, each whole or not at all.

    Raises
    ------
    FileError
        If there is no wall, the map is too large, or a file cannot be written.
    """
    scenes = scenes_of(some_map)
    scene = largest(scenes)
    if scene is None:
        raise FileError(path, "the map has no wall; expected one to make a grid of")
    grid = grid_of(scene.map, path)
    image = path.with_suffix(".pgm")
    rows, columns = grid.cells.shape
    with replace_file(image) as temporary:
        pixels = grid.cells[::-1].tobytes()  # a picture begins at the top
        temporary.write_bytes(f"P5\n{columns} {rows}\n255\n".encode() + pixels)
    with replace_file(path) as temporary:
        temporary.write_text(_settings(grid, image.name, scene, scenes), encoding="utf-8")


def grid_of(line_map: LineMap, path: Path) -> Grid:
    """Return `line_map` as cells, with a cell of margin; `path` is what errors name."""
    corners = np.concatenate([line_map.segments.reshape(-1, 2), *line_map.free_space])
    first = np.floor(corners.min(axis=0) / RESOLUTION) - 1
    columns, rows = (np.floor(corners.max(axis=0) / RESOLUTION) - first + 2).tolist()
    if not rows * columns <= MOST_CELLS:
        size = f"{columns * RESOLUTION:.0f} m by {rows * RESOLUTION:.0f} m"
        raise FileError(path, f"the map is {size}; expected no more than {MOST_CELLS} cells")
    cells = np.full((int(rows), int(columns)), UNKNOWN, dtype=np.uint8)
    origin = first * RESOLUTION
    _fill(cells, origin, line_map.free_space)
    column, row = np.floor((_along(line_map.segments) - origin) / RESOLUTION).astype(np.int64).T
    cells[row, column] = OCCUPIED
    return Grid(cells, origin)


def _fill(cells: Cells, origin: FloatArray, polygons: tuple[FloatArray, ...]) -> None:
    """Free the cells whose middle is in one of `polygons`."""
    rows, columns = cells.shape
    x = origin[0] + RESOLUTION * (np.arange(columns) + 0.5)
    y = origin[1] + RESOLUTION * (np.arange(rows) + 0.5)
    for polygon in polygons:
        low_x, high_x = np.searchsorted(x, [polygon[:, 0].min(), polygon[:, 0].max()])
        low_y, high_y = np.searchsorted(y, [polygon[:, 1].min(), polygon[:, 1].max()])
        shape = shapely.Polygon(polygon)
        shapely.prepare(shape)
        part = cells[low_y:high_y, low_x:high_x]
        across, up = np.meshgrid(x[low_x:high_x], y[low_y:high_y])
        part[shapely.contains_xy(shape, across, up)] = FREE


def _along(segments: FloatArray) -> FloatArray:
    """Return (m, 2) points [m] on `segments` (n, 4), a quarter of a cell apart or closer."""
    start, end = segments[:, :2], segments[:, 2:]
    lengths = np.hypot(*(end - start).T)
    counts = np.ceil(lengths / (RESOLUTION / 4)).astype(np.int64) + 1
    points = [
        start_ + np.linspace(0.0, 1.0, count)[:, None] * (end_ - start_)
        for start_, end_, count in zip(start, end, counts.tolist(), strict=True)
    ]
    return np.concatenate(points)


def _settings(grid: Grid, image: str, scene: Scene, scenes: list[Scene]) -> str:
    """Return what map_server reads; strings are written as JSON, which YAML includes."""
    x, y = grid.origin.tolist()
    left_out = ", ".join(other.name for other in scenes if other is not scene)
    lines = [
        f"# component {scene.name}",
        *([f"# left out, in frames of their own: {left_out}"] if left_out else []),
        f"image: {json.dumps(image)}",
        "mode: trinary",
        f"resolution: {RESOLUTION}",
        f"origin: [{x:.4f}, {y:.4f}, 0.0]",
        "negate: 0",
        f"occupied_thresh: {OCCUPIED_THRESHOLD}",
        f"free_thresh: {FREE_THRESHOLD}",
    ]
    return "\n".join(lines) + "\n"
