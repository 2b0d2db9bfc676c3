"""The incremental mapper: a robot's map from its raw scans (paper, V).

Each scan becomes segments, is tracked, and is merged into the growing submap. A scan that fits
nowhere waits; when several in a row fit nowhere, the robot is lost and starts a new component.
"""

from dataclasses import dataclass

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave import se2
from mapweave.arrays import FloatArray
from mapweave.maps import RobotMap, Submap
from mapweave.names import check_id
from mapweave.scan import Scan
from mapweave.segments import ScanSegments, SegmentParameters, extract_segments
from mapweave.submap import GrowingSubmap, SubmapParameters
from mapweave.surface import Surface, scan_surface
from mapweave.tracker import Tracked, Tracker, TrackerParameters


class MapperParameters(BaseModel):
    """One model for each stage."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    segments: SegmentParameters = SegmentParameters()
    tracker: TrackerParameters = TrackerParameters()
    submap: SubmapParameters = SubmapParameters()
    sight: float = Field(
        14.0, gt=0, description="[m] returns up to here are aligned; farther ones are too sparse"
    )
    patience: int = Field(
        5, ge=1, description="scans in a row that fit nowhere before the robot counts as lost"
    )


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """What became of a scan.

    Attributes
    ----------
    placed
        Whether it is in the map; one that waits may be placed by a later call.
    component
        The component the robot is in now.
    submap_finished
        Whether this call finished a submap.
    lost
        Whether this call started a new component.
    """

    placed: bool
    component: int
    submap_finished: bool
    lost: bool


@dataclass(frozen=True, slots=True, eq=False)
class _Prepared:
    """A scan with its segments and oriented points."""

    scan: Scan
    segments: ScanSegments
    surface: Surface


class Mapper:
    """Maps the scans of one robot."""

    def __init__(
        self, robot: str, boot: str = "0", parameters: MapperParameters | None = None
    ) -> None:
        self.robot = check_id("robot", robot)
        self.boot = boot
        self.parameters = parameters or MapperParameters()
        self._version = 0
        self._finished: list[Submap] = []
        self._component = 0
        self._tracker = Tracker(self.parameters.tracker)
        self._growing = GrowingSubmap(self.parameters.submap)
        self._frame: FloatArray = se2.IDENTITY
        self._waiting: list[_Prepared] = []

    def add(self, scan: Scan) -> Placement:
        """Take the next scan."""
        prepared = self._prepare(scan)
        if len(prepared.surface) < self.parameters.tracker.min_points:
            return Placement(False, self._component, False, False)  # blind: nothing to place
        finished = len(self._finished)
        lost = False
        placed = self._place(prepared)
        if not placed:
            self._waiting.append(prepared)
            if len(self._waiting) >= self.parameters.patience:
                lost = self._start_again()
                placed = True
        return Placement(placed, self._component, len(self._finished) > finished, lost)

    def robot_map(self) -> RobotMap:
        """Return the finished submaps and the growing one."""
        growing = [] if self._growing.is_empty else [self._submap()]
        return RobotMap(self.robot, self.boot, self._version, (*self._finished, *growing))

    def _prepare(self, scan: Scan) -> _Prepared:
        segments = extract_segments(scan, self.parameters.segments)
        return _Prepared(scan, segments, scan_surface(scan, segments, self.parameters.sight))

    def _place(self, prepared: _Prepared) -> bool:
        tracked = self._tracker.place(prepared.scan, prepared.surface)
        if tracked is None:
            self._tracker.forget_motion()
            return False
        self._merge(prepared, tracked.pose)
        self._place_waiting()
        return True

    def _place_waiting(self) -> None:
        """Try the scans that wait once more, from the one next to the known pose backwards."""
        pose = self._tracker.pose
        for prepared in reversed(self._waiting):
            tracked: Tracked | None = self._tracker.revisit(prepared.scan, prepared.surface, pose)
            if tracked is not None:
                self._merge(prepared, tracked.pose)
                pose = tracked.pose
        self._waiting.clear()

    def _start_again(self) -> bool:
        """Begin a new component with the scans that wait; they fit each other or wait on."""
        waiting, self._waiting = self._waiting, []
        if not self._growing.is_empty:
            self._finish_submap()
            self._component += 1
        self._tracker = Tracker(self.parameters.tracker)
        self._growing = GrowingSubmap(self.parameters.submap)
        self._frame = se2.IDENTITY
        for prepared in waiting:
            if not self._place(prepared):
                self._waiting.append(prepared)
        return True

    def _merge(self, prepared: _Prepared, pose: FloatArray) -> None:
        """Merge a scan at `pose`, tracker's frame, into the growing submap."""
        if self._growing.is_full:
            self._finish_submap()
            self._growing = GrowingSubmap(self.parameters.submap)
        if self._growing.is_empty:
            self._frame = pose
        local = se2.between(self._frame, pose)
        self._growing.add(prepared.scan, prepared.segments.segments, local)
        self._version += 1

    def _finish_submap(self) -> None:
        self._finished.append(self._submap())

    def _submap(self) -> Submap:
        return Submap(
            len(self._finished),
            self._component,
            np.array(self._frame),
            self._growing.line_map(),
            self._growing.trajectory(),
        )
