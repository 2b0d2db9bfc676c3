"""What a robot hears of its team, handed on to its plan of comparisons."""

import logging
import math
import time

from mapweave_agent.by_hand.kept_orders import KeptOrders
from mapweave_agent.comparison_schedule import ComparisonSchedule
from mapweave_agent.live.whereabouts import Whereabouts
from mapweave_agent.needs import Needs
from mapweave_protocol.link.assembler import MapAssembler
from mapweave_protocol.link.claimants import Claimants, tell_coordinators, tell_robots
from mapweave_protocol.link.guard.refusals import Refusals
from mapweave_protocol.link.guard.strangers import Strangers
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
from mapweave_protocol.link.lacking import Lacking
from mapweave_protocol.link.status_schedule import SILENCE
from mapweave_protocol.wire.messages import StatusMessage

MAX_PEERS = 64  # with a map here
FAR = 1_000_000  # versions from one message to the next: eleven days of one a second

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
        self.refusals = Refusals()
        self._maps = map_reader(self.refusals)
        self._statuses = status_reader(self.refusals)
        self._alignments = alignment_reader(self.refusals)
        self._joint_statuses = joint_status_reader(self.refusals)
        self._strangers = Strangers(self._forget)
        self._lacking = Lacking()
        self._coordinators = Claimants()
        self._namesakes = Claimants()
        self._namesakes.take(boot, here=True)
        self._assembler = MapAssembler()
        self._met = False
        self._heard = -math.inf
        self._incomplete: frozenset[str] = frozenset()

    @property
    def lacking(self) -> frozenset[str]:
        """Robots of whose maps a newer version is known than is here."""
        return self._incomplete

    def met(self) -> bool:
        """Tell whether a robot or a coordinator came since this was asked the last time."""
        met, self._met = self._met, False
        return met

    @property
    def refused(self) -> int:
        """How many messages were not what they should be."""
        return self.refusals.total + self._orders.refused

    def take(self, arrival: Arrival) -> None:
        """Take in what arrived."""
        presence = read_presence(arrival, self.refusals)
        coordinator = read_coordinator(arrival, self.refusals)
        self._met |= (presence is not None or coordinator is not None) and not arrival.gone
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
        self._note(presence.robot)
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
            self._heard_coordinator(time.monotonic())
            self._needs.coordinator(status)
            self._plan.coordinator(status)
            self._whereabouts.coordinator(status)
            self._orders.coordinator(status)

    def _heard_coordinator(self, now: float) -> None:
        """Note that a coordinator speaks; after a silence the link was away, though nobody left."""
        self._met |= now - self._heard > SILENCE
        self._heard = now

    def _take_map(self, arrival: Arrival) -> None:
        message = self._maps.read(arrival)
        if message is None or (message.robot, message.boot) == (self._robot, self._boot):
            return
        self._note(message.robot)
        team = self._plan.team
        held = team.version_of(message.robot, message.boot)
        if message.version > (held or 0) + FAR:
            self._maps.refuse(arrival.key, f"version {message.version}, far beyond the one here")
        elif len(team.newest) >= MAX_PEERS and not team.knows(message.robot):
            self._maps.refuse(arrival.key, "there are too many robots already")
        else:
            robot_map = self._assembler.update(message)
            if robot_map is not None:
                self._plan.peer_map(robot_map)
            self._lacks(message.robot, missing=self._assembler.missing(message.robot))

    def _take_status(self, arrival: Arrival) -> None:
        status = self._statuses.read(arrival)
        if status is None or (status.robot, status.boot) == (self._robot, self._boot):
            return
        self._note(status.robot)
        self._needs.peer(status)
        self._check_map_of(status)
        newest = self._plan.team.current_version_of(status.robot, status.boot) or 0
        self._lacks(status.robot, missing=status.submaps > 0 and newest < status.map_version)
        if status.state == "finished":
            self._plan.peer_finished(status.robot, status.boot, status.map_version)

    def _check_map_of(self, status: StatusMessage) -> None:
        """Drop a peer's map of a version that the peer has not come to: it is not from it.

        The peer sees in our status that it is lacking, and sends it again.
        """
        robot, boot = status.robot, status.boot
        held = self._plan.team.version_of(robot, boot)
        false = held is not None and held > status.map_version
        if self._lacking.due(f"{robot} {boot}", held, time.monotonic(), lacks=false):
            _log.warning("the map of %s here is not from it: dropped", robot)
            self._assembler.forget(robot, boot)
            self._plan.team.drop(robot, boot)

    def _note(self, robot: str) -> None:
        self._strangers.heard(robot, has_map=self._plan.team.knows(robot))

    def _forget(self, robot: str) -> None:
        """Forget what is known of a robot that never came with a map."""
        self._plan.team.forget(robot)
        self._assembler.forget(robot)

    def _lacks(self, robot: str, *, missing: bool) -> None:
        self._incomplete = self._incomplete | {robot} if missing else self._incomplete - {robot}

    def _take_alignment(self, arrival: Arrival) -> None:
        message = self._alignments.read(arrival)
        if message is not None and message.robot != self._robot:
            self._note(message.robot)
            self._plan.learned(message)
            self._whereabouts.met(message)
