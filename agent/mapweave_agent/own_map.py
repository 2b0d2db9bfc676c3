"""The map of a run: mapped or followed here, drawn for others, with the marks made on it."""

import threading
import time
from collections import Counter
from dataclasses import replace

from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.placement import Placement
from mapweave.mapping.scan_mapper import ScanMapper
from mapweave.maps import RobotMap
from mapweave.scan.scan import Scan
from mapweave_agent.by_hand.own_marks import Frame, OwnMarks
from mapweave_agent.past_runs import numbered_from
from mapweave_agent.stored.team_place import path_of
from mapweave_protocol.wire.messages import MapVersion


class OwnMap:
    """What a run maps; marks may be made from any thread.

    Parameters
    ----------
    mapper
        Maps the scans, or follows them in a known map.
    first
        The number of the run's first component.

    Attributes
    ----------
    robot, boot
        Of the run.
    known
        The stored map in which the robot only follows, numbered likewise; None if it maps.
    told
        The map as it was published last: without what is of others' making.
    marks
        Those that the run made, and those of the map that it goes on from.
    """

    def __init__(self, mapper: ScanMapper, first: int) -> None:
        self.robot, self.boot = mapper.robot, mapper.boot
        self._mapper = mapper
        self._first = first
        self._mapping = threading.Lock()
        followed = mapper.followed
        self.known = None if followed is None else numbered_from(followed, first)
        # A stored map that it begins with is there, and may be asked for, before the first scan.
        self._whole = numbered_from(mapper.robot_map(), first)
        self.told = path_of(self._whole, self.known)
        self._placed_before = _scans_placed(self.told)
        self.marks = OwnMarks(mapper.robot, mapper.boot, self.told.marks)

    @property
    def whole(self) -> RobotMap:
        """The map as it was published last, with what it was begun with, and all marks."""
        known = () if self.known is None else self.known.marks
        return replace(self._whole, marks=(*known, *self.marks.all))

    @property
    def state(self) -> MapVersion | None:
        """Which state of the map was published last, None while there is nothing in it."""
        return MapVersion.of(self.told) if self.told.submaps else None

    @property
    def scans_placed(self) -> int:
        """How many scans of this run are in the map, as published last."""
        return max(0, _scans_placed(self.told) - self._placed_before)

    def add(self, scan: Scan) -> Placement:
        """Map a scan."""
        with self._mapping:
            return self._mapper.add(scan)

    def mark(self, label: str, place: FloatArray, frame: Frame) -> str:
        """Mark a (2,) `place` [m] from any thread; as of `OwnMarks.add`."""
        with self._mapping:
            snapshot = self._mapper.snapshot()
        return self.marks.add(snapshot.submaps, label, place, frame, time.time())

    def drawn(self) -> RobotMap:
        """Return the map as it is now, of what is of its own making."""
        return path_of(self._drawn(), self.known)

    def publish(self) -> None:
        """Draw what is told from now on."""
        self._whole = self._drawn()
        self.told = path_of(self._whole, self.known)

    def _drawn(self) -> RobotMap:
        with self._mapping:
            snapshot = self._mapper.snapshot()
        drawn = snapshot.robot_map()
        # Where a robot is in a known map is known of a single scan as well.
        return numbered_from(drawn if self.known else without_strays(drawn), self._first)


def _scans_placed(robot_map: RobotMap) -> int:
    return sum(len(submap.trajectory.scan_index) for submap in robot_map.submaps)


def without_strays(robot_map: RobotMap) -> RobotMap:
    """Return `robot_map` less the components of a single scan, unless there is no other.

    Where the robot was then is known to nothing. Peers would compare it, and the team's map would
    show it, for good. One of no scan at all is of a stored map.
    """
    scans: Counter[int] = Counter()
    for submap in robot_map.submaps:
        scans[submap.component] += len(submap.trajectory.scan_index)
    placed = tuple(s for s in robot_map.submaps if scans[s.component] != 1)
    return replace(robot_map, submaps=placed) if placed else robot_map
