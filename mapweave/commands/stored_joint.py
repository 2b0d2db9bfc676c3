"""A stored joint map as one of the maps to fuse: what it has joined stays joined, and is one piece.

Each of its components goes in as a component of a robot, under the name and in the frame of the
first that it was made of; the others come along. Its walls were chosen when it was joined, and say
so: they are not chosen again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.localization.known_map import held_by_submap
from mapweave.maps import (
    JointComponent,
    JointMap,
    RobotMap,
    Submap,
    Trajectory,
    parse_component,
)
from mapweave.marks import Mark

BOOT = "joint"


def as_robot_maps(joint: JointMap) -> list[RobotMap]:
    """Return the components of `joint` as maps of their first robots."""
    submaps: dict[str, list[Submap]] = {}
    marks: dict[str, list[Mark]] = {}
    for component in joint.components:
        name = _first(component)
        robot, number = parse_component(name)
        of_robot = submaps.setdefault(robot, [])
        held = marks.setdefault(robot, [])
        held += [held_by_submap(mark, len(of_robot), mark.position) for mark in component.marks]
        frame = se2.inverse(component.robots[name])
        whole = Submap(len(of_robot), number, frame, component.map, Trajectory.empty())
        of_robot.append(replace(whole, joined=component.segment_confidence))
    return [
        RobotMap(robot, BOOT, joint.version, tuple(found), marks=tuple(marks[robot]))
        for robot, found in submaps.items()
    ]


def robots_of(joint: JointMap) -> set[str]:
    """Return the ids of the robots that `joint` was made of."""
    return {parse_component(name)[0] for component in joint.components for name in component.robots}


def with_members(fused: JointMap, stored: Sequence[JointMap]) -> JointMap:
    """Return `fused` with all that the `stored` joint maps in it were made of.

    Their alignments come first, as they were decided then; what hangs together by them hangs
    together no more surely now.
    """
    members = {_first(c): c for joint in stored for c in joint.components}
    named = {m.id: m.component for joint in stored for c in joint.components for m in c.marks}
    components = tuple(
        replace(
            c,
            robots=_with_members(c.robots, members),
            confidence=min(_confidences(c, members)),
            marks=tuple(replace(m, component=named.get(m.id, m.component)) for m in c.marks),
        )
        for c in fused.components
    )
    decided = tuple(alignment for joint in stored for alignment in joint.alignments)
    return replace(fused, components=components, alignments=(*decided, *fused.alignments))


def _with_members(
    robots: Mapping[str, FloatArray], members: Mapping[str, JointComponent]
) -> dict[str, FloatArray]:
    """Return where all components are, in the order of their names."""
    found = dict(robots)
    for first, pose in robots.items():
        together = members[first].robots if first in members else {}
        for name in together:
            found[name] = se2.compose(pose, se2.between(together[first], together[name]))
    return {name: found[name] for name in sorted(found, key=parse_component)}


def _confidences(component: JointComponent, members: Mapping[str, JointComponent]) -> list[float]:
    """Return how surely each part of a fused component hangs together, and the parts do."""
    parts = [members[name] for name in component.robots if name in members]
    return [component.confidence, *(part.confidence for part in parts)]


def _first(component: JointComponent) -> str:
    return min(component.robots, key=parse_component)
