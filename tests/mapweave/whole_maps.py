"""Robot maps and joint maps put together by hand, for what shows or writes them."""

from collections.abc import Sequence

import numpy as np
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import (
    JointComponent,
    JointMap,
    LineMap,
    RobotMap,
    Submap,
    Trajectory,
    component_name,
)
from tests.mapweave.buildings import BUILDING, part, random_pose


def robot_map(
    rng: Generator,
    robot: str = "a",
    stretches: Sequence[tuple[float, float]] = ((0.0, 12.0), (10.0, 20.0), (18.0, 30.0)),
    components: Sequence[int] = (0, 0, 0),
) -> RobotMap:
    """Return a robot's map of `BUILDING`: a submap for each stretch [m], each in its own frame."""
    homes = {component: random_pose(rng) for component in components}
    submaps = [
        _submap(number, component, low, high, homes[component], rng)
        for number, ((low, high), component) in enumerate(zip(stretches, components, strict=True))
    ]
    return RobotMap(robot, "boot", 3, tuple(submaps))


def _submap(
    number: int, component: int, low: float, high: float, home: FloatArray, rng: Generator
) -> Submap:
    """Return the submap of BUILDING from `low` to `high`; `home` is its component's frame there."""
    frame = random_pose(rng)
    known = part(BUILDING, low, high)
    support = rng.integers(1, 60, len(known.segments))
    known = LineMap(known.segments, known.polyline, support, known.free_space)
    along = np.linspace(low + 0.5, high - 0.5, 8)
    path = np.column_stack([along, np.full(8, 1.1), np.zeros(8)])
    into = se2.inverse(frame)
    index = 8 * number + np.arange(8)
    stamps = np.where(index == 3, np.nan, 0.1 * index)
    trajectory = Trajectory(index, stamps, se2.compose(into, path))
    pose = se2.compose(se2.inverse(home), frame)
    return Submap(number, component, pose, known.moved(into), trajectory)


def joint_map(
    maps: Sequence[RobotMap], poses: Sequence[FloatArray], confidence: float = 0.93
) -> JointMap:
    """Return the joint map of one component in which component 0 of each of `maps` has its pose."""
    robots = {component_name(m.robot, 0): pose for m, pose in zip(maps, poses, strict=True)}
    lines = LineMap.union([m.lines(0).moved(p) for m, p in zip(maps, poses, strict=True)])
    certain = np.linspace(0.0, 1.0, len(lines.segments))
    return JointMap(4, (JointComponent(robots, confidence, lines, certain),), ())


def true_poses(maps: Sequence[RobotMap]) -> list[FloatArray]:
    """Return where component 0 of each map lies in the first one's: all drove along y = 1.1 m."""
    homes = [_first_pose(m) for m in maps]
    return [se2.compose(homes[0], se2.inverse(home)) for home in homes]


def _first_pose(some_map: RobotMap) -> FloatArray:
    """Return the building's frame in that of component 0: its first scan is at (0.5, 1.1, 0)."""
    first = some_map.submaps[0]
    return se2.compose(
        se2.compose(first.pose, first.trajectory.pose[0]), np.array([-0.5, -1.1, 0.0])
    )
