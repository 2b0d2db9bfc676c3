"""The team's maps in two lines: generators that yield what arrives, as typed values.

Each opens a session of its own, and closes it when the generator is closed or ends. As long as no
router lets it in, it waits, and logs why.
"""

import logging
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import takewhile
from typing import TypeVar

import zenoh

from mapweave.errors import ArgumentError
from mapweave.geometry.arguments import as_positive
from mapweave.maps import JointMap, RobotMap
from mapweave.text import shown
from mapweave_protocol.errors import MessageError
from mapweave_protocol.link.asking import ask_for_what_is_valid, ask_latest, request_statuses
from mapweave_protocol.link.assembler import MESSAGES_TO_COMPLETE
from mapweave_protocol.link.inbox import (
    Arrival,
    Inbox,
    Reader,
    joint_reader,
    joint_status_reader,
    pose_reader,
    status_reader,
)
from mapweave_protocol.link.replication import replicated_alignments, replicated_maps
from mapweave_protocol.link.security.settings import LinkSettings
from mapweave_protocol.link.sequence import SHORT_HISTORY, JointSequence
from mapweave_protocol.link.session import declare_subscriber, open_session
from mapweave_protocol.wire.keys import (
    ALIGNMENT,
    JOINT_MAP,
    JOINT_STATUS,
    MAP,
    POSE,
    STATUS,
)
from mapweave_protocol.wire.messages import (
    AlignmentMessage,
    JointMapMessage,
    JointStatusMessage,
    PoseMessage,
    StatusMessage,
)
from mapweave_protocol.wire.model import MAX_COUNT, Message
from mapweave_protocol.wire.queries import JointQuery

POLL = 0.5  # [s] after which a gap is asked about again
MAX_POSES = 256  # of one each robot

M = TypeVar("M", bound=Message)
_log = logging.getLogger(__name__)


def joint_maps(
    team: str,
    *,
    connect: Sequence[str] | None = None,
    timeout: float | None = None,
    since: int | None = None,
    stopping: Callable[[], bool] = lambda: False,
    link: LinkSettings | None = None,
) -> Iterator[JointMap]:
    """Yield the team's joint maps in the order of their versions, without a gap.

    The first is the latest there is; who began to listen before there was any gets 1, 2, 3… Who
    began before there was a coordinator gets the latest of its history, or all of a short one.
    Outages and restarts leave no gap. A coordinator with another store counts from 1 again; where
    there are two, one is followed as long as it answers.

    Parameters
    ----------
    team
        The team's id.
    connect
        Endpoints of the router, or one; by default ``MAPWEAVE_CONNECT`` or this machine.
    timeout
        End after this time without a new one [s], above 0; None never ends.
    since
        Begin with the version after this one, 0 or more, instead of the latest.
    stopping
        Asked now and then: where it says so, end.
    link
        Keys and settings; those that the environment names unless given.

    Raises
    ------
    InvalidIdError
        If `team` is not an id.
    EndpointError
        If an endpoint is not one.
    ArgumentError
        If `timeout` is not above 0, or `since` is below 0.
    UnreachableError
        If no router answers within `timeout`.
    """
    _check_since(since)
    said = Inbox()
    with (
        _listening(JOINT_MAP.pattern(team=team), connect, timeout, 1, link) as (session, inbox),
        session.declare_subscriber(JOINT_STATUS.build(team=team), said.put),
    ):
        sequence = _begin(session, team, since)

        def ask(query: JointQuery) -> list[JointMapMessage]:
            return ask_for_what_is_valid(session, team, query, JointMapMessage)

        told = joint_status_reader()

        def expect() -> None:
            _expect(sequence, said, told)

        messages = takewhile(lambda _: not stopping(), _read(joint_reader(), inbox.get, timeout))
        yield from _in_order(sequence, messages, expect, ask)


def robot_maps(
    team: str,
    *,
    connect: Sequence[str] | None = None,
    timeout: float | None = None,
    since: int | None = None,
    link: LinkSettings | None = None,
) -> Iterator[RobotMap]:
    """Yield the robots' maps: the latest of each run at once, then each as it grows.

    Also those of robots that are gone, as far as there is a coordinator; what was missed in an
    outage comes after it. Parameters and errors as for `joint_maps`, but: `since` is a version of
    the joint map, and leaves out what the coordinator had before that was begun.
    """
    _check_since(since)
    with _listening(MAP.pattern(team=team), connect, timeout, MESSAGES_TO_COMPLETE, link) as opened:
        yield from replicated_maps(*opened, team, since, partial(_read, timeout=timeout))


def alignments(
    team: str,
    *,
    connect: Sequence[str] | None = None,
    timeout: float | None = None,
    since: int | None = None,
    stopping: Callable[[], bool] = lambda: False,
    link: LinkSettings | None = None,
) -> Iterator[AlignmentMessage]:
    """Yield what the robots find out about pairs of maps; as for `robot_maps`.

    Where `stopping` says so, asked now and then, it ends.
    """
    _check_since(since)

    def read(reader: Reader[M], get: Callable[[float], Arrival | None]) -> Iterator[M | None]:
        return takewhile(lambda _: not stopping(), _read(reader, get, timeout))

    with _listening(ALIGNMENT.pattern(team=team), connect, timeout, 1, link) as opened:
        yield from replicated_alignments(*opened, team, since, read)


def statuses(
    team: str,
    *,
    connect: Sequence[str] | None = None,
    timeout: float | None = None,
    link: LinkSettings | None = None,
) -> Iterator[StatusMessage]:
    """Yield the robots' statuses: how each is now, then what each says; as for `joint_maps`."""
    with _listening(STATUS.pattern(team=team), connect, timeout, 1, link) as (session, inbox):
        request_statuses(session, team, inbox.add)
        yield from filter(None, _read(status_reader(), inbox.get, timeout))


def poses(
    team: str,
    *,
    connect: Sequence[str] | None = None,
    timeout: float | None = None,
    stopping: Callable[[], bool] = lambda: False,
    link: LinkSettings | None = None,
) -> Iterator[PoseMessage]:
    """Yield where the robots are, at the rate of their scans; as for `joint_maps`.

    Who takes them more slowly gets the newest of each robot.
    """
    inbox, key = Inbox(MAX_POSES), POSE.pattern(team=team)
    with (
        open_session(connect, patience=timeout, on_wait=_tell_waiting, link=link) as session,
        session.declare_subscriber(key, inbox.put),
    ):
        read = _read(pose_reader(), inbox.newest, timeout)
        yield from filter(None, takewhile(lambda _: not stopping(), read))


@contextmanager
def _listening(
    key: str,
    connect: Sequence[str] | None,
    timeout: float | None,
    history: int,
    link: LinkSettings | None,
) -> Iterator[tuple[zenoh.Session, Inbox]]:
    """Open a session and an inbox for what is published at `key`."""
    if timeout is not None:
        as_positive("timeout", timeout, "s")
    inbox = Inbox()
    with (
        open_session(connect, patience=timeout, on_wait=_tell_waiting, link=link) as session,
        declare_subscriber(session, key, inbox.put, history=history),
    ):
        yield session, inbox


def _tell_waiting(reason: str) -> None:
    # A warning: a program that has set up no log shows it as well.
    _log.warning("waiting for a router: %s", shown(reason, 300))


def _read(
    reader: Reader[M], get: Callable[[float], Arrival | None], timeout: float | None
) -> Iterator[M | None]:
    """Yield each valid message, and None now and then while there is none, until `timeout` [s]."""
    heard = time.monotonic()
    while timeout is None or time.monotonic() - heard < timeout:
        arrival = get(POLL if timeout is None else min(POLL, timeout))
        message = reader.read(arrival) if arrival else None
        if message is not None:
            heard = time.monotonic()
        yield message


def _check_since(since: int | None) -> None:
    if since is not None and not (isinstance(since, int) and 0 <= since <= MAX_COUNT):
        raise ArgumentError("since", f"expected a version of the joint map or 0, got {since!r}")


def _begin(session: zenoh.Session, team: str, since: int | None) -> JointSequence:
    """Return a sequence that holds the latest joint map there is, unless all `since` one do."""
    if since is not None:
        return JointSequence(whole_up_to=MAX_COUNT, since=since)
    try:
        latest, answered = ask_latest(session, team)
    except MessageError as error:
        _log.warning("answer ignored, %s", error)
        latest, answered = None, False
    if latest is None:
        # A coordinator that has none yet will count from 1; if there is none, its store may be old.
        return JointSequence(whole_up_to=MAX_COUNT if answered else SHORT_HISTORY)
    sequence = JointSequence(whole_up_to=0)
    sequence.offer(latest, time.monotonic())
    return sequence


def _expect(sequence: JointSequence, said: Inbox, reader: Reader[JointStatusMessage]) -> None:
    """Have `sequence` expect the versions that the coordinator has said to have."""
    while (arrival := said.get(0.0)) is not None:
        status = reader.read(arrival)
        if status is not None:
            sequence.expect(status.series, status.version, time.monotonic())


def _in_order(
    sequence: JointSequence,
    messages: Iterator[JointMapMessage | None],
    expect: Callable[[], None],
    ask: Callable[[JointQuery], list[JointMapMessage]],
) -> Iterator[JointMap]:
    """Yield the joint maps of `messages` in order; ask for what is missing."""
    yield from iter(sequence.take, None)
    for new in messages:
        if new is not None:
            sequence.offer(new, time.monotonic())
        yield from iter(sequence.take, None)
        expect()
        yield from _close_gap(sequence, ask)


def _close_gap(
    sequence: JointSequence, ask: Callable[[JointQuery], list[JointMapMessage]]
) -> Iterator[JointMap]:
    """Yield what is missing as long as it comes."""
    while (gap := sequence.gap) is not None:
        sequence.answered(gap, ask(gap), time.monotonic())
        filled = sequence.take()
        if filled is None and sequence.gap is None:
            return
        if filled is None:
            skipped = sequence.give_up()
            if skipped:
                _log.warning("%d versions of the joint map are lost", skipped)
            yield from iter(sequence.take, None)
            return
        yield filled
        yield from iter(sequence.take, None)
