"""The map of a robot at one moment, to be drawn elsewhere while the robot drives on.

Drawing the lines of a growing submap takes longer than a scan does.
"""

import pickle
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from mapweave.mapping.submap_builder import SubmapBuilder
from mapweave.maps import LineMap, MadeWith, RobotMap, Submap
from mapweave.marks import Mark

Draw: TypeAlias = Callable[[bytes], LineMap]
"""Draws the lines of a builder, which is pickled: here or in another process."""


def draw_here(builder: bytes) -> LineMap:
    """Return the lines of a builder."""
    unpacked: SubmapBuilder = pickle.loads(builder)  # our own, of a moment ago
    return unpacked.line_map()


class Unsettled:
    """What built a finished submap while that waits to be settled; it takes no more scans."""

    def __init__(self, builder: SubmapBuilder) -> None:
        self._builder = builder
        self._walls: LineMap | None = None

    def walls(self, draw: Draw | None = None) -> LineMap:
        """Return its lines as they were tracked, drawn once: by `draw`, or as they are."""
        if self._walls is None:
            builder = self._builder
            self._walls = builder.line_map() if draw is None else draw(MapSnapshot.packed(builder))
        return self._walls


def with_walls(
    submaps: Sequence[Submap], unsettled: Sequence[Unsettled], draw: Draw | None = None
) -> list[Submap]:
    """Return `submaps`, of the last, which are not settled, the walls and not their outlines."""
    settled = len(submaps) - len(unsettled)
    drawn = [
        replace(submap, map=each.walls(draw))
        for submap, each in zip(submaps[settled:], unsettled, strict=True)
    ]
    return [*submaps[:settled], *drawn]


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
        What built the last of these, as long as they are not settled.
    growing
        The submap that grows, without its lines.
    builder
        What builds it, pickled.
    marks
        Those of the map that the run goes on from.
    draw
        Draws lines.
    """

    robot: str
    boot: str
    version: int
    made_with: MadeWith | None
    finished: tuple[Submap, ...]
    unsettled: tuple[Unsettled, ...]
    growing: Submap | None
    builder: bytes
    marks: tuple[Mark, ...] = ()
    draw: Draw = draw_here

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
        submaps = with_walls(self.finished, self.unsettled, self.draw)
        if self.growing is not None:
            submaps.append(replace(self.growing, map=self.draw(self.builder)))
        made_with, marks = self.made_with, self.marks
        return RobotMap(self.robot, self.boot, self.version, tuple(submaps), made_with, marks)
