"""A grid as a robot's map: its walls as generalized polylines, its free cells as free space."""

from dataclasses import replace

import numpy as np

from mapweave.config import Config, Sensor
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.lines.merging import count_support
from mapweave.lines.polylines import group_polylines
from mapweave.lines.simplification import sources
from mapweave.mapping.grids.cells import GridCells
from mapweave.mapping.grids.virtual_scans import VirtualLaser, VirtualScanParameters
from mapweave.mapping.grids.wall_cells import WallCells
from mapweave.mapping.submap_builder import SubmapBuilder, SubmapParameters
from mapweave.mapping.tracking.observation import ObservationParameters, observe
from mapweave.maps import LineMap, MadeWith, RobotMap, Submap, Trajectory
from mapweave.scan.free_space import FreeSpaceParameters, free_cells, rings

BOOT = "grid"
CELL_NOISE = 0.4  # [cells] by which a wall's cells are off it; 0.29 where it is one cell thick


def map_of_grid(cells: GridCells, robot: str, config: Config | None = None) -> RobotMap:
    """Return the map of one component, which is in the frame that the grid is in.

    A virtual laser is set down all over the free cells; what it sees is merged as scans are. So
    walls have a visible side, and support by how much of the free space they are seen from.
    """
    config = Config() if config is None else config
    lines = replace(_walls(cells, config), free_space=_free_space(cells, config))
    moved = lines.moved(cells.origin)
    submaps = (Submap(0, 0, np.zeros(3), moved, Trajectory.empty()),)
    return RobotMap(robot, BOOT, 1, submaps if len(lines.segments) else (), MadeWith.of(config))


def _walls(cells: GridCells, config: Config) -> LineMap:
    """Return what a virtual laser sees, in the frame of the grid's corner."""
    noise = max(config.sensor.range_sigma, CELL_NOISE * cells.resolution)
    seeing = Config(
        sensor=Sensor(range_sigma=min(noise, 0.2)), robot=config.robot, mapping=config.mapping
    )
    observing, p = ObservationParameters.of(seeing), SubmapParameters.of(seeing)
    builder, laser = SubmapBuilder(p), VirtualLaser(cells, VirtualScanParameters())
    sightings = [np.empty((0, 4))]
    for scan, pose in laser.scans():
        segments = observe(scan, observing).segments
        builder.add(scan, segments, pose)
        sightings.append(se2.transform_segments(pose, segments))
    if builder.is_empty:
        return LineMap.empty()
    middles = np.asarray((np.argwhere(cells.wall)[:, ::-1] + 0.5) * cells.resolution, dtype=float)
    occupied = WallCells(middles, laser.seen[cells.wall], cells.resolution)
    return _held(builder.line_map().segments, sightings, occupied, p)


def _held(
    walls: FloatArray, sightings: list[FloatArray], cells: WallCells, p: SubmapParameters
) -> LineMap:
    """Return `walls` (n, 4) where there are cells, and others where they leave some out.

    The `sightings` (k, 4) are those of each scan.
    """
    seen = np.concatenate(sightings)
    scans = np.repeat(np.arange(len(sightings)), [len(each) for each in sightings])
    held = cells.near(walls)
    lines = np.concatenate([held, cells.missing(held, seen)])
    wall, source = sources(lines, seen, p.simplification)
    found, labels = np.unique(wall, return_inverse=True)
    order, polyline = group_polylines(lines[found], p.max_gap)
    return LineMap(lines[found][order], polyline, count_support(labels, scans[source])[order])


def _free_space(cells: GridCells, config: Config) -> tuple[FloatArray, ...]:
    """Return rings of what is free, as far from walls as maps of scans keep it."""
    p = FreeSpaceParameters.of(config)
    to_wall, _ = cells.nearest_wall
    clear = cells.free & (to_wall * cells.resolution > p.margin)
    return rings(free_cells(clear, cells.resolution, p))
