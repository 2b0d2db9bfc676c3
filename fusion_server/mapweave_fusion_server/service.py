"""The coordinator on Zenoh: receives, builds, stores, publishes, answers."""

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

import zenoh

from mapweave.config import Config
from mapweave.errors import MapweaveError
from mapweave_fusion_server.answers import answer
from mapweave_fusion_server.builder import Built, VersionBuilder
from mapweave_fusion_server.coordinator import Coordinator, CoordinatorParameters
from mapweave_fusion_server.intake import Intake, last_version
from mapweave_fusion_server.journal import record
from mapweave_fusion_server.memory import GIVEN_BACK, give_back
from mapweave_fusion_server.storage.database import UnwritableError
from mapweave_fusion_server.store import Store
from mapweave_fusion_server.web.feed import CoordinatorReport, Feed
from mapweave_protocol.link import session
from mapweave_protocol.link.asking import ITS_STATUS, request_all_of, request_orders_of
from mapweave_protocol.link.assembler import MESSAGES_TO_COMPLETE
from mapweave_protocol.link.inbox import Inbox
from mapweave_protocol.link.joint_changes import JointSender
from mapweave_protocol.link.security.proof import checking, signing
from mapweave_protocol.link.security.settings import LinkSettings
from mapweave_protocol.link.status_schedule import COORDINATOR_INTERVAL, StatusSchedule
from mapweave_protocol.narration.story import Story
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.codec import decode, encode
from mapweave_protocol.wire.joint_status_message import frames_of
from mapweave_protocol.wire.messages import JointMapMessage, JointStatusMessage

POLL = 0.1  # [s] after which a signal, or a version that is ready, is noticed
ANSWERERS = 4  # one slow asker must not keep the others waiting
WAITING_QUERIES = 256
LEAST_STATUS_INTERVAL = 1.0  # [s], whatever has changed
REPORT_INTERVAL = 1.0  # [s] between two reports on the live page
RUNS_MARKED = 16  # of a robot whose marks come from its publisher's cache

_log = logging.getLogger(__name__)


class Service:
    """The coordinator of a team.

    Parameters
    ----------
    zenoh_session
        An open session; it stays the caller's.
    team
        The team's name.
    store
        What is remembered; numbering goes on from there.
    parameters
        Of the coordinator.
    config
        Of how maps become one; the default one where none is given.
    feed
        Is handed every version, and every second how robots and coordinator are.
    link
        With keys, orders of others are taken only if signed, and those of the page are signed.

    Raises
    ------
    FileError
        If the store holds something unreadable, or keys cannot be used.
    MissingExtraError
        If there are keys, and what checks signatures is not installed.
    """

    def __init__(
        self,
        zenoh_session: zenoh.Session,
        team: str,
        store: Store,
        parameters: CoordinatorParameters,
        config: Config | None = None,
        feed: Feed | None = None,
        link: LinkSettings | None = None,
    ) -> None:
        self._session = zenoh_session
        self._team = team
        self._store = store
        self._story = Story()
        latest = last_version(store)
        if latest is not None:
            deque(self._story.joined(latest), maxlen=0)  # it was told before this start
        self._frames = frames_of(latest)
        self._coordinator = Coordinator(parameters, latest, store.latest_version)
        link = link or LinkSettings()
        self._intake = Intake(self._coordinator, store, self._story, checking(link))
        self._intake.restore()
        self._sign = signing(link)
        self._inbox = Inbox()
        self._joints = JointSender()
        self._boot = keys.new_boot()
        self._speaking = StatusSchedule(COORDINATOR_INTERVAL, LEAST_STATUS_INTERVAL)
        self._report_due = self._look_due = self._give_back_due = 0.0
        self._latest: JointStatusMessage | None = None
        self._builder = VersionBuilder(store.series, config or Config(), self._inbox.wake)
        self._covers = 0
        self._started = time.time()
        self._feed = feed or Feed()
        self._feed.show_version(store.latest_version, self._coordinator.maps)

    def run(self, stopping: Callable[[], bool]) -> None:
        """Serve until `stopping`; then publish what is pending.

        Raises
        ------
        FileError
            If the store cannot be written.
        """
        joint_key = keys.JOINT_MAP.build(team=self._team)
        with self._builder, self._answering(), self._listening(), self._announced():
            self._publisher = session.declare_joint_publisher(self._session, joint_key)
            self._publish_again()
            _log.info("coordinating team %s", self._team)
            while not stopping():
                self._step()
            self._finish()

    def _step(self) -> None:
        """Take one message, then do what is due."""
        due = self._coordinator.seconds_until_due(time.monotonic())
        arrival = self._inbox.get(min(POLL, due))
        if arrival is not None:
            self._intake.take(arrival, time.time())
        if self._builder.is_ready:
            self._conclude()
        now = time.monotonic()
        if self._coordinator.seconds_until_due(now) <= 0:
            self._begin()
        self._take_orders_of_page()
        maps_of, orders_of = self._intake.robots_to_ask(now)
        for robot in maps_of:
            request_all_of(self._session, self._team, robot, self._inbox.put)
        for robot in orders_of:
            request_orders_of(self._session, self._team, robot, self._inbox.put)
        if self._intake.met():
            self._speaking.met(now)
        if now >= self._look_due:
            self._look_due = now + POLL
            self._intake.look(now, linked=bool(self._session.info.routers_zid()))
            self._say_how_it_is(now)

    def _take_orders_of_page(self) -> None:
        """Take what was ordered on the live page, and say it to those who keep orders as well."""
        for order in map(self._sign, self._feed.orders()):
            self._intake.take_order(order, time.time())
            key = keys.ORDER.build(team=self._team, name=order.by, order=str(order.kind))
            self._session.put(key, encode(order))

    def _finish(self) -> None:
        """Take what has arrived and publish what it makes."""
        while (arrival := self._inbox.get(0.0)) is not None:
            self._intake.take(arrival, time.time())
        if self._builder.is_busy:
            self._conclude()
        if self._coordinator.has_news:
            self._begin(patient=True)
            self._conclude()
        if self._intake.refused:
            _log.warning("%d messages were not valid and dropped", self._intake.refused)

    def _begin(self, *, patient: bool = False) -> None:
        self._covers = self._store.news
        draft = self._coordinator.begin(time.monotonic())
        self._builder.start(
            draft,
            time.time(),
            patient=patient,
            is_awaited=self._coordinator.is_awaited,
            is_overtaken=self._coordinator.is_overtaken,
        )

    def _conclude(self) -> None:
        built = self._builder.take()
        if built is not None:
            # Stored first: what was published once must be there after a crash.
            kept = self._keep(built)
            self._publisher.put(self._joints.payload(kept.message, kept.payload))
            self._frames = frames_of(built.joint)
            self._look_due = 0.0
            self._speaking.hurry()  # robots wait for their new frames
            self._feed.show_version(built.draft.version, built.draft.maps, kept.message)
            record(self._story.joined(built.joint))
        self._coordinator.finish(
            built.joint if built else None,
            has_more=built is not None and built.has_more,
            has_failed=self._builder.has_failed,
        )

    def _keep(self, built: Built) -> Built:
        """Store a version; return it, as one of another series where there is no room."""
        number = built.draft.version
        # While submaps wait, something is news to who starts again after a crash.
        covers = self._covers - built.has_more
        try:
            self._store.add_version(number, built.begun, built.payload, covers)
        except UnwritableError as error:
            self._store.hold()
            self._builder.series = self._store.series
            built = self._builder.in_series(built)
            self._store.add_version(number, built.begun, built.payload, covers)
            _log.error("%s; going on without it until there is room", error)
        return built

    def _resume_storing(self) -> None:
        if not self._store.is_storing and self._store.resume():
            _log.info("the store can be written again: all that waited is in it")

    def _publish_again(self) -> None:
        """Publish the latest version of the store: the cache died with the last publisher."""
        latest = self._store.version(self._store.latest_version)
        if latest is not None:
            message = decode(JointMapMessage, latest)
            self._publisher.put(self._joints.payload(message, latest))
            _log.info("version %d published again", self._store.latest_version)

    def _say_how_it_is(self, now: float) -> None:
        """Tell the team where that is due, and the live page every second."""
        if now < self._report_due and not self._speaking.may_be_due(now):
            return
        self._latest = status = self._status()
        # That a version is being made is said by the version.
        told = status.model_copy(update={"stamp": 0.0, "pending": False})
        if self._speaking.due(now, told):
            self._statuses.put(encode(status))
            self._speaking.sent(now, told)
        if now >= self._report_due:
            self._report_due = now + REPORT_INTERVAL
            self._resume_storing()
            self._report(status)
        if now >= self._give_back_due:
            self._give_back_due = now + GIVEN_BACK
            give_back()

    def _status(self) -> JointStatusMessage:
        return JointStatusMessage(
            boot=self._boot,
            stamp=time.time(),
            series=self._store.series,
            version=self._store.latest_version,
            pending=self._coordinator.is_pending,
            maps=self._coordinator.maps_held,
            alignments=self._coordinator.alignments_held,
            frames=self._frames,
            marks=self._coordinator.marks_held,
            orders=self._coordinator.orders.digest,
            refused=self._intake.refusals.told,
            dropped=self._inbox.dropped,
            stored=self._store.is_storing,
        )

    def _report(self, status: JointStatusMessage) -> None:
        self._feed.show_team(
            self._intake.reports,
            CoordinatorReport(
                boot=self._boot,
                started=self._started,
                stamp=status.stamp,
                pending=status.pending,
                refused=self._intake.refused,
                refusals=self._intake.refusals.counts,
                dropped=self._inbox.dropped,
                storing=self._store.is_storing,
                damaged=self._store.damaged,
            ),
        )

    @contextmanager
    def _announced(self) -> Iterator[None]:
        """Say that a coordinator is here, and how far it is."""
        token = keys.COORDINATOR_LIVE.build(team=self._team, boot=self._boot)
        status_key = keys.JOINT_STATUS.build(team=self._team)
        with (
            session.declare_status_publisher(self._session, status_key) as self._statuses,
            self._session.liveliness().declare_token(token),
        ):
            yield

    @contextmanager
    def _listening(self) -> Iterator[None]:
        """Subscribe to maps, alignments and who is there."""
        maps = keys.MAP.pattern(team=self._team)
        alignments = keys.ALIGNMENT.pattern(team=self._team)
        statuses = keys.STATUS.pattern(team=self._team)
        live = keys.LIVE.pattern(team=self._team)
        others = keys.COORDINATOR_LIVE.pattern(team=self._team)
        put = self._inbox.put
        with ExitStack() as stack:
            for subscriber in (
                session.declare_subscriber(self._session, maps, put, history=MESSAGES_TO_COMPLETE),
                session.declare_subscriber(self._session, alignments, put),
                session.declare_subscriber(
                    self._session, keys.MARK.pattern(team=self._team), put, history=RUNS_MARKED
                ),
                self._session.declare_subscriber(keys.ORDER.pattern(team=self._team), put),
                self._session.declare_subscriber(statuses, put),
                self._session.liveliness().declare_subscriber(others, put, history=True),
                self._session.liveliness().declare_subscriber(live, put, history=True),
            ):
                stack.enter_context(subscriber)
            yield

    @contextmanager
    def _answering(self) -> Iterator[None]:
        """Answer queries in threads of their own."""
        key = keys.JOINT_QUERY.build(team=self._team)
        channel: zenoh.handlers.FifoChannel[zenoh.Query]
        channel = zenoh.handlers.FifoChannel(WAITING_QUERIES)
        queryable = self._session.declare_queryable(key, channel)
        threads = [
            threading.Thread(target=self._answer_all, args=(key, queryable.handler), daemon=True)
            for _ in range(ANSWERERS)
        ]
        for thread in threads:
            thread.start()
        try:
            yield
        finally:
            queryable.undeclare()  # type: ignore[no-untyped-call]  # it ends the threads' loops
            for thread in threads:
                thread.join()

    def _answer_all(self, key: str, queries: zenoh.handlers.Handler[zenoh.Query]) -> None:
        for query in queries:
            with query:
                self._answer(key, query)

    def _answer(self, key: str, query: zenoh.Query) -> None:
        try:
            if str(query.parameters) == ITS_STATUS:
                if self._latest is not None:
                    query.reply(key, encode(self._latest))
                return
            for payload in answer(self._store, str(query.parameters)):
                query.reply(key, payload)
        except MapweaveError as error:
            query.reply_err(str(error))
        except zenoh.ZError as error:
            _log.warning("an answer could not be sent: %s", error)
