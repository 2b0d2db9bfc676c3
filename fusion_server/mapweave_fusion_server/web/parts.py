"""What each robot's map adds to a version: its path, its own lines, what it saw free."""

import threading
import zlib
from collections import OrderedDict
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import shapely

from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap, RobotMap, component_name
from mapweave.pictures.scene import Scene, ScenePath, robot_scenes
from mapweave_fusion_server.web.history import to_json

TOLERANCE = 0.03  # [m] by which a drawn path may miss the driven one: less than a line's width
KEPT_BYTES = 16_000_000  # of paths, packed: those of the last hours of a team of twenty
METRES = 3  # decimals


class Paths:
    """The paths of the last versions, packed; those of older ones go, to keep memory bounded."""

    def __init__(self, limit: int = KEPT_BYTES) -> None:
        self._limit = limit
        self._packed: OrderedDict[int, bytes] = OrderedDict()
        self._size = 0
        self._lock = threading.Lock()

    def keep(self, version: int, maps: Iterable[RobotMap]) -> None:
        """Keep the paths that `version`, later than those before, was made of."""
        packed = zlib.compress(to_json(paths_content(version, maps)))
        with self._lock:
            self._size += len(packed)
            self._packed[version] = packed
            while self._size > self._limit and len(self._packed) > 1:
                self._size -= len(self._packed.popitem(last=False)[1])

    @property
    def latest(self) -> int:
        """The last version whose paths are here, 0 when there is none."""
        with self._lock:
            return next(reversed(self._packed), 0)

    def json(self, version: int) -> bytes | None:
        """Return the paths of `version`, None where they are no longer kept."""
        with self._lock:
            packed = self._packed.get(version)
        return None if packed is None else zlib.decompress(packed)


def paths_content(version: int, maps: Iterable[RobotMap]) -> dict[str, Any]:
    """Return the paths of all components of `maps`, each in the component's frame."""
    newest: dict[str, tuple[int, str]] = {}
    components: dict[str, Any] = {}
    for robot_map in maps:
        for scene in robot_scenes(robot_map):
            components[scene.name] = {"paths": [_path(path) for path in scene.paths]}
        last = _last_pose(robot_map)
        if last is not None and newest.get(robot_map.robot, (-1, ""))[0] < last[0]:
            newest[robot_map.robot] = last[:2]
            components[last[1]]["last"] = last[2]
    robots = {robot: component for robot, (_, component) in newest.items()}
    return {"version": version, "kept": True, "components": components, "robots": robots}


def _last_pose(robot_map: RobotMap) -> tuple[int, str, list[float]] | None:
    """Return the newest component's number and name of a run, and where the robot is in it."""
    submaps = [s for s in robot_map.submaps if len(s.trajectory.pose)]
    if not submaps:
        return None
    component = submaps[-1].component
    name = component_name(robot_map.robot, component)
    (scene,) = [scene for scene in robot_scenes(robot_map) if scene.name == name]
    pose = [round(value, METRES) for value in scene.paths[-1].pose[-1].tolist()]
    return max(robot_map.components), name, pose


def _path(path: ScenePath) -> list[list[float]]:
    points = path.pose[:, :2]
    if len(points) > 1:
        points = shapely.get_coordinates(shapely.simplify(shapely.LineString(points), TOLERANCE))
    return rounded(points)


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
