"""What pictures and exports show: whole components, every submap and path in one frame."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mapweave.anchors import placed_marks
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.maps import (
    JointComponent,
    JointMap,
    LineMap,
    RobotMap,
    Submap,
    component_name,
    parse_component,
)
from mapweave.marks import PlacedMark
from mapweave.text import percent


@dataclass(frozen=True, slots=True, eq=False)
class ScenePath:
    """Where a robot drove, without a gap.

    Attributes
    ----------
    robot
        The robot's id.
    component
        The robot's component, such as ``a/0``.
    scan_index, stamp
        (m,) of its scans; stamps [s], NaN where unknown.
    pose
        (m, 3) sensor poses [m, m, rad], frame of the scene.
    """

    robot: str
    component: str
    scan_index: IntArray
    stamp: FloatArray
    pose: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """One component, in its own frame.

    Attributes
    ----------
    name
        The component, such as ``a/0``; a joint component is named after its robots' components.
    robots
        Each robot's component in it, with its (3,) pose [m, m, rad].
    map
        Walls, and the free space that all of its robots saw.
    seen
        Free space by component name, as far as it is known who saw it.
    paths
        Of its robots, as far as they are known.
    confidence
        Of a joint component: that it hangs together rightly; None for a robot's own map.
    segment_confidence
        (n,) for each segment, None for a robot's own map.
    marks
        What was marked, frame of the scene.
    """

    name: str
    robots: Mapping[str, FloatArray]
    map: LineMap
    seen: Mapping[str, tuple[FloatArray, ...]]
    paths: tuple[ScenePath, ...]
    confidence: float | None = None
    segment_confidence: FloatArray | None = None
    marks: tuple[PlacedMark, ...] = ()


def robot_of(component: str) -> str:
    """Return the robot's id in a component's name, such as ``a`` in ``a/0``."""
    return parse_component(component)[0]


def tell_confidence(scene: Scene) -> list[str]:
    """Return the confidence in words; nothing where no two robots had to be joined."""
    if scene.confidence is None or len(scene.robots) < 2:
        return []
    return [f"confidence {percent(scene.confidence)}"]


def scenes_of(some_map: RobotMap | JointMap) -> list[Scene]:
    """Return one scene for each component of a robot's map or a joint map."""
    return robot_scenes(some_map) if isinstance(some_map, RobotMap) else joint_scenes(some_map)


def largest(scenes: Sequence[Scene]) -> Scene | None:
    """Return the scene of the most wall; None if there is no wall."""
    walled = [scene for scene in scenes if len(scene.map.segments)]
    return max(walled, key=lambda scene: len(scene.map.segments), default=None)


def robot_scenes(robot_map: RobotMap) -> list[Scene]:
    """Return one scene for each of the robot's components, in ascending order."""
    return [_robot_scene(robot_map, component) for component in robot_map.components]


def joint_scenes(joint: JointMap, maps: Mapping[str, RobotMap] | None = None) -> list[Scene]:
    """Return one scene for each of the joint map's components.

    Parameters
    ----------
    joint
        The joint map.
    maps
        Robot id to robot map: they add the paths, and who saw which free space.
    """
    known = {
        scene.name: scene
        for robot_map in (maps or {}).values()
        for scene in robot_scenes(robot_map)
    }
    return [_joint_scene(component, known) for component in joint.components]


def _place_polygons(pose: FloatArray, polygons: Iterable[FloatArray]) -> tuple[FloatArray, ...]:
    return tuple(se2.transform_points(pose, polygon) for polygon in polygons)


def _robot_scene(robot_map: RobotMap, component: int) -> Scene:
    name = component_name(robot_map.robot, component)
    submaps = [submap for submap in robot_map.submaps if submap.component == component]
    lines = robot_map.lines(component)
    paths = tuple(_path(robot_map.robot, name, run) for run in _runs(submaps))
    return Scene(
        name,
        {name: se2.IDENTITY},
        lines,
        {name: lines.free_space},
        tuple(path for path in paths if len(path.pose)),
        marks=tuple(mark for mark in placed_marks(robot_map) if mark.component == name),
    )


def _runs(submaps: Sequence[Submap]) -> list[list[Submap]]:
    """Return the stretches of consecutive submaps: between two of them the robot was elsewhere."""
    runs = [[submap] for submap in submaps[:1]]
    for before, submap in pairwise(submaps):
        if submap.id == before.id + 1:
            runs[-1].append(submap)
        else:
            runs.append([submap])
    return runs


def _path(robot: str, component: str, run: Sequence[Submap]) -> ScenePath:
    return ScenePath(
        robot,
        component,
        np.concatenate([submap.trajectory.scan_index for submap in run]),
        np.concatenate([submap.trajectory.stamp for submap in run]),
        np.concatenate([se2.compose(submap.pose, submap.trajectory.pose) for submap in run]),
    )


def _joint_scene(component: JointComponent, known: Mapping[str, Scene]) -> Scene:
    own = {name: known[name] for name in component.robots if name in known}
    return Scene(
        " + ".join(component.robots),
        component.robots,
        component.map,
        {
            name: _place_polygons(component.robots[name], scene.map.free_space)
            for name, scene in own.items()
        },
        tuple(
            _place_path(component.robots[name], path)
            for name, scene in own.items()
            for path in scene.paths
        ),
        component.confidence,
        component.segment_confidence,
        component.marks,
    )


def _place_path(pose: FloatArray, path: ScenePath) -> ScenePath:
    return ScenePath(
        path.robot,
        path.component,
        path.scan_index,
        path.stamp,
        se2.compose(pose, path.pose),
    )
