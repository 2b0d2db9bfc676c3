"""A stored map as a robot is to find itself in: components of lines, each in a frame of its own."""

from dataclasses import dataclass

import numpy as np

from mapweave.maps import JointMap, LineMap, RobotMap, Submap, Trajectory, lines_of


@dataclass(frozen=True, slots=True, eq=False)
class KnownMap:
    """What is known of a building before a robot is set down in it.

    Attributes
    ----------
    submaps
        As they were stored, without the paths of those who mapped them; ids from 0.
    """

    submaps: tuple[Submap, ...]

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
        return cls(
            tuple(
                Submap(number, component, pose, lines, Trajectory.empty())
                for number, (component, pose, lines) in enumerate(found)
            )
        )

    @property
    def components(self) -> dict[int, LineMap]:
        """The lines of each component, in its frame."""
        numbers = sorted({s.component for s in self.submaps})
        return {k: lines_of(s for s in self.submaps if s.component == k) for k in numbers}
