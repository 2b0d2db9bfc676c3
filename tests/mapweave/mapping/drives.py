"""Drives of robots as they are, with what they see; and how far off their maps place them."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.mapper import Mapper
from mapweave.maps import RobotMap
from mapweave.scan.scan import Scan
from tests.mapweave.buildings import AROUND, cast, rectangle, walls_of

WIDE = np.radians(np.linspace(-120, 120, 341))


def straight(start: FloatArray, end: FloatArray, step: float) -> FloatArray:
    """Return (n, 3) poses every `step` [m] from `start` (2,) to `end` (2,), looking ahead."""
    way = end - start
    done = np.arange(0.0, np.hypot(*way), step) / np.hypot(*way)
    heading = np.full(len(done), np.arctan2(way[1], way[0]))
    return np.column_stack([start + done[:, None] * way, heading])


def scans_at(
    walls: FloatArray,
    poses: FloatArray,
    interval: float,
    *,
    angles: FloatArray = AROUND,
    max_range: float = 30.0,
    lost: float = 0.0,
    seed: int = 0,
) -> list[Scan]:
    """Return noisy scans of (m, 4) `walls` at `poses` (n, 3), `interval` [s] apart.

    A share `lost` of the readings is lost, as on dark walls.
    """
    rng = np.random.default_rng(seed)
    scans = []
    for k, pose in enumerate(poses):
        scan = cast(walls, pose, index=k, angles=angles, noise=rng, max_range=max_range)
        seen = np.where(rng.random(len(angles)) < lost, np.nan, scan.ranges)
        scans.append(replace(scan, ranges=seen, stamp=interval * k))
    return scans


def colonnade(pitch: float, length: float = 12.0, aside: float = 1.6) -> FloatArray:
    """Return (m, 4) walls of pillars every `pitch` [m] along x, `aside` [m] on both sides."""
    pillars = []
    for x in np.arange(-4.0, length + 4.0, pitch):
        for y in (-aside, aside):
            corners = rectangle(x - 0.15, y - 0.15, x + 0.15, y + 0.15)
            pillars.append(walls_of(corners[::-1]))
    return np.vstack(pillars)


def mapped(scans: list[Scan]) -> RobotMap:
    """Return the map of `scans`."""
    mapper = Mapper("a")
    for scan in scans:
        mapper.add(scan)
    return mapper.finish()


def tracks(robot_map: RobotMap) -> Iterator[tuple[list[int], FloatArray]]:
    """Yield of each component the indices of its scans and their (n, 3) poses in it."""
    for component in robot_map.components:
        own = [s for s in robot_map.submaps if s.component == component]
        index = np.concatenate([s.trajectory.scan_index for s in own])
        poses = np.vstack([se2.compose(s.pose, s.trajectory.pose) for s in own])
        order = np.argsort(index)
        yield index[order].tolist(), poses[order]


def errors(robot_map: RobotMap, true: FloatArray) -> FloatArray:
    """(n, 3) by which scans are off, as seen from the first of their component [m, m, rad]."""
    off = []
    for index, poses in tracks(robot_map):
        there = se2.between(true[index[0]], true[index])
        off.append(se2.between(there, se2.between(poses[0], poses)))
    return np.vstack(off)


def longest_step(robot_map: RobotMap) -> float:
    """Return the longest way [m] between scans that follow each other."""
    steps = [
        np.hypot(*np.diff(poses[:, :2], axis=0).T)[np.diff(index) == 1]
        for index, poses in tracks(robot_map)
    ]
    return float(np.concatenate(steps).max(initial=0.0))
