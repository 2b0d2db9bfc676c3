"""A stored map as a robot is to find itself in: components of lines, each in a frame of its own."""

from dataclasses import dataclass

import numpy as np

from mapweave.anchors import find
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import JointMap, LineMap, RobotMap, Submap, Trajectory, lines_of
from mapweave.marks import Anchor, Mark, PlacedMark


@dataclass(frozen=True, slots=True, eq=False)
class KnownMap:
    """What is known of a building before a robot is set down in it.

    Attributes
    ----------
    submaps
        As they were stored, without the paths of those who mapped them; ids from 0.
    marks
        On them, held by submaps.
    """

    submaps: tuple[Submap, ...]
    marks: tuple[Mark, ...] = ()

    @classmethod
    def of(cls, stored: RobotMap | JointMap) -> "KnownMap":
        """Return what `stored` says of the building.

        A robot's map keeps its components and their numbers. Those of a joint map are numbered as
        they stand in it, each in its own frame.
        """
        if isinstance(stored, RobotMap):
            found = [(s.component, s.pose, s.map) for s in stored.submaps]
            marks = _marks_of_robot(stored)
        else:
            found = [(k, np.zeros(3), c.map) for k, c in enumerate(stored.components)]
            marks = [
                held_by_submap(mark, k, mark.position)
                for k, component in enumerate(stored.components)
                for mark in component.marks
            ]
        submaps = tuple(
            Submap(number, component, pose, lines, Trajectory.empty())
            for number, (component, pose, lines) in enumerate(found)
        )
        return cls(submaps, tuple(marks))

    @property
    def components(self) -> dict[int, LineMap]:
        """The lines of each component, in its frame."""
        numbers = sorted({s.component for s in self.submaps})
        return {k: lines_of(s for s in self.submaps if s.component == k) for k in numbers}


def held_by_submap(mark: Mark | PlacedMark, submap: int, position: FloatArray) -> Mark:
    """Return `mark` at `position` (2,) [m] in the frame of a submap, which holds it."""
    return Mark(mark.id, mark.label, mark.by, mark.time, Anchor(submap, None), position)


def _marks_of_robot(stored: RobotMap) -> list[Mark]:
    """Return the marks of a robot's map, its submaps counted from 0, without their scans."""
    numbers = {submap.id: k for k, submap in enumerate(stored.submaps)}
    found = ((mark, find(stored.submaps, mark.anchor)) for mark in stored.marks)
    return [
        held_by_submap(mark, numbers[held[0].id], se2.transform_points(held[1], mark.position))
        for mark, held in found
        if held is not None
    ]
