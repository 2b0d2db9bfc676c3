"""What a robot hears of its team, handed on to its plan of comparisons."""

import logging

from mapweave_agent.by_hand.kept_orders import KeptOrders
from mapweave_agent.comparison_schedule import ComparisonSchedule
from mapweave_agent.live.whereabouts import Whereabouts
from mapweave_agent.needs import Needs
from mapweave_protocol.link.assembler import MapAssembler
from mapweave_protocol.link.claimants import Claimants, tell_coordinators, tell_robots
from mapweave_protocol.link.inbox import (
    Arrival,
    Presence,
    alignment_reader,
    joint_status_reader,
    map_reader,
    read_coordinator,
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
    needs
        Told what others hold.
    whereabouts
        Told which frames the joint map has.
    orders
        Told what operators order.
    """

    def __init__(
        self,
        robot: str,
        boot: str,
        plan: ComparisonSchedule,
        needs: Needs,
        whereabouts: Whereabouts,
        orders: KeptOrders,
    ) -> None:
        self._robot = robot
        self._boot = boot
        self._plan = plan
        self._needs = needs
        self._whereabouts = whereabouts
        self._orders = orders
        self._maps = map_reader()
        self._statuses = status_reader()
        self._alignments = alignment_reader()
        self._joint_statuses = joint_status_reader()
        self._coordinators = Claimants()
        self._namesakes = Claimants()
        self._namesakes.take(boot, here=True)
        self._assembler = MapAssembler()

    @property
    def refused(self) -> int:
        """How many messages were not what they should be."""
        readers = self._maps, self._statuses, self._alignments, self._joint_statuses
        return sum(reader.refused for reader in readers) + self._orders.refused

    def take(self, arrival: Arrival) -> None:
        """Take in what arrived."""
        presence, coordinator = read_presence(arrival), read_coordinator(arrival)
        if presence is not None:
            self._take_presence(presence)
        elif coordinator is not None:
            self._take_coordinator(*coordinator)
        elif self._maps.reads(arrival):
            self._take_map(arrival)
        elif self._statuses.reads(arrival):
            self._take_status(arrival)
        elif self._alignments.reads(arrival):
            self._take_alignment(arrival)
        elif self._joint_statuses.reads(arrival):
            self._take_joint_status(arrival)
        else:
            self._orders.takes(arrival)

    def _take_presence(self, presence: Presence) -> None:
        if presence.robot == self._robot:
            count = self._namesakes.take(presence.boot, here=presence.here)
            if count:
                _log.warning(tell_robots(self._robot, count))
        if (presence.robot, presence.boot) == (self._robot, self._boot):
            return
        if presence.here:
            self._plan.peer_here(presence.robot, presence.boot)
        else:
            self._plan.peer_gone(presence.robot, presence.boot)

    def _take_coordinator(self, boot: str, here: bool) -> None:
        count = self._coordinators.take(boot, here=here)
        if count:
            _log.warning(tell_coordinators(count))
        self._whereabouts.coordinator_here(boot, here=here)
        if not here:
            self._needs.coordinator_gone(boot)

    def _take_joint_status(self, arrival: Arrival) -> None:
        status = self._joint_statuses.read(arrival)
        if status is not None:
            self._needs.coordinator(status)
            self._plan.coordinator(status)
            self._whereabouts.coordinator(status)
            self._orders.coordinator(status)

    def _take_map(self, arrival: Arrival) -> None:
        message = self._maps.read(arrival)
        if message is not None:
            robot_map = self._assembler.update(message)
            if robot_map is not None:
                self._plan.peer_map(robot_map)

    def _take_status(self, arrival: Arrival) -> None:
        status = self._statuses.read(arrival)
        if status is None or (status.robot, status.boot) == (self._robot, self._boot):
            return
        self._needs.peer(status)
        if status.state == "finished":
            self._plan.peer_finished(status.robot, status.boot, status.map_version)

    def _take_alignment(self, arrival: Arrival) -> None:
        message = self._alignments.read(arrival)
        if message is not None and message.robot != self._robot:
            self._plan.learned(message)
            self._whereabouts.met(message)
