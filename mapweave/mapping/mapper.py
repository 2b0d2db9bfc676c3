"""The incremental mapper: a robot's map from its raw scans (paper, V).

Each scan becomes segments, is tracked, and is merged into the growing submap. A scan that fits
nowhere waits; when several in a row fit nowhere or are blind, the robot is lost and starts a new
component.
"""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import replace

from mapweave.config import Config
from mapweave.errors import ArgumentError, FinishedError
from mapweave.geometry import se2
from mapweave.geometry.arguments import check_kind
from mapweave.geometry.arrays import FloatArray
from mapweave.ids import check_id
from mapweave.mapping.backend import Backend, BackendParameters, BackendRunner, FinishedSubmap
from mapweave.mapping.continuation import first_component, marks_to_continue, scans_in, to_continue
from mapweave.mapping.map_snapshot import Draw, MapSnapshot, draw_here, with_walls
from mapweave.mapping.placement import Placement
from mapweave.mapping.settling import SettlingQueue
from mapweave.mapping.submap_builder import SubmapBuilder
from mapweave.mapping.tracking.acceptance import ScanMatch
from mapweave.mapping.tracking.deskewing import Deskewer
from mapweave.mapping.tracking.loss import Loss
from mapweave.mapping.tracking.observation import (
    Observation,
    ObservationParameters,
    measured,
    observe,
)
from mapweave.mapping.tracking.pose_covariance import (
    EXACT,
    PoseCovarianceParameters,
    pose_uncertainty,
    turn_uncertainty,
)
from mapweave.mapping.tracking.sweep_time import SweepJudge, SweepParameters
from mapweave.mapping.tracking.tracker import Found, Tracker, TrackerParameters
from mapweave.maps import LineMap, MadeWith, RobotMap, Submap
from mapweave.parameters import StageParameters, derived
from mapweave.scan.own_body import OwnBody, OwnBodyParameters
from mapweave.scan.range_noise import RangeNoise
from mapweave.scan.scan import UNNUMBERED, Scan

AT_ONCE = 2  # scans that wait are placed with each one that comes: a loss holds nobody up
LATE = 30  # scans that wait are so many, as where all are judged again, that it takes
AGAIN = 4  # with each one that comes, to catch up
SUSPENSE = 24  # times the patience, while it is open whether a robot sees itself


class MapperParameters(StageParameters):
    """One model for each stage."""

    own_body: OwnBodyParameters = derived(OwnBodyParameters.of)
    observation: ObservationParameters = derived(ObservationParameters.of)
    tracker: TrackerParameters = derived(TrackerParameters.of)
    sweeps: SweepParameters = derived(SweepParameters.of)
    uncertainty: PoseCovarianceParameters = derived(PoseCovarianceParameters.of)
    backend: BackendParameters = derived(BackendParameters.of)
    patience: int = derived(
        lambda c: c.mapping.patience,
        ge=1,
        description="scans in a row that fit nowhere, were not confirmed by the next one, or were"
        " blind, before the robot counts as lost",
    )


class Mapper:
    """Maps the scans of one robot, one by one.

    Examples
    --------
    >>> mapper = Mapper("a")
    >>> mapper.add(Scan.of([float("nan")] * 181, angle_min=-1.57, angle_increment=0.01745)).placed
    False
    >>> mapper.finish().submaps  # blind all the time
    ()

    Parameters
    ----------
    robot, boot
        The robot's id, ``[a-z0-9][a-z0-9_-]{0,31}``, and which run of it this is.
    parameters
        Of every stage; those that derive from `config` by default.
    backend
        Settles finished submaps with the parameters given here, as by default it is done in
        between; the map is the same.
    config
        What the map says that it was made with, unless other parameters are given.
    live
        Whether no scan may wait for the backend: where that is late, finished submaps queue for
        it, and its outcome is adopted later. Poses are wanted at once: as `prompt`.
    prompt
        Whether what takes long is done at once: else the scans that come meanwhile wait, so that
        none takes much longer than others; the map is the same.
    on_warning
        Told in words what is odd about the scans, once: that the robot sees itself.
    known
        A map to go on from: its submaps come first, and the run is joined to them by shape, as a
        robot's own components are. Scans that are counted from 0 again are counted on. A backend
        that is given must know the same.
    draw
        Draws the lines of snapshots, where these are drawn.
    """

    def __init__(
        self,
        robot: str = "r1",
        boot: str = "0",
        parameters: MapperParameters | None = None,
        backend: BackendRunner | None = None,
        config: Config | None = None,
        *,
        live: bool = False,
        prompt: bool = False,
        on_warning: Callable[[str], None] | None = None,
        known: RobotMap | None = None,
        draw: Draw = draw_here,
    ) -> None:
        self.robot = check_id("robot", robot)
        self.boot = boot
        config = Config() if config is None else config
        check_kind("config", config, Config)
        self.parameters = parameters or MapperParameters.of(config)
        as_configured = self.parameters == MapperParameters.of(config)
        self._made_with = MadeWith.of(config) if as_configured else None
        self._config = config
        says = as_configured and "range_sigma" not in config.sensor.model_fields_set
        self._noise = RangeNoise(config.sensor.range_sigma if says else math.inf)
        self._version = 0
        self._finished = list(to_continue(known))
        self._known = len(self._finished)  # submaps, of an earlier run
        self._marks = marks_to_continue(known)
        self._component = self._newest_component = first_component(self._finished)
        self._on_warning = on_warning
        self._said: set[str] = set()  # of what is odd
        self._body = OwnBody(self.parameters.own_body)
        # Scans to be placed before those: after a loss, those that were missed.
        self._waiting: deque[Observation] = deque()
        self._again: deque[Scan] = deque()  # raw scans to be taken, some of them once more
        # Raw scans so far, as long as no submap is finished.
        self._early: deque[Scan] = deque(maxlen=self.parameters.backend.submap.max_scans)
        self._sweeps = SweepJudge(self.parameters.sweeps)
        self._tracker = Tracker(self.parameters.tracker, self._sweeps)
        self._loss = Loss(self.parameters.patience)
        self._deskewer = Deskewer()
        self._growing = SubmapBuilder(self.parameters.backend.submap)
        self._origin: FloatArray = se2.IDENTITY  # of the tracker's frame in the component's
        self._frame: FloatArray = se2.IDENTITY  # of the growing submap in the tracker's frame
        backend = backend or Backend(self.parameters.backend, self._finished)
        self._prompt = prompt or live
        self._unsettled = SettlingQueue(backend, live=live)
        self._draw = draw
        self._follows = False  # whether the growing submap was tracked from the last finished one
        self._merged: dict[int, Observation] = {}  # by scan index, those of the growing submap
        self._held: FloatArray = EXACT  # how surely the last scan is placed, tracker's frame
        # Of scans that have no number, and the least of those that have: on from an earlier run.
        self._next_index = scans_in(self._finished)
        self._shift: int | None = None  # added to their numbers, where these begin anew
        self.seen: Observation | None = None  # the last scan taken, as it was observed
        self._is_finished = False

    @property
    def followed(self) -> None:
        """None: all that it has is of the robot's making, the map that it goes on from too."""

    def add(self, scan: Scan) -> Placement:
        """Take the next scan.

        Parameters
        ----------
        scan
            One without an index is counted: it takes the number after that of the scan before it.

        Returns
        -------
        Placement
            What became of it.

        Raises
        ------
        FinishedError
            After `finish`.
        ArgumentError
            If it is no scan, or its index is not above that of the scan before it.
        """
        check_kind("scan", scan, Scan)
        scan = measured(self._numbered(scan), self.parameters.observation)
        finished = len(self._finished)
        is_noisy = self._notice_noise(scan)
        if self._body.watch(scan) or self._sweeps.take_news() or is_noisy:
            self._judge_again()
        placed, lost = self._take_next(scan)
        pose, uncertainty = self._whereabouts() if placed else (None, None)
        submap_finished = len(self._finished) > finished
        return Placement(placed, self._component, submap_finished, lost, pose, uncertainty)

    def finish(self) -> RobotMap:
        """Finish the growing submap, as at the end of a log, and return the map.

        No scan can be added any more; the map can be asked for again.
        """
        if self._is_finished:
            return self.robot_map()
        self._is_finished = True
        while self._waiting or self._again:
            self._go_on()
        self._merge_all(self._tracker.settle())
        if not self._growing.is_empty:
            self._finish_submap()
        while self._unsettled:
            self._adopt_settled(wait=True)
        return self.robot_map()

    def robot_map(self) -> RobotMap:
        """Return the finished submaps and the growing one."""
        growing = [] if self._growing.is_empty else [self._submap(self._growing.line_map())]
        submaps = (*with_walls(self._finished, self._unsettled.walls), *growing)
        made_with, marks = self._made_with, self._marks
        return RobotMap(self.robot, self.boot, self._version, submaps, made_with, marks)

    def snapshot(self) -> MapSnapshot:
        """Return what `robot_map` would draw now, to be drawn by another thread: takes a moment."""
        empty = self._growing.is_empty
        return MapSnapshot(
            self.robot,
            self.boot,
            self._version,
            self._made_with,
            tuple(self._finished),
            self._unsettled.walls,
            None if empty else self._submap(LineMap.empty()),
            b"" if empty else MapSnapshot.packed(self._growing),
            self._marks,
            self._draw,
        )

    @property
    def _has_finished(self) -> bool:
        """Whether a submap of this run is finished."""
        return len(self._finished) > self._known

    def _numbered(self, scan: Scan) -> Scan:
        """Return `scan` with its index, which may be the next; errors as of `add`."""
        if self._is_finished:
            raise FinishedError(self.robot)
        if self._shift is None:
            self._shift = self._next_index if scan.index < self._next_index else 0
        index = self._next_index if scan.index == UNNUMBERED else scan.index + self._shift
        if index < self._next_index:
            raise ArgumentError(
                "scan", f"expected an index of {self._next_index} or more, got {index}"
            )
        self._next_index = index + 1
        return scan if scan.index == index else replace(scan, index=index)

    def _take_next(self, scan: Scan) -> tuple[bool, bool]:
        """Take a raw scan after those that wait, some with each one that comes.

        Return whether it is placed, and whether the robot was lost. What takes long is done alone.
        """
        self._again.append(scan)
        many = len(self._waiting) + len(self._again) > LATE
        late = many or self._prompt
        if self._try_missed() and not late:
            return False, False
        placed = lost = False
        left = AGAIN if many else AT_ONCE
        while left > 0 and (self._waiting or self._again):
            index, found, was_lost = self._go_on()
            placed, lost = found and index == scan.index, lost or was_lost
            left -= 1 if found else 2  # which is looked for among those missed as well
            if self._tracker.searched and not late:
                break
        return placed, lost

    def _try_missed(self) -> bool:
        """Try some of the scans that were missed before the robot was found again, if any were."""
        left = AT_ONCE
        while self._tracker.is_behind and left > 0:
            self._tracker.try_missed()
            left -= 1
        return left < AT_ONCE

    def _go_on(self) -> tuple[int, bool, bool]:
        """Follow the robot to the next scan.

        Return its index, whether it is placed, and whether the robot was lost.
        """
        seen = self._waiting.popleft() if self._waiting else self._observe(self._again.popleft())
        placed = self._place(seen)
        if placed:
            self._deskewer.placed(seen.scan, self._tracker.pose)
        self._loss.note(seen, self._tracker, placed=placed)
        if not self._loss.is_certain(len(self._tracker.missed), self._patience(seen)):
            return seen.scan.index, placed, False
        self._start_again()
        return seen.scan.index, False, True

    def _observe(self, scan: Scan) -> Observation:
        """Return what a raw scan shows, as far as it is known what of it is the robot."""
        if not self._has_finished:
            self._early.append(scan)
        straight = self._deskewer.straight(self._sweeps.swept(self._body.without(scan)))
        self.seen = observe(straight, self.parameters.observation)
        return self.seen

    def _patience(self, seen: Observation) -> int:
        """How many scans may be missed: more until it is known whether the robot sees itself.

        Not where it sees nothing: what it sees of itself is not what it was lost by.
        """
        undecided = not self._has_finished and self._body.is_suspected
        undecided &= not self._tracker.is_blind(seen)
        return self.parameters.patience * (SUSPENSE if undecided else 1)

    def _judge_again(self) -> None:
        """Map all there is once more, as it is now known what of it is the robot's own body.

        Or how long its sweeps take. What is in a finished submap stays as it is. Some scans at a
        time, with those that come: all at once they would hold up the next.
        """
        self._say_body()
        self._say_sweep()
        if self._has_finished:
            return
        self._again.extendleft(reversed(self._early))
        self._early.clear()
        self._waiting.clear()
        self._tracker = Tracker(self.parameters.tracker, self._sweeps)
        self._loss = Loss(self.parameters.patience)
        self._deskewer = Deskewer()
        self._growing = SubmapBuilder(self.parameters.backend.submap)
        self._origin = self._frame = se2.IDENTITY
        self._merged = {}
        self._version += 1

    def _notice_noise(self, scan: Scan) -> bool:
        """Tell whether readings scatter far more than is assumed, and have all made for that."""
        sigma = self._noise.watch(scan)
        if sigma is None or self._has_finished:
            return False
        assumed = self._config.sensor.range_sigma
        sensor = self._config.sensor.model_copy(update={"range_sigma": sigma})
        self._config = self._config.model_copy(update={"sensor": sensor})
        self.parameters = MapperParameters.of(self._config)
        self._made_with = MadeWith.of(self._config)
        self._body = OwnBody(self.parameters.own_body)
        self._sweeps = SweepJudge(self.parameters.sweeps)
        self._say_once(
            f"readings of {self.robot} scatter by {sigma:.3f} m along walls, and {assumed:g} m are"
            " assumed of a lidar: mapped as such a one (range_sigma of [sensor] says it at once)"
        )
        return True

    def _say_body(self) -> None:
        """Tell once that the robot sees itself."""
        if self._body.reach.any():
            wide, far = self._body.extent
            self._say_once(
                f"{self.robot} sees itself: {wide:.0f}° of its field of view, up to {far:.2f} m"
                " away, keep their place while all else moves; what is there is left out"
            )

    def _say_sweep(self) -> None:
        """Tell once that its lidar was found to spin once a scan."""
        if self._sweeps.sweep:
            self._say_once(
                f"the lidar of {self.robot} takes {abs(self._sweeps.sweep):.3f} s from its first"
                " beam to the last, though its scans do not say so: where the robot turns they fit"
                " better so, and are set right"
            )

    def _say_once(self, words: str) -> None:
        if self._on_warning is not None and words[:20] not in self._said:
            self._said.add(words[:20])
            self._on_warning(words)

    def _place(self, seen: Observation) -> bool:
        """Follow the robot to a scan; merge it, and those missed before it."""
        found = self._tracker.place(seen, self._lines_around)
        self._merge_all(found)
        return any(each is seen for each, _ in found)

    def _whereabouts(self) -> tuple[FloatArray, FloatArray]:
        """Return (3,) where the last scan was placed and (4,) how surely, component frame."""
        turned = turn_uncertainty(self._held, self._origin[2])
        at_stamp = se2.compose(self._tracker.pose, self._deskewer.to_stamp)
        return se2.compose(self._origin, at_stamp), turned

    def _merge_all(self, found: Found) -> None:
        for seen, tracked in found:
            self._merge(seen, tracked)

    def _lines_around(self) -> LineMap:
        """G_(t-1): the lines around the robot, tracker's frame."""
        growing = [] if self._growing.is_empty else [self._growing.lines().moved(self._frame)]
        to_tracker = se2.inverse(self._origin)
        last = [
            s.map.moved(se2.compose(to_tracker, s.pose))
            for s in self._finished[-1:]
            if s.component == self._component
        ]
        return LineMap.union(last + growing)

    def _start_again(self) -> None:
        """Begin a new component with the scans that were missed; they fit each other or wait on."""
        self._tracker.take_back()
        self._waiting.extendleft(reversed(self._tracker.missed))
        if not self._growing.is_empty:
            self._finish_submap()
        if any(s.component == self._component for s in self._finished):
            self._component = self._newest_component = self._spare()
        self._follows = False
        self._tracker = self._tracker.afresh()
        self._loss = Loss(self.parameters.patience)
        self._deskewer = self._deskewer.afresh()
        self._origin = self._frame = se2.IDENTITY

    def _merge(self, seen: Observation, tracked: ScanMatch) -> None:
        """Merge a scan where it was found, tracker's frame, into the growing submap."""
        if len(self._unsettled) > 1:
            self._adopt_settled()
        if self._growing.is_full and self._unsettled.has_room:
            self._finish_submap()
        if self._growing.is_empty:
            self._frame = tracked.pose
        local = se2.between(self._frame, tracked.pose)
        held = pose_uncertainty(tracked.information, self.parameters.uncertainty, tracked.drift)
        if seen.scan.index == self._next_index - 1:  # not one that is found again with it
            self._held = held
        held = turn_uncertainty(held, -self._frame[2])
        self._growing.add(seen.scan, seen.segments, local, held)
        self._merged[seen.scan.index] = seen
        self._version += 1

    def _finish_submap(self) -> None:
        """Adopt what became of the submap before, have the growing one settled, start another."""
        self._adopt_settled()
        submap = self._submap(self._growing.outline())
        scans = tuple(self._merged[k] for k in submap.trajectory.scan_index.tolist())
        self._finished.append(submap)
        self._unsettled.append(
            FinishedSubmap(
                submap,
                scans,
                self._growing,
                self._follows,
                self._spare(),
                self.parameters.backend,
            )
        )
        self._follows = True
        self._tracker.drift.mark()
        self._growing = SubmapBuilder(self.parameters.backend.submap)
        self._merged = {}
        self._version += 1

    def _adopt_settled(self, *, wait: bool = False) -> None:
        """Move all to where the first unsettled submap settled, if that is known; live, or `wait`.

        The growing one moves with the last scan of the submap that it was tracked from.
        """
        adopted = self._unsettled.adopt(self._finished, wait=wait)
        if adopted is None:
            return
        self._finished = adopted.submaps
        self._newest_component = max(self._newest_component, adopted.newest_component)
        self._version += 1
        if self._follows and adopted.moved is not None:
            self._component = self._finished[-1].component
            self._origin = se2.compose(adopted.moved, self._origin)
            if adopted.is_held:
                self._tracker.drift.end()

    def _spare(self) -> int:
        """Return the next component's number. One that joined another is not given again.

        Each submap that is not settled is lent one: it may be found to need it.
        """
        return self._newest_component + 1 + len(self._unsettled)

    def _submap(self, lines: LineMap) -> Submap:
        """Return the growing submap with its `lines`."""
        return Submap(
            len(self._finished),
            self._component,
            se2.compose(self._origin, self._frame),
            lines,
            self._growing.trajectory(),
        )
