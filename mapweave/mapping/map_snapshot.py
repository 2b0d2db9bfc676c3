"""The map of a robot at one moment, to be drawn elsewhere while the robot drives on.

Drawing the lines of a growing submap takes longer than a scan does.
"""

import pickle
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from mapweave.mapping.submap_builder import SubmapBuilder
from mapweave.maps import LineMap, MadeWith, RobotMap, Submap
from mapweave.marks import Mark


class Unsettled:
    """What built the last finished submap while that is being settled; it takes no more scans."""

    def __init__(self, builder: SubmapBuilder) -> None:
        self._builder = builder

    @cached_property
    def walls(self) -> LineMap:
        """Its lines as they were tracked."""
        return self._builder.line_map()


def with_walls(submaps: Sequence[Submap], unsettled: Unsettled | None) -> list[Submap]:
    """Return `submaps`, of the one that is being settled the walls, and not its outline."""
    if unsettled is None:
        return list(submaps)
    return [*submaps[:-1], replace(submaps[-1], map=unsettled.walls)]


@dataclass(frozen=True, slots=True, eq=False)
class MapSnapshot:
    """All that a map is made of; nobody changes it any more.

    Attributes
    ----------
    robot, boot, version, made_with
        As of `RobotMap`.
    finished
        Submaps.
    unsettled
        What built the last of these, while it is being settled.
    growing
        The submap that grows, without its lines.
    builder
        What builds it, pickled.
    marks
        Those of the map that the run goes on from.
    """

    robot: str
    boot: str
    version: int
    made_with: MadeWith | None
    finished: tuple[Submap, ...]
    unsettled: Unsettled | None
    growing: Submap | None
    builder: bytes
    marks: tuple[Mark, ...] = ()

    @classmethod
    def packed(cls, builder: SubmapBuilder) -> bytes:
        """Return `builder` as it is now."""
        return pickle.dumps(builder, pickle.HIGHEST_PROTOCOL)

    @property
    def submaps(self) -> tuple[Submap, ...]:
        """All submaps where they are, the growing one without its lines."""
        return self.finished if self.growing is None else (*self.finished, self.growing)

    def robot_map(self) -> RobotMap:
        """Draw the map."""
        submaps = with_walls(self.finished, self.unsettled)
        if self.growing is not None:
            builder: SubmapBuilder = pickle.loads(self.builder)  # our own, of a moment ago
            submaps.append(replace(self.growing, map=builder.line_map()))
        made_with, marks = self.made_with, self.marks
        return RobotMap(self.robot, self.boot, self.version, tuple(submaps), made_with, marks)
