"""What a robot publishes, counted; and what it answers when it is asked for all of it."""

import logging
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager

import zenoh
import zenoh.ext as ze

from mapweave.maps import RobotMap
from mapweave.team.news import is_news
from mapweave_agent.past_runs import PastRun
from mapweave_protocol.link.assembler import MapSender
from mapweave_protocol.link.session import (
    declare_alignment_publisher,
    declare_map_publisher,
    declare_marks_publisher,
    declare_pose_publisher,
    declare_status_publisher,
)
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.keys import AGENT_QUERY, ALIGNMENT, LIVE, MAP, MARK, POSE, STATUS
from mapweave_protocol.wire.messages import (
    AlignmentMessage,
    MarksMessage,
    PoseMessage,
    StatusMessage,
    Traffic,
)
from mapweave_protocol.wire.model import Message
from mapweave_protocol.wire.pairs import Run, states_of
from mapweave_protocol.wire.status_message import Kind

WAITING_QUERIES = 16

_log = logging.getLogger(__name__)


class Outbox:
    """The publishers and the liveliness token of a run of a robot.

    What is sent before it is `open` goes nowhere, as in an outage.

    Parameters
    ----------
    sender
        Codes the maps.
    """

    def __init__(self, team: str, robot: str, boot: str, sender: MapSender) -> None:
        self._session: zenoh.Session | None = None
        self._team = team
        self._robot = robot
        self._boot = boot
        self._sender = sender
        self._maps: ze.AdvancedPublisher | None = None
        self._poses: zenoh.Publisher | None = None
        self._statuses: zenoh.Publisher | None = None
        self._alignments: dict[tuple[str, str], ze.AdvancedPublisher] = {}
        self._found: dict[frozenset[Run], AlignmentMessage] = {}
        self._marks: ze.AdvancedPublisher | None = None
        self._marked: dict[str, MarksMessage] = {}
        self._messages = Counter[Kind]()
        self._bytes = Counter[Kind]()
        self._declared = ExitStack()

    @contextmanager
    def open(self, session: zenoh.Session) -> Iterator[None]:
        """Declare all on `session`, which stays the caller's, as long as the block runs."""
        self._session = session
        with self._declared as stack:
            keep = stack.enter_context
            query_key = AGENT_QUERY.build(team=self._team, robot=self._robot)
            map_key = MAP.build(team=self._team, robot=self._robot)
            status_key = STATUS.build(team=self._team, robot=self._robot)
            live_key = LIVE.build(team=self._team, robot=self._robot, boot=self._boot)
            self._maps = keep(declare_map_publisher(session, map_key))
            pose_key = POSE.build(team=self._team, robot=self._robot)
            self._poses = keep(declare_pose_publisher(session, pose_key))
            self._statuses = keep(declare_status_publisher(session, status_key))
            questions: zenoh.handlers.RingChannel[zenoh.Query]
            questions = zenoh.handlers.RingChannel(WAITING_QUERIES)
            self._asked = keep(session.declare_queryable(query_key, questions))
            # Last, so that who sees the robot can already hear it.
            keep(session.liveliness().declare_token(live_key))
            yield

    @property
    def sent(self) -> Mapping[Kind, Traffic]:
        """What was published so far, by kind."""
        return {
            kind: Traffic(messages=count, bytes=self._bytes[kind])
            for kind, count in self._messages.items()
            if count
        }

    @property
    def found(self) -> Iterable[AlignmentMessage]:
        """What was published last of each pair of runs."""
        return self._found.values()

    def send_map(self, robot_map: RobotMap, *, complete: bool) -> tuple[RobotMap, int]:
        """Publish a version of the map, or all of it if `complete`.

        Returns
        -------
        RobotMap, int
            The map as it arrives, and the size of the message [bytes].
        """
        payload = self._sender.payload(robot_map, complete=complete)
        self._put("map", self._maps, payload)
        return self._sender.as_sent(robot_map), len(payload)

    def send_past(self, run: PastRun) -> None:
        """Publish the map of an earlier run."""
        self._put("map", self._maps, run.payload)

    def send_marks(self, message: MarksMessage) -> None:
        """Publish the marks of a run of the robot, all of them."""
        if self._marks is None and self._session is not None:  # most robots mark nothing
            key = MARK.build(team=self._team, robot=self._robot)
            self._marks = declare_marks_publisher(self._session, key)
            self._declared.enter_context(self._marks)
        self._marked[message.boot] = message
        self._put("mark", self._marks, encode(message))

    def prepare_alignments(self, reference: str, other: str) -> ze.AdvancedPublisher | None:
        """Return the publisher of what is found out about a pair of robots.

        Whoever listens asks a publisher that is new for what it has published: it is best declared
        while there is nothing, or the first message goes to each of them twice.
        """
        publisher = self._alignments.get((reference, other))
        if publisher is None and self._session is not None:
            key = self._key_of(reference, other)
            publisher = declare_alignment_publisher(self._session, key)
            self._alignments[reference, other] = self._declared.enter_context(publisher)
        return publisher

    def send_alignments(self, message: AlignmentMessage) -> None:
        """Publish what was found out about a pair of robots."""
        publisher = self.prepare_alignments(message.reference.robot, message.other.robot)
        self._found[frozenset(states_of((message.reference, message.other)))] = message
        self._put("alignment", publisher, encode(message))

    def send_news(self, message: AlignmentMessage, *, final: bool) -> None:
        """Publish what was found about a pair of robots where it differs from what was told.

        Parameters
        ----------
        final
            Whether it is the last: then any difference counts.
        """
        told = self._found.get(frozenset(states_of((message.reference, message.other))))
        if told is not None:
            same = told.alignments == message.alignments
            if same or not (final or is_news(message.unpack(), told.unpack())):
                return
        self.send_alignments(message)

    def send_status(self, message: StatusMessage) -> None:
        """Publish how far the robot is."""
        self._put("status", self._statuses, encode(message))

    def send_pose(self, message: PoseMessage) -> None:
        """Publish where the robot is."""
        self._put("pose", self._poses, encode(message))

    def answer(self, robot_map: RobotMap, others: Mapping[str, Callable[[], Message]]) -> None:
        """Give who has asked the whole of `robot_map`, as published last, and what was found.

        Or, who has asked for that, one of the `others`, by the parameters of the question.
        """
        while (query := self._asked.handler.try_recv()) is not None:
            with query:
                self._answer(query, robot_map, others)

    def _answer(
        self, query: zenoh.Query, robot_map: RobotMap, others: Mapping[str, Callable[[], Message]]
    ) -> None:
        parts = {"team": self._team, "robot": self._robot}
        other = others.get(str(query.parameters))
        try:
            if other is not None:
                query.reply(AGENT_QUERY.build(**parts), encode(other()))
                return
            query.reply(MAP.build(**parts), self._sender.whole(robot_map))
            for message in self._found.values():
                key = self._key_of(message.reference.robot, message.other.robot)
                query.reply(key, encode(message))
            for marks in self._marked.values():
                query.reply(MARK.build(**parts), encode(marks))
        except zenoh.ZError as error:
            _log.warning("an answer could not be sent: %s", error)

    def _key_of(self, reference: str, other: str) -> str:
        return ALIGNMENT.build(team=self._team, robot=self._robot, reference=reference, other=other)

    def _put(
        self, kind: Kind, publisher: ze.AdvancedPublisher | zenoh.Publisher | None, payload: bytes
    ) -> None:
        if publisher is None:
            return
        publisher.put(payload)
        self._messages[kind] += 1
        self._bytes[kind] += len(payload)
