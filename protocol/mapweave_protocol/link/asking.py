"""Questions to the coordinator, answered from its store."""

import logging
from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

import zenoh

from mapweave.maps import parse_component
from mapweave_protocol.errors import MessageError
from mapweave_protocol.link.inbox import Arrival
from mapweave_protocol.wire.codec import decode
from mapweave_protocol.wire.keys import AGENT_QUERY, JOINT_QUERY, JOINT_STATUS, MAP, STATUS
from mapweave_protocol.wire.messages import (
    JointMapMessage,
    MapMessage,
    MapVersion,
    OrderMessage,
    OrdersMessage,
    RunsMessage,
)
from mapweave_protocol.wire.model import Message
from mapweave_protocol.wire.orders.runs_message import WireRun
from mapweave_protocol.wire.queries import JointQuery

ANSWER_WITHIN = 5.0  # [s]
TIMED_OUT = b"Timeout"  # what Zenoh itself says for one who was asked and has said nothing
ALL_ORDERS = JointQuery(orders="all").parameters
ITS_STATUS = JointQuery(of="status").parameters

M = TypeVar("M", bound=Message)
T = TypeVar("T")
_log = logging.getLogger(__name__)


def ask_joint_maps(
    session: zenoh.Session, team: str, query: JointQuery, timeout: float = ANSWER_WITHIN
) -> list[JointMapMessage]:
    """Return the joint maps that `query` asks for, versions ascending; none if nobody answers.

    Raises
    ------
    MessageError
        If an answer is not valid.
    """
    answers = _ask(session, team, query, JointMapMessage, timeout)
    return sorted(answers, key=lambda message: message.version)


def ask_latest(
    session: zenoh.Session, team: str, timeout: float = ANSWER_WITHIN
) -> tuple[JointMapMessage | None, bool]:
    """Return the latest joint map, None if there is none, and whether a coordinator answered.

    Raises
    ------
    MessageError
        If an answer is not valid.
    """
    selector, each = JOINT_QUERY.build(team=team), zenoh.ConsolidationMode.NONE
    replies = list(session.get(selector, consolidation=each, timeout=timeout))
    maps = [decode(JointMapMessage, reply.ok.payload.to_bytes()) for reply in replies if reply.ok]
    said = any(r.err is None or r.err.payload.to_bytes() != TIMED_OUT for r in replies)
    return max(maps, key=lambda message: message.version, default=None), said


def ask_robot_map(
    session: zenoh.Session, team: str, robot: str, timeout: float = ANSWER_WITHIN
) -> MapMessage | None:
    """Return the last map of `robot` that the coordinator knows, complete; None if none.

    Raises
    ------
    MessageError
        If the answer is not valid, or is another robot's map.
    """
    answers = _ask(session, team, JointQuery(robot=robot), MapMessage, timeout)
    if any(message.robot != robot for message in answers):
        raise MessageError(MapMessage.format, f"answer about another robot than {robot!r}")
    return max(answers, key=lambda message: message.version, default=None)


def ask_map_of_component(
    session: zenoh.Session, team: str, component: str, timeout: float = ANSWER_WITHIN
) -> MapMessage | None:
    """Return the map of the run that `component`, such as ``r1/0``, is of; None if none is known.

    Raises
    ------
    MessageError
        If the answer is not valid, or is another robot's map.
    """
    answers = _ask(session, team, JointQuery(component=component), MapMessage, timeout)
    robot = parse_component(component)[0].partition("@")[0]
    if any(message.robot != robot for message in answers):
        raise MessageError(MapMessage.format, f"answer about another robot than of {component!r}")
    return max(answers, key=lambda message: message.version, default=None)


def ask_runs(
    session: zenoh.Session, team: str, timeout: float = ANSWER_WITHIN
) -> list[WireRun] | None:
    """Return the runs that the coordinator holds, of all robots; None if nobody answers.

    Raises
    ------
    MessageError
        If the answer is not valid.
    """
    answers = _ask(session, team, JointQuery(runs="all"), RunsMessage, timeout)
    return _together(message.runs for message in answers)


def ask_orders(
    session: zenoh.Session, team: str, timeout: float = ANSWER_WITHIN
) -> list[OrderMessage] | None:
    """Return all orders that the coordinator holds; None if nobody answers.

    Raises
    ------
    MessageError
        If the answer is not valid.
    """
    answers = _ask(session, team, JointQuery(orders="all"), OrdersMessage, timeout)
    return _together(message.orders for message in answers)


def _together(answers: Iterable[Iterable[T]]) -> list[T] | None:
    """Return what all `answers` have; None if there are none."""
    parts = list(answers)
    return [one for part in parts for one in part] if parts else None


def request_statuses(
    session: zenoh.Session, team: str, take: Callable[[Arrival], None], *, coordinator: bool = False
) -> None:
    """Ask how all robots are, or the `coordinator`; each comes as if it had just said so.

    Parameters
    ----------
    take
        Called in a thread of Zenoh's.
    """
    asked = JOINT_QUERY if coordinator else AGENT_QUERY

    def take_reply(reply: zenoh.Reply) -> None:
        if not reply.ok:
            return
        parts = asked.parse(str(reply.ok.key_expr))
        key = JOINT_STATUS.build(**parts) if coordinator else STATUS.build(**parts)
        take(Arrival(key, reply.ok.payload.to_bytes()))

    _request(session, f"{asked.pattern(team=team)}?{ITS_STATUS}", take_reply)


def request_orders_of(
    session: zenoh.Session, team: str, robot: str, on_sample: Callable[[zenoh.Sample], None]
) -> None:
    """Ask `robot` for the orders that it holds.

    Parameters
    ----------
    on_sample
        Called in a thread of Zenoh's.
    """
    selector = f"{AGENT_QUERY.build(team=team, robot=robot)}?{ALL_ORDERS}"
    _request(session, selector, _good(on_sample))


def request_orders_of_coordinator(
    session: zenoh.Session, team: str, on_sample: Callable[[zenoh.Sample], None]
) -> None:
    """Ask the coordinator for the orders that it holds; else as `request_orders_of`."""
    _request(session, f"{JOINT_QUERY.build(team=team)}?{ALL_ORDERS}", _good(on_sample))


def request_all_of(
    session: zenoh.Session, team: str, robot: str, on_sample: Callable[[zenoh.Sample], None]
) -> None:
    """Ask `robot` for its whole map and what it found; each comes as if it were published again.

    Parameters
    ----------
    on_sample
        Called in a thread of Zenoh's.
    """
    # Zenoh says so by a parameter of its own, `_anyke`: not where we have some.
    under_any = zenoh.ReplyKeyExpr.ANY
    _request(session, AGENT_QUERY.build(team=team, robot=robot), _good(on_sample), under_any)


def _good(on_sample: Callable[[zenoh.Sample], None]) -> Callable[[zenoh.Reply], None]:
    """Return what hands over replies that are no errors."""

    def take_reply(reply: zenoh.Reply) -> None:
        if reply.ok:
            on_sample(reply.ok)

    return take_reply


def _request(
    session: zenoh.Session,
    selector: str,
    take_reply: Callable[[zenoh.Reply], None],
    accepted: zenoh.ReplyKeyExpr = zenoh.ReplyKeyExpr.MATCHING_QUERY,
) -> None:
    session.get(
        selector,
        take_reply,
        consolidation=zenoh.ConsolidationMode.NONE,
        accept_replies=accepted,
        timeout=ANSWER_WITHIN,
    )


def request_map(
    session: zenoh.Session, team: str, state: MapVersion, take: Callable[[Arrival], None]
) -> None:
    """Ask the coordinator for the map of a run; it comes as if its robot had published it.

    Parameters
    ----------
    take
        Called in a thread of Zenoh's.
    """
    key = MAP.build(team=team, robot=state.robot)
    query = JointQuery(robot=state.robot, boot=state.boot)

    def take_reply(reply: zenoh.Reply) -> None:
        if reply.ok:
            take(Arrival(key, reply.ok.payload.to_bytes()))

    _request(session, f"{JOINT_QUERY.build(team=team)}?{query.parameters}", take_reply)


def ask_for_what_is_valid(
    session: zenoh.Session, team: str, query: JointQuery, kind: type[M]
) -> list[M]:
    """Return the valid answers to `query`; of the others the first is told."""
    answers: list[M] = []
    warned = False
    for payload in _payloads(session, team, query, ANSWER_WITHIN):
        try:
            answers.append(decode(kind, payload))
        except MessageError as error:
            if not warned:
                _log.warning("answer ignored, %s", error)
            warned = True
    return answers


def _ask(
    session: zenoh.Session, team: str, query: JointQuery, kind: type[M], timeout: float
) -> list[M]:
    return [decode(kind, payload) for payload in _payloads(session, team, query, timeout)]


def _payloads(
    session: zenoh.Session, team: str, query: JointQuery, timeout: float
) -> Iterator[bytes]:
    parameters = query.parameters
    selector = JOINT_QUERY.build(team=team) + (f"?{parameters}" if parameters else "")
    # The default keeps one reply a key; the answers to `since` all have the same.
    replies = session.get(selector, consolidation=zenoh.ConsolidationMode.NONE, timeout=timeout)
    return (reply.ok.payload.to_bytes() for reply in replies if reply.ok)
