"""Robots' maps and alignments as a subscriber has them: those there were, then what comes.

What is published arrives by itself. What does not is seen in the statuses, which say what there is,
and asked for: whether it was missed in an outage, or its robot is gone.
"""

import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import chain
from typing import Generic, TypeAlias, TypeVar

import zenoh

from mapweave.maps import RobotMap
from mapweave_protocol.link.asking import ask_for_what_is_valid as _ask
from mapweave_protocol.link.asking import request_all_of
from mapweave_protocol.link.assembler import MapAssembler
from mapweave_protocol.link.inbox import (
    Arrival,
    Inbox,
    Reader,
    alignment_reader,
    joint_status_reader,
    map_reader,
    status_reader,
)
from mapweave_protocol.link.lacking import Lacking
from mapweave_protocol.wire.keys import JOINT_STATUS, STATUS
from mapweave_protocol.wire.messages import (
    AlignmentMessage,
    JointStatusMessage,
    MapMessage,
    MapVersion,
    StatusMessage,
)
from mapweave_protocol.wire.model import Message
from mapweave_protocol.wire.pairs import Run, is_older, run_of, states_of
from mapweave_protocol.wire.queries import JointQuery

M = TypeVar("M", bound=Message)
K = TypeVar("K")
Read: TypeAlias = Callable[[Reader[M], Callable[[float], Arrival | None]], Iterator[M | None]]
States: TypeAlias = dict[Run, int]


@dataclass
class _Held(Generic[K]):
    """What is held, as states of maps, and what is not wanted.

    Attributes
    ----------
    states
        By a run or a pair of runs.
    passed_over
        What a coordinator had before the version that a subscriber begins after; None before it
        has said so.
    """

    states: dict[K, States]
    passed_over: dict[K, States] | None
    lacking: Lacking = field(default_factory=Lacking)

    def lacks(self, key: K, there_is: States) -> bool:
        """Tell whether it is time to ask for what there is of `key`."""
        held = self.states.get(key, (self.passed_over or {}).get(key, {}))
        behind = [held.get(run, -1) - version for run, version in there_is.items()]
        # A later state of one map may be held beside an earlier one of the other.
        lacks = min(behind) < 0 and max(behind) <= 0
        return self.lacking.due(str(key), held, time.monotonic(), lacks=lacks)


def replicated_maps(
    session: zenoh.Session, inbox: Inbox, team: str, since: int | None, read: Read[MapMessage]
) -> Iterator[RobotMap]:
    """Yield the map of each run, and each newer one.

    Parameters
    ----------
    inbox
        Takes in what the robots publish.
    since
        Leave out what a coordinator had before this version of the joint map; None does not.
    read
        Yields the valid messages of an inbox, and None now and then.
    """
    assembler = MapAssembler()
    held: _Held[Run] = _Held({}, {} if since is None else None)
    asked = deque(_ask(session, team, JointQuery(of="maps", since=since), MapMessage))
    with _statuses(session, team) as said:
        for message in _merged(asked, read(map_reader(), inbox.get)):
            robot_map = None if message is None else assembler.update(message)
            if robot_map is not None:
                held.states[run_of(robot_map)] = states_of([MapVersion.of(robot_map)])
                yield robot_map
            for state in _maps_there_are(said, held):
                if held.lacks(run_of(state), states_of([state])):
                    query = JointQuery(robot=state.robot, boot=state.boot)
                    answers = _ask(session, team, query, MapMessage)
                    asked += answers
                    if not any(answer.version >= state.version for answer in answers):
                        request_all_of(session, team, state.robot, inbox.put)


def replicated_alignments(
    session: zenoh.Session,
    inbox: Inbox,
    team: str,
    since: int | None,
    read: Read[AlignmentMessage],
) -> Iterator[AlignmentMessage]:
    """Yield what was found last of each pair of runs, and what is found; as `replicated_maps`."""
    held: _Held[frozenset[Run]] = _Held({}, {} if since is None else None)
    last: dict[frozenset[Run], AlignmentMessage] = {}
    asked = deque(_ask(session, team, JointQuery(of="alignments", since=since), AlignmentMessage))
    with _statuses(session, team) as said:
        for message in _merged(asked, read(alignment_reader(), inbox.get)):
            if message is not None and _is_news(message, last):
                held.states[_pair_of(message)] = states_of((message.reference, message.other))
                yield message
            pairs = _pairs_there_are(said, held)
            # All are asked about, so that each one's time runs.
            lacks = [held.lacks(frozenset(states), states) for states in pairs]
            if any(lacks):
                asked += _ask(session, team, JointQuery(of="alignments"), AlignmentMessage)


@contextmanager
def _statuses(session: zenoh.Session, team: str) -> Iterator[Inbox]:
    """Give an inbox for what robots and coordinators say to have."""
    said = Inbox()
    with (
        session.declare_subscriber(STATUS.pattern(team=team), said.put),
        session.declare_subscriber(JOINT_STATUS.build(team=team), said.put),
    ):
        yield said


def _merged(asked: deque[M], published: Iterator[M | None]) -> Iterator[M | None]:
    """Yield what was asked for as soon as it is there, and what comes by itself."""
    for message in chain([None], published):
        yield message
        while asked:
            yield asked.popleft()


def _maps_there_are(said: Inbox, held: _Held[Run]) -> Iterator[MapVersion]:
    """Yield the states of maps that robots and coordinators have said to have."""
    for status in _read_statuses(said):
        if isinstance(status, StatusMessage):
            if status.submaps:
                yield MapVersion(robot=status.robot, boot=status.boot, version=status.map_version)
            continue
        if held.passed_over is None:
            held.passed_over = {run_of(state): states_of([state]) for state in status.maps}
        yield from status.maps


def _pairs_there_are(said: Inbox, held: _Held[frozenset[Run]]) -> Iterator[States]:
    """Yield of which states of maps coordinators have said to have alignments."""
    for status in _read_statuses(said):
        if isinstance(status, JointStatusMessage):
            pairs = [states_of(ends) for ends in status.alignments]
            if held.passed_over is None:
                held.passed_over = {frozenset(states): states for states in pairs}
            yield from pairs


def _read_statuses(said: Inbox) -> Iterator[StatusMessage | JointStatusMessage]:
    robots, coordinators = status_reader(), joint_status_reader()
    while (arrival := said.get(0.0)) is not None:
        status: StatusMessage | JointStatusMessage | None
        status = (robots if robots.reads(arrival) else coordinators).read(arrival)
        if status is not None:
            yield status


def _is_news(message: AlignmentMessage, last: dict[frozenset[Run], AlignmentMessage]) -> bool:
    """Tell whether a message says what was not said of its pair, and note it."""
    known = last.get(_pair_of(message))
    if known is not None:
        before = known.reference, known.other
        if is_older((message.reference, message.other), before) or message == known:
            return False
    last[_pair_of(message)] = message
    return True


def _pair_of(message: AlignmentMessage) -> frozenset[Run]:
    return frozenset(states_of((message.reference, message.other)))
