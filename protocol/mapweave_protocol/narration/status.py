"""``mapweave status``: who of a team is here, how far each is, and what went wrong; one table."""

import argparse
import json
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field

import zenoh
from rich.console import Console
from rich.table import Table
from rich.text import Text

from mapweave.cli import EXIT_FAILED, Command, add_json_argument, argument, positive
from mapweave_protocol.link.arguments import add_connection_arguments, connection_of
from mapweave_protocol.link.asking import request_statuses
from mapweave_protocol.link.guard.refusals import Refusals
from mapweave_protocol.link.inbox import (
    Arrival,
    Inbox,
    joint_status_reader,
    read_coordinator,
    read_presence,
    status_reader,
)
from mapweave_protocol.link.session import open_session
from mapweave_protocol.wire.keys import COORDINATOR_LIVE, JOINT_STATUS, LIVE, STATUS
from mapweave_protocol.wire.messages import JointStatusMessage, StatusMessage

LISTENED = 1.5  # [s] for everybody to answer; a robot does between two scans
COLUMNS = (
    "",
    "here",
    "state",
    "scans",
    "map version",
    "versions behind",
    "maps held",
    "sent",
    "messages refused",
    "messages lost",
)
MEANING = (
    "map version: the latest of a robot's own map; of the joint map, in the coordinator's row."
    " versions behind: of the robot's map, that the coordinator lacks."
    " maps held: how many runs of robots this one has the map of."
    " messages refused: as not valid, by who sent them. messages lost: that found no room."
    " Robots that are gone are shown as far as the coordinator holds a map of theirs."
)


@dataclass
class Team:
    """What was heard of a team.

    Attributes
    ----------
    here
        Robots of which a run is here.
    statuses
        By robot, what it said last.
    coordinators
        Boots of the coordinators that are here.
    coordinator
        What one said last.
    """

    here: set[str] = field(default_factory=set)
    statuses: dict[str, StatusMessage] = field(default_factory=dict)
    coordinators: set[str] = field(default_factory=set)
    coordinator: JointStatusMessage | None = None

    @property
    def robots(self) -> list[str]:
        """All that are here, or said something, or that the coordinator holds a map of."""
        held = () if self.coordinator is None else self.coordinator.maps
        return sorted(self.here | self.statuses.keys() | {m.robot for m in held})

    def held(self, robot: str) -> str:
        """Return the versions that the coordinator holds of the maps of a robot's runs."""
        maps = () if self.coordinator is None else self.coordinator.maps
        return ", ".join(str(m.version) for m in maps if m.robot == robot)

    def behind(self, robot: str) -> int | None:
        """Return how many versions of a robot's map the coordinator lacks, None if unknown."""
        status = self.statuses.get(robot)
        if status is None or self.coordinator is None:
            return None
        runs = [m for m in self.coordinator.maps if (m.robot, m.boot) == (robot, status.boot)]
        return status.map_version - (runs[0].version if runs else 0)


def listen(session: zenoh.Session, team: str, seconds: float) -> Team:
    """Return what a team says within so many seconds."""
    inbox, heard = Inbox(), Team()
    with ExitStack() as stack:
        for keys in (LIVE, COORDINATOR_LIVE):
            tokens = session.liveliness()
            key = keys.pattern(team=team)
            stack.enter_context(tokens.declare_subscriber(key, inbox.put, history=True))
        for key in (STATUS.pattern(team=team), JOINT_STATUS.build(team=team)):
            stack.enter_context(session.declare_subscriber(key, inbox.put))
        for coordinator in (False, True):
            request_statuses(session, team, inbox.add, coordinator=coordinator)
        take = _Listener(heard).take
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            arrival = inbox.get(left)
            if arrival is not None:
                take(arrival)
    return heard


class _Listener:
    def __init__(self, heard: Team) -> None:
        self._heard = heard
        self._refusals = Refusals()
        self._statuses = status_reader(self._refusals)
        self._coordinators = joint_status_reader(self._refusals)

    def take(self, arrival: Arrival) -> None:
        """Take in what arrived."""
        presence = read_presence(arrival, self._refusals)
        coordinator = read_coordinator(arrival, self._refusals)
        if presence is not None:
            change = self._heard.here.add if presence.here else self._heard.here.discard
            change(presence.robot)
        elif coordinator is not None:
            boot, here = coordinator
            (self._heard.coordinators.add if here else self._heard.coordinators.discard)(boot)
        elif self._statuses.reads(arrival):
            status = self._statuses.read(arrival)
            if status is not None:
                self._heard.statuses[status.robot] = status
        elif self._coordinators.reads(arrival):
            self._heard.coordinator = self._coordinators.read(arrival) or self._heard.coordinator


def table_of(team: Team) -> Table:
    """Return it as a table: a row for the coordinator, and one for each robot."""
    table = Table(*COLUMNS, box=None)
    for row in (_coordinator_row(team), *_robot_rows(team)):
        table.add_row(*(Text(cell) for cell in row))
    return table


def _coordinator_row(team: Team) -> tuple[str, ...]:
    said = team.coordinator
    here = {0: "no", 1: "yes"}.get(len(team.coordinators), f"{len(team.coordinators)} of them")
    if said is None:
        return "coordinator", here, "says nothing"
    doing = "making the next" if said.pending else "up to date"
    state = doing if said.stored else f"{doing}, not storing"
    version = str(said.version)
    held = str(len(said.maps))
    return "coordinator", here, state, "", version, "", held, "", _refused(said), str(said.dropped)


def _robot_rows(team: Team) -> Iterator[tuple[str, ...]]:
    for robot in team.robots:
        status, here = team.statuses.get(robot), "yes" if robot in team.here else "no"
        if status is None:
            state = "says nothing" if robot in team.here else "gone"
            yield robot, here, state, "", team.held(robot)
            continue
        behind = team.behind(robot)
        sent = sum(traffic.bytes for traffic in status.sent.values())
        yield (
            robot,
            here,
            status.state,
            f"{status.scans_placed} of {status.scans_seen} placed, {status.scans_skipped} skipped",
            str(status.map_version),
            "" if behind is None else str(behind),
            str(len(status.holds)),
            f"{sent / 1e6:.1f} MB" if sent >= 1e6 else f"{sent / 1e3:.0f} kB",
            _refused(status),
            str(status.dropped),
        )


def _refused(status: StatusMessage | JointStatusMessage) -> str:
    return ", ".join(f"{count} {what}" for what, count in status.refused.items()) or "0"


def as_json(team: Team) -> str:
    """Return the same for programs, as one line."""
    return json.dumps(
        {
            "coordinators": sorted(team.coordinators),
            "coordinator": team.coordinator and team.coordinator.model_dump(mode="json"),
            "here": sorted(team.here),
            "robots": {r: s.model_dump(mode="json") for r, s in sorted(team.statuses.items())},
        }
    )


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.description = f"{command.summary} {MEANING}"
    add_connection_arguments(parser)
    add_json_argument(parser)
    parser.add_argument(
        "--patience",
        type=argument(positive),
        default=5.0,
        metavar="S",
        help="how long to try to reach a router [s] (default 5)",
    )


def _run(options: argparse.Namespace) -> int:
    name, endpoints, link = connection_of(options)
    with open_session(endpoints, patience=options.patience, link=link) as session:
        team = listen(session, name, LISTENED)
    if options.json:
        print(as_json(team))  # noqa: T201
    else:
        Console(width=None if sys.stdout.isatty() else 200).print(table_of(team))
    return 0 if team.coordinators else EXIT_FAILED


command = Command("Tell how each of a team is.", _configure, _run, "--team rescue")
