"""What a robot's own map says of a component: its lines, and what it saw free."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap, RobotMap
from mapweave.pictures.scene import Scene, robot_scenes

METRES = 3  # decimals


def scene_of(maps: Iterable[RobotMap], component: str) -> Scene | None:
    """Return what is known of `component`, such as ``a/0``, None where nothing is."""
    found = (
        scene
        for robot_map in maps
        if component.rpartition("/")[0] == robot_map.robot
        for scene in robot_scenes(robot_map)
        if scene.name == component
    )
    return next(found, None)


def part_content(component: str, lines: LineMap) -> Mapping[str, Any]:
    """Return a robot's own lines of a component, not merged, in the component's frame."""
    return {
        "component": component,
        "segments": rounded(lines.segments),
        "support": lines.support.tolist(),
        "free_space": [rounded(ring) for ring in lines.free_space],
    }


def rounded(values: FloatArray) -> list[list[float]]:
    """Return `values` [m] to the millimetre."""
    result: list[list[float]] = np.round(values, METRES).tolist()
    return result
