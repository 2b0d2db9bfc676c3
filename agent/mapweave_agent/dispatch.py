"""What a robot hears of its team, handed on to its plan of comparisons."""

import logging

from mapweave_agent.comparison_schedule import ComparisonSchedule
from mapweave_protocol.link.assembler import MapAssembler
from mapweave_protocol.link.inbox import (
    Arrival,
    Presence,
    alignment_reader,
    map_reader,
    read_presence,
    status_reader,
)

_log = logging.getLogger(__name__)


class Dispatcher:
    """Reads what arrives at a robot.

    Parameters
    ----------
    robot, boot
        Of this run: what it published itself is no news.
    plan
        Told what is news.
    """

    def __init__(self, robot: str, boot: str, plan: ComparisonSchedule) -> None:
        self._robot = robot
        self._boot = boot
        self._plan = plan
        self._maps = map_reader()
        self._statuses = status_reader()
        self._alignments = alignment_reader()
        self._assembler = MapAssembler()

    @property
    def refused(self) -> int:
        """How many messages were not what they should be."""
        return self._maps.refused + self._statuses.refused + self._alignments.refused

    def take(self, arrival: Arrival) -> None:
        """Take in what arrived."""
        presence = read_presence(arrival)
        if presence is not None:
            self._take_presence(presence)
        elif self._maps.reads(arrival):
            self._take_map(arrival)
        elif self._statuses.reads(arrival):
            self._take_status(arrival)
        elif self._alignments.reads(arrival):
            self._take_alignment(arrival)

    def _take_presence(self, presence: Presence) -> None:
        if presence.robot == self._robot:
            if presence.boot != self._boot and presence.here:
                _log.warning("another run of %s is here, too: its maps will mix", self._robot)
        elif presence.here:
            self._plan.peer_here(presence.robot, presence.boot)
        else:
            self._plan.peer_gone(presence.robot, presence.boot)

    def _take_map(self, arrival: Arrival) -> None:
        message = self._maps.read(arrival)
        if message is not None and message.robot != self._robot:
            robot_map = self._assembler.update(message)
            if robot_map is not None:
                self._plan.peer_map(robot_map)

    def _take_status(self, arrival: Arrival) -> None:
        status = self._statuses.read(arrival)
        if status is not None and status.robot != self._robot and status.state == "finished":
            self._plan.peer_finished(status.robot, status.boot, status.map_version)

    def _take_alignment(self, arrival: Arrival) -> None:
        message = self._alignments.read(arrival)
        if message is not None and message.robot != self._robot:
            self._plan.learned(message)
