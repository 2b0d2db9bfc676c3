"""Who is in a team of many: robots of recordings cut into stretches, and of buildings made up."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.logs import Log
from benchmarks.pairs import is_right, judge
from benchmarks.scale.made_up import robots_of
from benchmarks.stretches import Stretch, map_stretches
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment, RobotMap

PACE = 30.0  # [s] for a submap, where no stamps tell


@dataclass(frozen=True, slots=True, eq=False)
class Member:
    """A robot of the team.

    Attributes
    ----------
    building
        Where it drives.
    robot_map
        As it is in the end.
    finished
        (n,) when each of its submaps was [s], ascending; all robots start at 0.
    frame
        (3,) of its map in the building, where that is made up.
    stretch
        What it is of, where that is recorded.
    """

    building: str
    robot_map: RobotMap
    finished: FloatArray
    frame: FloatArray | None = None
    stretch: Stretch | None = None

    def at(self, count: int) -> RobotMap:
        """Return its map when `count` submaps were finished."""
        return replace(self.robot_map, version=count, submaps=self.robot_map.submaps[:count])


def recorded(logs: Sequence[Log], counts: Sequence[int]) -> Iterator[Member]:
    """Yield the robots of recordings, each cut into so many stretches."""
    for log in logs:
        for count in counts:
            for stretch in map_stretches(log, count):
                yield Member(
                    log.building, stretch.robot_map, _finished(stretch.robot_map), stretch=stretch
                )


def made_up(buildings: int, robots: int) -> Iterator[Member]:
    """Yield so many robots in so many buildings made up, spread evenly."""
    for seed in range(buildings):
        count = robots * (seed + 1) // buildings - robots * seed // buildings
        maps, frames = robots_of(seed, count)
        for robot_map, frame in zip(maps, frames, strict=True):
            yield Member(f"made up {seed}", robot_map, _finished(robot_map), frame=frame)


def _finished(robot_map: RobotMap) -> FloatArray:
    """(n,) when the last scan of each submap was taken, from the robot's first one on [s]."""
    stamps = [s.trajectory.stamp for s in robot_map.submaps]
    first = min((s.min() for s in stamps if len(s)), default=0.0)
    last = np.array([s.max() - first if len(s) else np.nan for s in stamps])
    steps = PACE * np.arange(1, len(last) + 1)
    return np.maximum.accumulate(np.where(np.isfinite(last), last, steps))


def is_joined_right(one: Member, other: Member, found: Alignment) -> bool | None:
    """Tell whether an accepted alignment of `other` in `one` is right; None where it is not known.

    The corrected poses of two recordings of one building share no frame.
    """
    if one.building != other.building:
        return False
    if one.stretch is not None and other.stretch is not None:
        same = one.stretch.log == other.stretch.log
        return judge(one.stretch, other.stretch, found).right if same else None
    assert one.frame is not None  # made up
    assert other.frame is not None
    true = se2.between(one.frame, other.frame)
    middle = other.robot_map.lines(0).segments.reshape(-1, 2).mean(axis=0)
    apart = se2.transform_points(found.transform, middle) - se2.transform_points(true, middle)
    turn = float(np.abs(se2.wrap(found.transform[2] - true[2])))
    return is_right(float(np.hypot(*apart)), turn)
