"""The incremental mapper: a robot's map from its raw scans (paper, V).

Each scan becomes segments, is tracked, and is merged into the growing submap. A scan that fits
nowhere waits; when several in a row fit nowhere, the robot is lost and starts a new component.
"""

from dataclasses import dataclass

from pydantic import BaseModel, ConfigDict, Field

from mapweave import se2
from mapweave.arrays import FloatArray
from mapweave.assembly import place, unite_lines
from mapweave.fusion import FusionParameters
from mapweave.loop_closing import LoopCloser, LoopParameters
from mapweave.maps import LineMap, RobotMap, Submap
from mapweave.names import check_id
from mapweave.observation import Observation, ObservationParameters, observe
from mapweave.reunion import reunite
from mapweave.scan import Scan
from mapweave.submap import GrowingSubmap, SubmapParameters
from mapweave.tracker import Tracked, Tracker, TrackerParameters
from mapweave.uncertainty import UncertaintyParameters, pose_uncertainty, turn_uncertainty


class MapperParameters(BaseModel):
    """One model for each stage."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    observation: ObservationParameters = ObservationParameters()
    tracker: TrackerParameters = TrackerParameters()
    uncertainty: UncertaintyParameters = UncertaintyParameters()
    submap: SubmapParameters = SubmapParameters()
    fusion: FusionParameters = FusionParameters()
    loops: LoopParameters = LoopParameters()
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
        self._origin: FloatArray = se2.IDENTITY  # of the tracker's frame in the component's
        self._frame: FloatArray = se2.IDENTITY  # of the growing submap in the tracker's frame
        self._waiting: list[Observation] = []
        self._loops = LoopCloser(self.parameters.loops)
        self._follows = False  # whether the growing submap was tracked from the last finished one

    def add(self, scan: Scan) -> Placement:
        """Take the next scan."""
        seen = observe(scan, self.parameters.observation)
        if self._tracker.is_blind(seen):
            return Placement(False, self._component, False, False)  # blind: nothing to place
        finished = len(self._finished)
        lost = False
        placed = self._place(seen)
        if not placed:
            self._waiting.append(seen)
            if len(self._waiting) >= self.parameters.patience:
                self._start_again()
                lost = True
                placed = seen not in self._waiting
        return Placement(placed, self._component, len(self._finished) > finished, lost)

    def finish(self) -> RobotMap:
        """Finish the growing submap, as at the end of a log, and return the map."""
        if not self._growing.is_empty:
            self._finish_submap()
        return self.robot_map()

    def robot_map(self) -> RobotMap:
        """Return the finished submaps and the growing one."""
        growing = [] if self._growing.is_empty else [self._submap()]
        return RobotMap(self.robot, self.boot, self._version, (*self._finished, *growing))

    def _place(self, seen: Observation) -> bool:
        tracked = self._tracker.place(seen, self._known)
        if tracked is None:
            self._tracker.forget_motion()
            return False
        self._merge(seen, tracked)
        self._place_waiting()
        return True

    def _known(self) -> LineMap:
        """G_(t-1): the lines around the robot, tracker's frame."""
        growing = [] if self._growing.is_empty else [place(self._growing.lines(), self._frame)]
        to_tracker = se2.inverse(self._origin)
        last = [
            place(s.map, se2.compose(to_tracker, s.pose))
            for s in self._finished[-1:]
            if s.component == self._component
        ]
        return unite_lines(last + growing)

    def _place_waiting(self) -> None:
        """Try the scans that wait once more, from the one next to the known pose backwards."""
        pose = self._tracker.pose
        for seen in reversed(self._waiting):
            tracked: Tracked | None = self._tracker.revisit(seen, pose)
            if tracked is not None:
                self._merge(seen, tracked)
                pose = tracked.pose
        self._waiting.clear()

    def _start_again(self) -> None:
        """Begin a new component with the scans that wait; they fit each other or wait on."""
        waiting, self._waiting = self._waiting, []
        if not self._growing.is_empty:
            self._finish_submap()
        self._component = 1 + max((s.component for s in self._finished), default=-1)
        self._follows = False
        self._tracker = Tracker(self.parameters.tracker)
        self._origin = self._frame = se2.IDENTITY
        for seen in waiting:
            if not self._place(seen):
                self._waiting.append(seen)

    def _merge(self, seen: Observation, tracked: Tracked) -> None:
        """Merge a scan where it was found, tracker's frame, into the growing submap."""
        if self._growing.is_full:
            self._finish_submap()
        if self._growing.is_empty:
            self._frame = tracked.pose
        local = se2.between(self._frame, tracked.pose)
        held = pose_uncertainty(tracked.information, self.parameters.uncertainty)
        held = turn_uncertainty(held, -self._frame[2])
        self._growing.add(seen.scan, seen.lines.segments, local, held)
        self._version += 1

    def _finish_submap(self) -> None:
        """Close the growing submap, and join its component to an older one where shapes allow."""
        submaps = [*self._finished, self._submap()]
        if self._follows and len(submaps) > 1:
            self._loops.track(submaps[-2], submaps[-1])
        submaps, joints = reunite(submaps, self.parameters.fusion)
        for older, younger in joints:
            self._loops.join(submaps[older], submaps[younger])
        self._finished = self._loops.close(submaps)
        self._follows = True
        last = self._finished[-1]
        self._component = last.component
        self._origin = se2.compose(last.pose, se2.inverse(self._frame))
        self._growing = GrowingSubmap(self.parameters.submap)
        self._version += 1

    def _submap(self) -> Submap:
        return Submap(
            len(self._finished),
            self._component,
            se2.compose(self._origin, self._frame),
            self._growing.line_map(),
            self._growing.trajectory(),
        )
