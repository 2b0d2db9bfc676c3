"""Marks on robots' maps, carried into the joint map: each lies with the submap that holds it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from mapweave.anchors import find, placed
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import RobotMap, Submap, component_name
from mapweave.marks import Mark, PlacedMark

HeldMarks: TypeAlias = Mapping[str, Sequence["HeldMark"]]
"""By the name of the component that they are in."""


@dataclass(frozen=True, slots=True, eq=False)
class HeldMark:
    """A mark in the submap that holds it by now.

    Attributes
    ----------
    mark
        The mark.
    robot
        Whose map it is on.
    submap
        Where its anchor is.
    pose
        (3,) of the anchor in the submap's frame [m, m, rad].
    """

    mark: Mark
    robot: str
    submap: Submap
    pose: FloatArray


def held_marks(maps: Iterable[RobotMap]) -> HeldMarks:
    """Return the marks of `maps`, each once; those whose scan is in no submap yet are left out.

    The same mark is on several maps where one run went on from the map of another.
    """
    held: dict[str, list[HeldMark]] = {}
    known: set[str] = set()
    for robot_map in maps:
        for mark in robot_map.marks:
            found = find(robot_map.submaps, mark.anchor)
            if found is not None and mark.id not in known:
                known.add(mark.id)
                name = component_name(robot_map.robot, found[0].component)
                held.setdefault(name, []).append(HeldMark(mark, robot_map.robot, *found))
    return held


def laid_down(
    marks: HeldMarks,
    frames: Mapping[str, FloatArray],
    submaps: Mapping[str, Sequence[Submap]],
    poses: Mapping[str, Sequence[FloatArray]],
) -> tuple[PlacedMark, ...]:
    """Return the marks of a joint component in its frame.

    Parameters
    ----------
    frames
        (3,) of its components in its frame [m, m, rad].
    submaps, poses
        Of each of these the submaps, and (3,) where each of them lies in the component's frame.
    """
    found = []
    for name, frame in frames.items():
        where = {s.id: pose for s, pose in zip(submaps[name], poses[name], strict=True)}
        for held in marks.get(name, ()):
            pose = se2.compose(frame, se2.compose(where[held.submap.id], held.pose))
            found.append(placed(held.mark, held.robot, held.submap, pose))
    return tuple(found)
