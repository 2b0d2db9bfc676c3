"""A robot: its scans become its map, its map and its peers' maps become alignments."""

import logging
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from itertools import chain

import zenoh

from mapweave.errors import MapweaveError
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.scan_mapper import ScanMapper
from mapweave.maps import RobotMap
from mapweave.scan.scan import Scan
from mapweave_agent.by_hand.kept_orders import KeptOrders
from mapweave_agent.by_hand.own_marks import Frame
from mapweave_agent.comparing.findings import Findings
from mapweave_agent.comparison_schedule import ComparisonSchedule
from mapweave_agent.comparison_worker import ComparisonWorker
from mapweave_agent.dispatch import Dispatcher
from mapweave_agent.listening import listening
from mapweave_agent.live.attending import attending
from mapweave_agent.live.joining import Connected, LinkNews
from mapweave_agent.live.scans import LiveScans
from mapweave_agent.live.whereabouts import Whereabouts
from mapweave_agent.needs import Needs
from mapweave_agent.outbox import Outbox
from mapweave_agent.own_map import OwnMap
from mapweave_agent.past_runs import PastRun, StateFolder
from mapweave_agent.publication_schedule import (
    AgentParameters,
    PublicationSchedule,
    RegularSchedule,
)
from mapweave_agent.source import ReplayClock
from mapweave_protocol.link.asking import (
    ALL_ORDERS,
    ITS_STATUS,
    request_map,
    request_orders_of_coordinator,
)
from mapweave_protocol.link.inbox import Inbox
from mapweave_protocol.link.status_schedule import StatusSchedule
from mapweave_protocol.wire.messages import PoseMessage, StatusMessage

POLL = 0.1  # [s] after which a signal, an outcome or what is due is noticed
LIVE_POLL = 0.05  # [s] after which it is noticed that no scans come, or nothing arrives
MAX_ARRIVALS = 64  # taken in at once, so that a flood does not hold up mapping

_log = logging.getLogger(__name__)
Stopping = Callable[[], bool]
Tell = Callable[[RobotMap | PoseMessage], None]


class AgentRun:
    """One run of a robot.

    Parameters
    ----------
    connected
        Returns an open session, which stays the caller's, once there is one: until then the robot
        maps by itself.
    team
        The team's id.
    mapper
        Maps the scans of this run, or follows them in a known map.
    comparer
        Compares maps; it stays the caller's.
    total
        How many scans there will be, where known.
    state
        Where this run's map is kept.
    past
        The robot's earlier runs that belong to the team's map, the earliest first.
    first
        The number of this run's first component, above those of all runs before it.
    tell
        Told each map and pose that is published, in whatever thread; it must return at once.
    """

    def __init__(
        self,
        connected: Connected,
        team: str,
        mapper: ScanMapper,
        comparer: ComparisonWorker,
        total: int | None,
        parameters: AgentParameters,
        state: StateFolder,
        past: Sequence[PastRun] = (),
        first: int = 0,
        tell: Tell = lambda _: None,
    ) -> None:
        self._connected = connected
        self._session: zenoh.Session | None = None
        self._joined = ExitStack()
        self._team = team
        self._mapper = mapper
        self._total = total
        self._parameters = p = parameters
        self._state = state
        self._past = {run.state: run for run in past}
        self._tell = tell
        self._publication = PublicationSchedule(parameters)
        self._statuses = StatusSchedule(p.status_interval, p.least_status_interval)
        self._keeping = RegularSchedule(parameters.state_interval)
        self._comparisons = ComparisonSchedule(mapper.robot, parameters)
        for run in past:
            self._comparisons.earlier_map(run.map)
        self._needs = Needs(mapper.robot)
        self._whereabouts = Whereabouts(mapper.robot, mapper.boot, first)
        self._map = OwnMap(mapper, first)
        if self._map.known is not None:
            self._comparisons.follow_in(self._map.known)
        self._orders = KeptOrders(state)
        self._reception = Dispatcher(
            mapper.robot,
            mapper.boot,
            self._comparisons,
            self._needs,
            self._whereabouts,
            self._orders,
        )
        self._outbox = Outbox(team, mapper.robot, mapper.boot, state.sender)
        self._findings = Findings(
            self._map,
            comparer,
            self._comparisons,
            self._outbox,
            self._needs,
            self._whereabouts,
            state,
        )
        self._inbox = Inbox()
        self._link = LinkNews(_log.warning, _log.info)
        self._live: LiveScans | None = None
        self._scans_seen = 0
        self._changed = self._unkept = self._finished = self._hurried = False

    @property
    def finished(self) -> bool:
        """Whether all scans are mapped, and the last map is published."""
        return self._finished

    @property
    def robot_map(self) -> RobotMap:
        """The map as it was published last, with the marks that the robot made."""
        return self._map.whole

    def mark(self, label: str, place: FloatArray, frame: Frame) -> str:
        """Mark a (2,) `place` [m] from any thread; as of `OwnMarks.add`."""
        return self._map.mark(label, place, frame)

    def take_back_mark(self, identity: str) -> None:
        """Take a mark back; as of `OwnMarks.remove`."""
        self._map.marks.remove(identity)

    def run(self, scans: Iterator[Scan], clock: ReplayClock, stopping: Stopping) -> None:
        """Map all `scans` of a recording, then compare with the peers until `stopping`.

        Raises
        ------
        FileError
            If the scans cannot be read any further.
        """
        with self._in_the_team():
            self._map_all(scans, clock, stopping)
            self._compare_until(stopping)

    def run_live(self, scans: LiveScans, stopping: Stopping) -> None:
        """Map `scans` as they come, until there are no more; then compare until `stopping`.

        Raises
        ------
        MapweaveError
            If where the scans come from fails.
        """
        self._live = scans
        with self._in_the_team():
            with attending(lambda: self._attend(LIVE_POLL)) as failed:
                while not (stopping() or scans.ended or failed()):
                    scan = scans.take(LIVE_POLL)
                    if scan is not None:
                        self._take(scan)
            self._compare_until(stopping)

    @contextmanager
    def _in_the_team(self) -> Iterator[None]:
        with self._joined:
            self._join_when_possible()
            if self._session is None:
                _log.info("maps by itself until a router answers")
            try:
                yield
            except MapweaveError:  # as of its source: what came before that is told
                self._leave()
                raise
            if self._reception.refused:
                _log.warning("%d messages were not valid and ignored", self._reception.refused)

    def _join_when_possible(self) -> None:
        """Come to the team once there is a session, with what was mapped before."""
        session = self._connected() if self._session is None else None
        if session is None:
            return
        keep, robot, put = self._joined.enter_context, self._mapper.robot, self._inbox.put
        keep(self._outbox.open(session))
        keep(listening(session, self._team, robot, put))
        self._session = session
        _log.info("joins team %s", self._team)
        if self._map.state is not None:
            self._outbox.send_map(self._map.told, complete=True)
        if self._map.marks.state is not None:
            self._outbox.send_marks(self._map.marks.message())

    def _compare_until(self, stopping: Stopping) -> None:
        if not stopping():
            self._finish(stopping)
        while not stopping():
            self._attend(POLL)
        self._leave(stopping)

    def _leave(self, stopping: Stopping = lambda: True) -> None:
        """Publish what is not yet, and wait a moment for the coordinators that are here."""
        if self._changed and not self._finished:
            self._publish_map()
        deadline = time.monotonic() + self._parameters.leave_within
        while not self._needs.delivered(self._map.state) and time.monotonic() < deadline:
            self._attend(POLL)
            stopping()  # it may have more to say: to hurry
            if self._hurried:
                break

    def hurry(self) -> None:
        """Leave without waiting for the coordinators."""
        self._hurried = True

    def _map_all(self, scans: Iterator[Scan], clock: ReplayClock, stopping: Stopping) -> None:
        started = time.monotonic()
        for scan in scans:
            due = started + clock.due(scan)
            self._attend(0.0)
            while not stopping() and (left := due - time.monotonic()) > 0:
                self._attend(min(left, POLL))
            if stopping():
                return
            self._take(scan)

    def _take(self, scan: Scan) -> None:
        placement = self._map.add(scan)
        pose = self._whereabouts.message(scan, placement, time.time())
        if pose is not None:
            self._outbox.send_pose(pose)
            self._tell(pose)
        self._scans_seen += 1
        self._changed |= placement.placed
        if placement.pose is not None:
            self._publication.moved(placement.component, placement.pose)
        self._unkept |= placement.placed
        if placement.submap_finished or placement.lost:
            self._publication.hurry()
        if placement.lost:
            _log.warning("scan %d fits nowhere: a new component begins", scan.index)

    def _finish(self, stopping: Stopping) -> None:
        """Publish the last map, and say that it is the last."""
        self._finished = True
        self._mapper.finish()
        self._publish_map()
        self._publish_status()
        _log.info(
            "finished: %d of %d scans placed, submaps: %d%s",
            self._map.scans_placed,
            self._scans_seen,
            len(self._map.told.submaps),
            "" if stopping() else "; compares with its team until Ctrl-C",
        )

    def _attend(self, wait: float) -> None:
        """Wait for what arrives, then do everything that is due."""
        timeout = wait
        for _ in range(MAX_ARRIVALS):
            arrival = self._inbox.get(timeout)
            if arrival is None:
                break
            self._reception.take(arrival)
            timeout = 0.0
        self._join_when_possible()
        now = time.monotonic()
        self._link.look(self._session, now)
        if self._reception.met():
            self._statuses.met(now)
            self._needs.met(now)
        if self._map.marks.is_news:
            self._publish_marks()
        if self._changed and not self._finished and self._publication.due(now):
            self._publish_map()
        if self._unkept and not self._finished and self._keeping.due(now):
            self._unkept = False  # what changes while it is drawn is still to be kept
            self._keep(self._map.drawn())
        self._findings.compare(now, self._map.told)
        self._supply(now)
        if self._statuses.due(now, self._state_told, lacks=bool(self._reception.lacking)):
            self._publish_status()

    @property
    def _state_told(self) -> object:
        """What others are told at once when it changes."""
        # Who still drives says so soon anyway.
        now = self._finished and (dict(self._comparisons.published), self._comparisons.held)
        return now, len(self._map.told.components), self._reception.lacking

    def _supply(self, now: float) -> None:
        """Send again what others lack, answer who has asked, and ask for what is lacking here."""
        if self._session is None:
            return
        # Gone through where somebody has spoken since the last time: seldom.
        past = chain.from_iterable(run.found for run in self._past.values())
        found = chain(past, self._comparisons.orphans, self._outbox.found)
        marked = {run.marks_state: run.marks for run in self._past.values()}
        marks = [s for s in (self._map.marks.state, *marked) if s is not None]
        missing = self._needs.missing(self._map.state, found, now, self._past, marks)
        if missing.map:
            self._outbox.send_map(self._map.told, complete=True)
        for run in missing.past:
            self._outbox.send_past(self._past[run])
        for message in missing.alignments:
            self._outbox.send_alignments(message)
            self._needs.published(now, message)
        for run in missing.marks:
            self._outbox.send_marks(marked.get(run) or self._map.marks.message())
        if self._orders.lacks(now):
            request_orders_of_coordinator(self._session, self._team, self._inbox.put)
        answers = {ALL_ORDERS: lambda: self._orders.message, ITS_STATUS: self._status}
        self._outbox.answer(self._map.told, answers)
        for state in self._comparisons.to_ask_for(now):
            request_map(self._session, self._team, state, self._inbox.add)

    def _publish_map(self) -> None:
        self._changed = self._unkept = False
        self._map.publish()
        arrives, size = self._outbox.send_map(self._map.told, complete=False)
        self._tell(self._map.whole)
        self._keep(self._map.told)
        compared = arrives if self._map.known is None else self._map.known
        self._comparisons.own_map(compared, finished=self._finished)
        self._findings.tell_place(self._map.told)
        now = time.monotonic()
        self._publication.published(now, size)
        self._needs.published(now)

    def _keep(self, robot_map: RobotMap) -> None:
        self._state.keep(robot_map)
        self._keeping.done(time.monotonic())

    def _publish_marks(self) -> None:
        message = self._map.marks.message()
        self._outbox.send_marks(message)
        self._state.keep_marks(message)
        self._publication.hurry()  # a mark is nowhere until the scan that holds it is told

    def _publish_status(self) -> None:
        self._outbox.send_status(self._status())
        self._statuses.sent(time.monotonic(), self._state_told)

    def _status(self) -> StatusMessage:
        return StatusMessage(
            robot=self._mapper.robot,
            boot=self._mapper.boot,
            stamp=time.time(),
            state="finished" if self._finished else "mapping",
            scans_seen=self._scans_seen,
            scans_placed=self._map.scans_placed,
            scans_total=self._total,
            scans_skipped=0 if self._live is None else self._live.skipped,
            scan_age=None if self._live is None else self._live.oldest(),
            components=len(self._map.told.components),
            submaps=len(self._map.told.submaps),
            map_version=self._map.told.version,
            compared=dict(self._comparisons.published),
            holds=self._comparisons.held,
            sent=dict(self._outbox.sent),
            refused=self._reception.refusals.told,
            dropped=self._inbox.dropped,
            orders=self._orders.digest,
        )
