"""Delivers a finished map, its marks and what was found about it; returns when it is taken."""

import time
from collections.abc import Callable
from contextlib import ExitStack
from types import TracebackType
from typing import Self

import zenoh

from mapweave.errors import MapweaveError
from mapweave.maps import RobotMap
from mapweave_protocol.link.assembler import MapSender
from mapweave_protocol.link.inbox import Inbox, joint_status_reader
from mapweave_protocol.link.session import (
    declare_alignment_publisher,
    declare_map_publisher,
    declare_marks_publisher,
)
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.keys import ALIGNMENT, JOINT_STATUS, LIVE, MAP, MARK, STATUS
from mapweave_protocol.wire.messages import (
    AlignmentMessage,
    JointStatusMessage,
    MapVersion,
    MarksMessage,
    StatusMessage,
)

PATIENCE = 30.0  # [s] for the coordinator to take it
AGAIN = 2.0  # [s] after which something is sent again
POLL = 0.2  # [s]


class Delivery:
    """Plays the part of a robot that has finished; a context manager.

    As long as its block lasts the robot is here, unless an agent of its own is; afterwards it is
    gone, so that others take over what is left to be compared.

    Parameters
    ----------
    session
        Stays the caller's.
    own
        The map.
    """

    def __init__(self, session: zenoh.Session, team: str, own: RobotMap) -> None:
        self._session = session
        self._team = team
        self._own = own
        self._said = Inbox()
        self._statuses = joint_status_reader()
        self._declared = ExitStack()

    def __enter__(self) -> Self:
        parts = {"team": self._team, "robot": self._own.robot}
        with ExitStack() as stack:
            keep = stack.enter_context
            keep(
                self._session.declare_subscriber(
                    JOINT_STATUS.build(team=self._team), self._said.put
                )
            )
            self._maps = keep(declare_map_publisher(self._session, MAP.build(**parts)))
            self._marks = keep(declare_marks_publisher(self._session, MARK.build(**parts)))
            alive = list(self._session.liveliness().get(LIVE.pattern(**parts)))
            if not alive:
                token = LIVE.build(**parts, boot=self._own.boot)
                keep(self._session.liveliness().declare_token(token))
                self._session.put(STATUS.build(**parts), encode(self._status()))
            self._declared = stack.pop_all()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._declared.close()

    def map(self) -> None:
        """Deliver the map, and its marks.

        Raises
        ------
        MapweaveError
            If no coordinator has taken them for some time.
        """
        payload = MapSender().payload(self._own, complete=True)
        state = MapVersion.of(self._own)
        self._until("the map", lambda: self._maps.put(payload), lambda s: _holds(s.maps, state))
        if self._own.marks:
            marks = MarksMessage.pack(
                self._own.robot, self._own.boot, self._own.version, self._own.marks
            )
            self._until(
                "its marks",
                lambda: self._marks.put(encode(marks)),
                lambda s: _holds(s.marks, state),
            )

    def alignments(self, message: AlignmentMessage) -> None:
        """Deliver what was found about the map and another one; errors as of `map`."""
        ends = message.reference, message.other
        pair = {"reference": message.reference.robot, "other": message.other.robot}
        key = ALIGNMENT.build(team=self._team, robot=self._own.robot, **pair)
        with declare_alignment_publisher(self._session, key) as publisher:
            self._until(
                "what was found",
                lambda: publisher.put(encode(message)),
                lambda s: any(_same_runs(held, ends) for held in s.alignments),
            )

    def _until(
        self, what: str, send: Callable[[], None], taken: Callable[[JointStatusMessage], bool]
    ) -> None:
        """Send again and again, until a coordinator says that it has it."""
        began, sent = time.monotonic(), -AGAIN
        while (now := time.monotonic()) - began < PATIENCE:
            if now - sent >= AGAIN:
                send()
                sent = now
            arrival = self._said.get(POLL)
            status = None if arrival is None else self._statuses.read(arrival)
            if status is not None and taken(status):
                return
        raise MapweaveError(
            f"no coordinator of team {self._team} has taken {what} within {PATIENCE:g} s;"
            " its log may say why"
        )

    def _status(self) -> StatusMessage:
        scans = sum(len(submap.trajectory.scan_index) for submap in self._own.submaps)
        return StatusMessage(
            robot=self._own.robot,
            boot=self._own.boot,
            stamp=time.time(),
            state="finished",
            scans_seen=scans,
            scans_placed=scans,
            components=len(self._own.components),
            submaps=len(self._own.submaps),
            map_version=self._own.version,
        )


def _holds(held: tuple[MapVersion, ...], wanted: MapVersion) -> bool:
    return any(
        (state.robot, state.boot) == (wanted.robot, wanted.boot) and state.version >= wanted.version
        for state in held
    )


def _same_runs(held: tuple[MapVersion, MapVersion], wanted: tuple[MapVersion, MapVersion]) -> bool:
    return {(s.robot, s.boot) for s in held} == {(s.robot, s.boot) for s in wanted}
