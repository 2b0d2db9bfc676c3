"""A stored map as a robot is to find itself in: components of lines, each in a frame of its own."""

from collections.abc import Iterator
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
        What was marked in it, each held by a submap.
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
        else:
            found = [(k, np.zeros(3), c.map) for k, c in enumerate(stored.components)]
        submaps = tuple(
            Submap(number, component, pose, lines, Trajectory.empty())
            for number, (component, pose, lines) in enumerate(found)
        )
        return cls(submaps, tuple(_marks(stored)))

    @property
    def components(self) -> dict[int, LineMap]:
        """The lines of each component, in its frame."""
        numbers = sorted({s.component for s in self.submaps})
        return {k: lines_of(s for s in self.submaps if s.component == k) for k in numbers}


def _marks(stored: RobotMap | JointMap) -> Iterator[Mark]:
    """Yield the marks of a stored map where they lie in the frame of a submap of the known one."""
    if isinstance(stored, JointMap):
        for number, component in enumerate(stored.components):
            for placed in component.marks:
                yield _held(placed, number, placed.position)
        return
    number_of = {submap.id: number for number, submap in enumerate(stored.submaps)}
    for mark in stored.marks:
        found = find(stored.submaps, mark.anchor)
        if found is not None:
            submap, pose = found
            yield _held(mark, number_of[submap.id], se2.transform_points(pose, mark.position))


def _held(said: Mark | PlacedMark, number: int, place: FloatArray) -> Mark:
    """Return a mark at (2,) `place` [m] in the frame of submap `number`."""
    return Mark(said.id, said.label, said.by, said.time, Anchor(number, None), place)
