"""``mapweave watch``: what a team does, told as it happens."""

import argparse
import logging
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from typing import TypeVar

import zenoh
from rich.console import Console, Group
from rich.live import Live
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from mapweave.cli import Command, add_json_argument, say
from mapweave.text import shown
from mapweave_protocol.errors import MessageError
from mapweave_protocol.link.arguments import DEFAULT_TEAM, add_connection_arguments, connection_of
from mapweave_protocol.link.asking import ask_joint_maps
from mapweave_protocol.link.assembler import MESSAGES_TO_COMPLETE, MapAssembler
from mapweave_protocol.link.guard.refusals import Refusals
from mapweave_protocol.link.guard.strangers import Strangers
from mapweave_protocol.link.inbox import (
    Arrival,
    Inbox,
    Reader,
    alignment_reader,
    joint_reader,
    joint_status_reader,
    map_reader,
    read_coordinator,
    read_presence,
    status_reader,
)
from mapweave_protocol.link.joint_changes import JointAssembler
from mapweave_protocol.link.security.settings import LinkSettings
from mapweave_protocol.link.session import declare_subscriber, open_session
from mapweave_protocol.narration.attendance import Attendance
from mapweave_protocol.narration.past import Past
from mapweave_protocol.narration.story import Story
from mapweave_protocol.narration.story_coverage import CoverageStory
from mapweave_protocol.narration.story_joint import tell_components
from mapweave_protocol.wire.keys import (
    ALIGNMENT,
    COORDINATOR_LIVE,
    JOINT_MAP,
    JOINT_STATUS,
    LIVE,
    MAP,
    STATUS,
)
from mapweave_protocol.wire.messages import (
    JointMapMessage,
    JointStatusMessage,
    MapMessage,
    StatusMessage,
)
from mapweave_protocol.wire.model import Message
from mapweave_protocol.wire.queries import JointQuery

MAX_LINE = 2000  # characters shown of what is told
KEPT_LINES = 20  # of the story stay on the terminal
POLL = 0.5  # [s]
ASKED_EVERY = 1.0  # [s] between two questions for a version that was missed, at the least
MAX_ROBOTS = 64  # told of
HISTORY = {MAP: MESSAGES_TO_COMPLETE, STATUS: 1, ALIGNMENT: 1, JOINT_MAP: 1, JOINT_STATUS: 1}

M = TypeVar("M", bound=Message)
Teller = Callable[[Arrival], Iterator[str]]
_log = logging.getLogger(__name__)


class Watcher:
    """Reads what arrives and tells it.

    Parameters
    ----------
    team
        The team's id.
    clock
        Returns the time [s].

    Attributes
    ----------
    story
        What it knows.
    lacks_version
        Whether a version of the joint map was missed: what came says what changed of another one,
        or the coordinator may have another one than was told.
    """

    def __init__(
        self, team: str = DEFAULT_TEAM, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.story = Story()
        self._clock = clock
        self._attendance = Attendance(team, self.story)
        self.lacks_version = False
        self._coverage = CoverageStory()
        self._assembler = MapAssembler()
        self._joint = JointAssembler()
        self._told: tuple[str, int] | None = None
        self._strangers = Strangers(self._forget)
        self._refusals = refusals = Refusals()
        self._tellers: tuple[Teller, ...] = (
            self._tell_presence,
            _teller(status_reader(refusals), self._tell_status),
            _teller(map_reader(refusals), self._tell_map),
            _teller(alignment_reader(refusals), self.story.aligned),
            _teller(joint_reader(refusals), self.tell_joint),
            _teller(joint_status_reader(refusals), self._expect),
        )

    def tell(self, arrival: Arrival) -> Iterator[str]:
        """Yield the lines that tell `arrival`."""
        self._attendance.heard()
        for teller in self._tellers:
            yield from teller(arrival)

    def look(self, *, linked: bool) -> Iterator[str]:
        """Yield the lines that tell what has lasted, such as that somebody is gone.

        Parameters
        ----------
        linked
            Whether a router is connected.
        """
        yield from self._attendance.look(self._clock(), linked=linked)

    def tell_joint(self, message: JointMapMessage) -> Iterator[str]:
        """Yield the lines that tell a version of the joint map, once."""
        if self._told == (message.series, message.version):
            self.lacks_version = False
            return
        whole = self._joint.update(message)
        self.lacks_version = whole is None
        if whole is not None:
            self._told = message.series, message.version
            joint = whole.unpack()
            yield from self.story.joined(joint)
            yield from self._coverage.changed(joint)

    def _expect(self, message: JointStatusMessage) -> Iterator[str]:
        # Nothing else tells of a last version that was lost while the link was down.
        there = message.series, message.version
        self.lacks_version |= message.version > 0 and self._told != there
        yield from self._attendance.coordinator_spoke(self._clock())

    def _tell_status(self, message: StatusMessage) -> Iterator[str]:
        self._note(message.robot)
        yield from self.story.status(message)

    def _note(self, robot: str) -> None:
        state = self.story.robots.get(robot)
        self._strangers.heard(robot, has_map=state is not None and state.map is not None)

    def _forget(self, robot: str) -> None:
        self.story.robots.pop(robot, None)
        self._assembler.forget(robot)

    def _tell_map(self, message: MapMessage) -> Iterator[str]:
        self._note(message.robot)
        mapped = [robot for robot, state in self.story.robots.items() if state.map is not None]
        if len(mapped) >= MAX_ROBOTS and message.robot not in mapped:
            return
        robot_map = self._assembler.update(message)
        if robot_map is not None:
            yield from self.story.mapped(robot_map)

    def _tell_presence(self, arrival: Arrival) -> Iterator[str]:
        presence = read_presence(arrival, self._refusals)
        coordinator = read_coordinator(arrival, self._refusals)
        if coordinator is not None:
            boot, here = coordinator
            self.lacks_version |= here  # it is seen again after an outage
            yield from self._attendance.coordinator(boot, self._clock(), here=here)
        if presence is not None:
            self._note(presence.robot)
            yield from self._attendance.robot(presence, self._clock())


def _teller(reader: Reader[M], tell: Callable[[M], Iterator[str]]) -> Teller:
    def teller(arrival: Arrival) -> Iterator[str]:
        message = reader.read(arrival) if reader.reads(arrival) else None
        return tell(message) if message is not None else iter(())

    return teller


def watch(
    team: str,
    endpoints: Sequence[str],
    watcher: Watcher,
    on_wait: Callable[[str], None],
    link: LinkSettings | None = None,
) -> Iterator[str | None]:
    """Yield the lines of the story as it happens, and None now and then while nothing does.

    Those that tell what was before say so.
    """
    inbox = Inbox()
    with open_session(endpoints, on_wait=on_wait, link=link) as session, ExitStack() as subscribers:
        _subscribe(session, team, inbox, subscribers)
        past = Past()
        yield from past.marked(_tell_latest(session, team, watcher))
        due = time.monotonic()
        while True:
            # A complete version may come late, or never where all robots are parked.
            if watcher.lacks_version and time.monotonic() >= due:
                yield from past.marked(_tell_latest(session, team, watcher))
                due = time.monotonic() + ASKED_EVERY
            arrival = inbox.get(POLL)
            past.heard(time.monotonic(), something=arrival is not None)
            yield from past.marked(watcher.tell(arrival)) if arrival else (None,)
            yield from watcher.look(linked=bool(session.info.routers_zid()))


def _tell_latest(session: zenoh.Session, team: str, watcher: Watcher) -> Iterator[str]:
    try:
        answers = ask_joint_maps(session, team, JointQuery())
    except MessageError as error:
        _log.warning("answer ignored, %s", error)
        return
    for latest in answers:
        yield from watcher.tell_joint(latest)


def _subscribe(session: zenoh.Session, team: str, inbox: Inbox, stack: ExitStack) -> None:
    for keys, history in HISTORY.items():
        key = keys.pattern(team=team)
        stack.enter_context(declare_subscriber(session, key, inbox.put, history=history))
    for live in (LIVE, COORDINATOR_LIVE):
        key = live.pattern(team=team)
        stack.enter_context(session.liveliness().declare_subscriber(key, inbox.put, history=True))


def _show(story: Story, lines: Sequence[str]) -> Group:
    """Return the robots as a table, who is together, and the last lines of the story."""
    table = Table("robot", "", "progress", "submaps", "segments", box=None)
    for robot, state in sorted(story.robots.items()):
        here = "[green]here[/]" if state.here else "[red]gone[/]"
        table.add_row(robot, here, state.progress, str(state.submaps), str(state.segments))
    joint = story.joint
    together = f"joint map {joint.version}: {tell_components(joint)}" if joint else ""
    return Group(table, Text(together), "", *(Text(line) for line in lines))


def _run_live(console: Console, watcher: Watcher, story: Iterator[str | None]) -> None:
    lines: deque[str] = deque(maxlen=KEPT_LINES)
    with Live(console=console, auto_refresh=False) as live:
        for line in story:
            if line is not None:
                lines.append(_stamped(line))
            live.update(_show(watcher.story, lines), refresh=True)


def _run_plain(options: argparse.Namespace, story: Iterator[str | None]) -> None:
    for line in filter(None, story):
        say(options, {"time": time.time(), "line": line}, [_stamped(shown(line, MAX_LINE))])


def _stamped(line: str) -> str:
    return f"{time.strftime('%H:%M:%S')} {line}"


def _configure(parser: argparse.ArgumentParser) -> None:
    add_connection_arguments(parser)
    add_json_argument(parser)


def _run(options: argparse.Namespace) -> int:
    team, endpoints, link = connection_of(options)
    console = Console()
    waiting = Console(stderr=True)
    watcher = Watcher(team)
    story = watch(
        team,
        endpoints,
        watcher,
        lambda reason: waiting.print(f"waiting for a router: {escape(shown(reason, 300))}"),
        link,
    )
    if console.is_terminal and not options.json:
        _run_live(console, watcher, story)
    else:
        _run_plain(options, story)
    return 0


command = Command(
    "Show what a team does, as it happens.",
    _configure,
    _run,
    "--team rescue --connect tcp/192.168.1.10:7447",
)
