"""Whether robots were joined rightly: their places to each other against the truth."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.maps import JointMap, RobotMap, component_name
from mapweave_deploy.run.team_plan import Member


@dataclass(frozen=True, slots=True)
class Limits:
    """How far from the truth is right still.

    Attributes
    ----------
    distance
        [m]
    angle
        [rad]
    """

    distance: float
    angle: float


@dataclass(frozen=True, slots=True)
class PairEvaluation:
    """How two components that were joined lie to each other, against the truth.

    Attributes
    ----------
    reference, other
        Component names.
    distance
        By how much points on the path of `other` are displaced, at the median [m]; NaN where the
        two are in different places: how these lie to each other is not known.
    angle
        By how much it is turned [rad]; NaN likewise.
    right
        Whether that is within the limits; None where it cannot be known: two logs may be of one
        building.
    """

    reference: str
    other: str
    distance: float
    angle: float
    right: bool | None


@dataclass(frozen=True, slots=True, eq=False)
class PlacedRobot:
    """A component with its place in the joint map and in truth.

    Attributes
    ----------
    name
        Such as ``r1/0``.
    place
        Where the truth is given: in one log, or one world.
    joint, true
        (3,) poses of the component's frame [m, m, rad]; `true` is None where it is not known.
    path
        (m, 2) of its scans, in its frame [m].
    """

    name: str
    place: str
    joint: FloatArray
    true: FloatArray | None
    path: FloatArray


def judge(
    joint: JointMap, maps: Mapping[str, RobotMap], members: Sequence[Member], limits: Limits
) -> Iterator[PairEvaluation]:
    """Yield a verdict on every pair of components that `joint` holds together.

    Pairs in one place whose truth is not known are left out.
    """
    placed = {
        part.name: part
        for member in members
        if member.robot in maps
        for part in _placed(joint, maps[member.robot], member)
    }
    for component in joint.components:
        for reference, other in combinations(sorted(component.robots), 2):
            if reference in placed and other in placed:
                yield from _compare(placed[reference], placed[other], limits)


def _placed(joint: JointMap, robot_map: RobotMap, member: Member) -> Iterator[PlacedRobot]:
    """Yield the components of a robot's map that are in the joint map."""
    poses = {name: pose for part in joint.components for name, pose in part.robots.items()}
    for component in robot_map.components:
        name = component_name(robot_map.robot, component)
        index, path = component_path(robot_map, component)
        _, here, there = np.intersect1d(index, member.truth_index, return_indices=True)
        if name in poses:
            true = se2.fit(path[here], member.truth_pose[there]) if len(here) else None
            yield PlacedRobot(name, member.place, poses[name], true, path[:, :2])


def scan_counts(robot_map: RobotMap) -> Counter[str]:
    """Return by name how many scans each component of a robot's map has."""
    counts: Counter[str] = Counter()
    for submap in robot_map.submaps:
        name = component_name(robot_map.robot, submap.component)
        counts[name] += len(submap.trajectory.scan_index)
    return counts


def main_component(robot_map: RobotMap) -> str:
    """Return the name of the component with most scans, which stands for the robot."""
    return scan_counts(robot_map).most_common(1)[0][0]


def component_path(robot_map: RobotMap, component: int) -> tuple[IntArray, FloatArray]:
    """Return the (m,) scan indices and (m, 3) poses of a component's scans, in its frame."""
    submaps = [submap for submap in robot_map.submaps if submap.component == component]
    index = [submap.trajectory.scan_index for submap in submaps]
    poses = [se2.compose(submap.pose, submap.trajectory.pose) for submap in submaps]
    return np.concatenate(index), np.concatenate(poses)


def _compare(
    reference: PlacedRobot, other: PlacedRobot, limits: Limits
) -> Iterator[PairEvaluation]:
    if reference.place != other.place:
        yield PairEvaluation(reference.name, other.name, np.nan, np.nan, right=None)
    elif reference.true is not None and other.true is not None:
        true = se2.between(reference.true, other.true)
        yield _compare_poses(reference, other, true, limits)


def _compare_poses(
    reference: PlacedRobot, other: PlacedRobot, true: FloatArray, limits: Limits
) -> PairEvaluation:
    """Judge by `true` (3,), the pose of `other` in the frame of `reference`."""
    found = se2.between(reference.joint, other.joint)
    apart = se2.transform_points(found, other.path) - se2.transform_points(true, other.path)
    distance = float(np.median(np.linalg.norm(apart, axis=1)))
    angle = float(np.abs(se2.wrap(found[2] - true[2])))
    right = distance <= limits.distance and angle <= limits.angle
    return PairEvaluation(reference.name, other.name, distance, angle, right)
