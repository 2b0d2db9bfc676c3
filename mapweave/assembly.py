"""A component of a robot map as one line map: its submaps at their poses."""

from collections.abc import Iterable

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap, RobotMap, Submap, component_name


def place(line_map: LineMap, pose: FloatArray) -> LineMap:
    """Return `line_map`, given in the frame at `pose` (3,), in that frame's parent."""
    return LineMap(
        se2.transform_segments(pose, line_map.segments),
        line_map.polyline,
        line_map.support,
        tuple(se2.transform_points(pose, ring) for ring in line_map.free_space),
    )


def unite_lines(line_maps: list[LineMap]) -> LineMap:
    """Return all lines and free space of `line_maps`, which share a frame, side by side."""
    if not line_maps:
        return LineMap.empty()
    counts = [int(m.polyline[-1]) + 1 if len(m.polyline) else 0 for m in line_maps]
    offsets = np.concatenate([[0], np.cumsum(counts)[:-1]])
    return LineMap(
        np.concatenate([m.segments for m in line_maps]),
        np.concatenate([m.polyline + k for m, k in zip(line_maps, offsets, strict=True)]),
        np.concatenate([m.support for m in line_maps]),
        tuple(ring for m in line_maps for ring in m.free_space),
    )


def lines_of(submaps: Iterable[Submap]) -> LineMap:
    """Return the lines of `submaps` of one component in its frame, not merged."""
    return unite_lines([place(s.map, s.pose) for s in submaps])


def assemble(robot_map: RobotMap, component: int) -> LineMap:
    """Return all submaps of `component` in its frame, not merged."""
    return lines_of(s for s in robot_map.submaps if s.component == component)


def submaps_by_component(maps: Iterable[RobotMap]) -> dict[str, list[Submap]]:
    """Return the submaps of every component of `maps`, by its name."""
    return {
        component_name(m.robot, c): [s for s in m.submaps if s.component == c]
        for m in maps
        for c in m.components
    }
