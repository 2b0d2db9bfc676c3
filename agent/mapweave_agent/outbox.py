"""What a robot publishes, counted; and what it answers when it is asked for all of it."""

import logging
from collections import Counter
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from types import TracebackType

import zenoh
import zenoh.ext as ze

from mapweave.maps import RobotMap
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
    OrdersMessage,
    PoseMessage,
    StatusMessage,
    Traffic,
)
from mapweave_protocol.wire.pairs import Run, states_of
from mapweave_protocol.wire.queries import JointQuery

WAITING_QUERIES = 16
KINDS = "map", "alignment", "pose", "mark", "status"
ORDERS = JointQuery(orders="all").parameters

_log = logging.getLogger(__name__)


class Outbox:
    """The publishers and the liveliness token of a run of a robot; a context manager.

    Parameters
    ----------
    session
        Stays the caller's.
    """

    def __init__(self, session: zenoh.Session, team: str, robot: str, boot: str) -> None:
        self._session = session
        self._team = team
        self._robot = robot
        self._boot = boot
        self._sender = MapSender()
        self._alignments: dict[tuple[str, str], ze.AdvancedPublisher] = {}
        self._found: dict[frozenset[Run], AlignmentMessage] = {}
        self._marked: dict[str, MarksMessage] = {}
        self._messages = Counter(dict.fromkeys(KINDS, 0))
        self._bytes = Counter(dict.fromkeys(KINDS, 0))
        self._declared = ExitStack()

    def __enter__(self) -> "Outbox":
        with ExitStack() as stack:
            keep = stack.enter_context
            query_key = AGENT_QUERY.build(team=self._team, robot=self._robot)
            map_key = MAP.build(team=self._team, robot=self._robot)
            status_key = STATUS.build(team=self._team, robot=self._robot)
            live_key = LIVE.build(team=self._team, robot=self._robot, boot=self._boot)
            self._maps = keep(declare_map_publisher(self._session, map_key))
            marks_key = MARK.build(team=self._team, robot=self._robot)
            self._marks = keep(declare_marks_publisher(self._session, marks_key))
            pose_key = POSE.build(team=self._team, robot=self._robot)
            self._poses = keep(declare_pose_publisher(self._session, pose_key))
            self._statuses = keep(declare_status_publisher(self._session, status_key))
            questions: zenoh.handlers.RingChannel[zenoh.Query]
            questions = zenoh.handlers.RingChannel(WAITING_QUERIES)
            self._asked = keep(self._session.declare_queryable(query_key, questions))
            # Last, so that who sees the robot can already hear it.
            keep(self._session.liveliness().declare_token(live_key))
            self._declared = stack.pop_all()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._declared.close()

    @property
    def sent(self) -> Mapping[str, Traffic]:
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

    def send_map(self, robot_map: RobotMap, *, complete: bool) -> RobotMap:
        """Publish a version of the map, or all of it if `complete`; return it as it arrives."""
        self._put("map", self._maps, self._sender.payload(robot_map, complete=complete))
        return self._sender.as_sent(robot_map)

    def send_past(self, run: PastRun) -> None:
        """Publish the map of an earlier run."""
        self._put("map", self._maps, run.payload)

    def send_marks(self, message: MarksMessage) -> None:
        """Publish the marks of a run of the robot, all of them."""
        self._marked[message.boot] = message
        self._put("mark", self._marks, encode(message))

    def send_alignments(self, message: AlignmentMessage) -> None:
        """Publish what was found out about a pair of robots."""
        pair = message.reference.robot, message.other.robot
        publisher = self._alignments.get(pair)
        if publisher is None:
            publisher = declare_alignment_publisher(self._session, self._key_of(message))
            self._alignments[pair] = self._declared.enter_context(publisher)
        self._found[frozenset(states_of((message.reference, message.other)))] = message
        self._put("alignment", publisher, encode(message))

    def send_status(self, message: StatusMessage) -> None:
        """Publish how far the robot is."""
        self._put("status", self._statuses, encode(message))

    def send_pose(self, message: PoseMessage) -> None:
        """Publish where the robot is."""
        self._put("pose", self._poses, encode(message))

    def answer(self, robot_map: RobotMap, orders: OrdersMessage) -> None:
        """Give who has asked the whole of `robot_map`, as published last, and what was found.

        Or, who has asked for that, the `orders` of operators.
        """
        while (query := self._asked.handler.try_recv()) is not None:
            with query:
                self._answer(query, robot_map, orders)

    def _answer(self, query: zenoh.Query, robot_map: RobotMap, orders: OrdersMessage) -> None:
        parts = {"team": self._team, "robot": self._robot}
        try:
            if str(query.parameters) == ORDERS:
                query.reply(AGENT_QUERY.build(**parts), encode(orders))
                return
            query.reply(MAP.build(**parts), self._sender.payload(robot_map, complete=True))
            for message in self._found.values():
                query.reply(self._key_of(message), encode(message))
            for marks in self._marked.values():
                query.reply(MARK.build(**parts), encode(marks))
        except zenoh.ZError as error:
            _log.warning("an answer could not be sent: %s", error)

    def _key_of(self, message: AlignmentMessage) -> str:
        reference, other = message.reference.robot, message.other.robot
        return ALIGNMENT.build(team=self._team, robot=self._robot, reference=reference, other=other)

    def _put(
        self, kind: str, publisher: ze.AdvancedPublisher | zenoh.Publisher, payload: bytes
    ) -> None:
        publisher.put(payload)
        self._messages[kind] += 1
        self._bytes[kind] += len(payload)
