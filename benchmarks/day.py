"""A day of a team fed in ten minutes: coordinator and page must not take more with each hour.

A team of real processes is recorded: maps as they grow, decisions, positions. Then a coordinator
with a store of its own gets them over the network, first as they came, then as a day of patrols
goes on: again and again the whole maps, corrected by some millimetres, decisions weighed again, and
positions at the rate of scans. A browser looks at the page all the time.
"""

import argparse
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import cycle
from pathlib import Path
from typing import TypeVar

import numpy as np
import zenoh
from playwright.sync_api import CDPSession

from benchmarks.faults.crowd import drive
from benchmarks.faults.trial import until
from benchmarks.faults.usage import Figures, Usage
from benchmarks.tables import OUTPUT, format_table, write_json
from mapweave.maps import Alignment, RobotMap
from mapweave_deploy.run.launcher import (
    Plan,
    free_endpoint,
    start_agent,
    start_router,
    start_server,
)
from mapweave_deploy.run.processes import ProcessGroup
from mapweave_fusion_server.web.address import HttpAddress
from mapweave_protocol import alignments, poses, robot_maps
from mapweave_protocol.link.session import open_session
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import AlignmentMessage, MapMessage, PoseMessage
from tests.fusion_server.web.browser import chromium, visit

TEAM = "day"
ROUND = 600.0  # [s] of driving that are recorded
RECORDED_AT = 4.0  # times real time
QUIET = 20.0  # [s] without a word: the team is done
POSES = 10.0  # [1/s] of each robot, in the time of the feed: what a page can show
NUDGE = 0.003  # [m] by which maps are corrected from round to round
SAMPLED = 5.0  # [s] between two looks at memory
MOST_GROWN, LEAST_GROWN = 0.1, 16.0  # in the second half; [MiB] that are nothing
T = TypeVar("T")
Timed = list[tuple[float, T]]


@dataclass
class Recording:
    """What a team said, and when [s of its own time]."""

    maps: Timed[RobotMap] = field(default_factory=list)
    decisions: Timed[AlignmentMessage] = field(default_factory=list)
    poses: Timed[PoseMessage] = field(default_factory=list)

    def last_maps(self) -> dict[str, RobotMap]:
        """Return each robot's last map."""
        return {each.robot: each for _, each in self.maps}

    def last_decisions(self) -> dict[tuple[str, str], AlignmentMessage]:
        """Return what was decided last of each pair."""
        return {(each.reference.robot, each.other.robot): each for _, each in self.decisions}


def record(folder: Path, robots: int) -> Recording:
    """Run a team to its end and return what it said."""
    plan = Plan(
        TEAM, drive(folder, robots, ROUND), f"{RECORDED_AT:g}", free_endpoint(),
        folder / "store.sqlite", folder / "states", None,
    )  # fmt: skip
    recording, begun = Recording(), time.monotonic()
    at = [plan.listen]
    with ProcessGroup(folder) as crew, ExitStack() as stack:
        start_router(crew, plan)
        keep, said = stack.enter_context, recording
        keep(_noting(said.maps, robot_maps(TEAM, connect=at, timeout=QUIET), begun))
        keep(_noting(said.decisions, alignments(TEAM, connect=at, timeout=QUIET), begun))
        keep(_noting(said.poses, poses(TEAM, connect=at, timeout=QUIET), begun))
        start_server(crew, plan, plan.store)
        for member in plan.members:
            start_agent(crew, plan, member)
        logs = [folder / f"agent-{robot}.log" for robot in plan.robots]
        until(lambda: all(_says(log, "finished:") for log in logs), "a team that is done")
    return recording


def _says(log: Path, words: str) -> bool:
    return log.exists() and words in log.read_text(errors="replace")


@contextmanager
def _noting(into: Timed[T], source: Iterable[T], begun: float) -> Iterator[None]:
    """Keep what comes, and when; it ends by itself."""

    def note() -> None:
        into.extend((RECORDED_AT * (time.monotonic() - begun), each) for each in source)

    thread = threading.Thread(target=note)
    thread.start()
    try:
        yield
    finally:
        thread.join()


class Feeder:
    """Says what a team said, as if its robots were there."""

    def __init__(self, session: zenoh.Session, recording: Recording) -> None:
        self._session = session
        self._recording = recording
        self._maps = recording.last_maps()
        self._last = recording.last_decisions()
        self._poses = cycle(self._of_each_robot(recording.poses))
        self._wobble = np.random.default_rng(1)
        self.said = 0

    def be_there(self, stack: ExitStack) -> None:
        """Declare the robots alive."""
        for robot, robot_map in self._maps.items():
            key = keys.LIVE.build(team=TEAM, robot=robot, boot=robot_map.boot)
            stack.enter_context(self._session.liveliness().declare_token(key))

    def first_round(self) -> list[tuple[float, Callable[[], None]]]:
        """Return what is to be said, and when in the round [s]."""
        said = [(at, partial(self._say_map, each)) for at, each in self._recording.maps]
        said += [(at, partial(self._say_decision, m)) for at, m in self._recording.decisions]
        return sorted(said, key=lambda each: each[0])

    def next_round(self) -> list[tuple[float, Callable[[], None]]]:
        """Return the same of a round in which nothing new is seen."""
        self._maps = {robot: self._corrected(each) for robot, each in self._maps.items()}
        again = list(self._maps.values())
        said = [(k * ROUND / len(again), partial(self._say_map, m)) for k, m in enumerate(again)]
        late = [self._weighed_again(message) for message in self._last.values()]
        said += [(0.9 * ROUND, partial(self._say_decision, message)) for message in late]
        return sorted(said, key=lambda each: each[0])

    def say_poses(self) -> None:
        """Say where each robot is now."""
        for pose in next(self._poses):
            key = keys.POSE.build(team=TEAM, robot=pose.robot)
            self._say(key, encode(pose.model_copy(update={"sent": time.time()})))

    def _of_each_robot(self, all_poses: Timed[PoseMessage]) -> list[list[PoseMessage]]:
        by_robot = [[p for _, p in all_poses if p.robot == robot] for robot in self._maps]
        return [list(row) for row in zip(*by_robot, strict=False)]

    def _say_map(self, robot_map: RobotMap) -> None:
        key = keys.MAP.build(team=TEAM, robot=robot_map.robot)
        self._say(key, encode(MapMessage.pack(robot_map)))

    def _say_decision(self, message: AlignmentMessage) -> None:
        pair = {"reference": message.reference.robot, "other": message.other.robot}
        self._say(keys.ALIGNMENT.build(team=TEAM, robot=message.robot, **pair), encode(message))

    def _say(self, key: str, payload: bytes) -> None:
        self._session.put(key, payload, congestion_control=zenoh.CongestionControl.BLOCK)
        self.said += 1

    def _corrected(self, robot_map: RobotMap) -> RobotMap:
        """Return the next version of a map: its submaps lie a little otherwise."""
        moved = [
            replace(s, pose=s.pose + self._wobble.normal(0.0, (NUDGE, NUDGE, 0.0)))
            for s in robot_map.submaps
        ]
        return replace(robot_map, version=robot_map.version + 1, submaps=tuple(moved))

    def _weighed_again(self, message: AlignmentMessage) -> AlignmentMessage:
        """Return what was decided of a pair, about the maps as they are."""
        reference, other = (
            end.model_copy(update={"version": self._maps[end.robot].version})
            for end in (message.reference, message.other)
        )
        doubted = [self._doubted(each.unpack()) for each in message.alignments]
        return AlignmentMessage.pack(message.robot, reference, other, doubted)

    def _doubted(self, alignment: Alignment) -> Alignment:
        less = alignment.confidence * (1 - 0.01 * self._wobble.random())
        return replace(alignment, confidence=less)


def feed(folder: Path, recording: Recording, rounds: int, seconds: float) -> list[Figures]:
    """Have a coordinator and a page take so many rounds in that time; return what they took."""
    page, usage = HttpAddress("127.0.0.1", _free_port()), Usage()
    plan = Plan(
        TEAM, [], "1", free_endpoint(), folder / "day.sqlite", folder / "none", None, page=page,
        token="day",
    )  # fmt: skip
    with ProcessGroup(folder) as crew, ExitStack() as stack:
        start_router(crew, plan)
        start_server(crew, plan, plan.store)
        until(lambda: _says(folder / "server.log", "live page"), "a page")
        session = stack.enter_context(open_session([plan.listen], patience=60.0))
        feeder = Feeder(session, recording)
        feeder.be_there(stack)
        seen = stack.enter_context(visit(stack.enter_context(chromium()), page.url()))
        cdp = seen.tab.context.new_cdp_session(seen.tab)
        cdp.send("Performance.enable")
        looked = 0.0
        for _ in _paced(feeder, rounds, seconds / rounds):
            seen.tab.wait_for_timeout(1)
            if time.monotonic() - looked > SAMPLED:
                looked = time.monotonic()
                usage.look({child.name: child.process.pid for child in crew.children})
                usage.note("page (scripts)", _heap(cdp))
        shown = seen.tab.locator("#map").get_attribute("data-version")
    print(f"{feeder.said} messages; the page shows version {shown}")
    return usage.figures()


def _paced(feeder: Feeder, rounds: int, lasts: float) -> Iterator[None]:
    """Say all of it, each round in so many seconds; yield ten times a second."""
    begun = time.monotonic()
    for number in range(rounds):
        plan = feeder.first_round() if number == 0 else feeder.next_round()
        span = max(ROUND, *(at for at, _ in plan)) if plan else ROUND
        for tick in range(max(1, round(lasts * POSES))):
            now = begun + number * lasts + tick / POSES
            time.sleep(max(0.0, now - time.monotonic()))
            while plan and plan[0][0] / span <= (tick + 1) / (lasts * POSES):
                plan.pop(0)[1]()
            feeder.say_poses()
            yield
        for _, say in plan:
            say()


def _heap(cdp: CDPSession) -> int:
    """Return what the page's scripts hold [bytes], what nobody holds any more left out."""
    cdp.send("HeapProfiler.collectGarbage")
    metrics = cdp.send("Performance.getMetrics")["metrics"]
    return int(next(m["value"] for m in metrics if m["name"] == "JSHeapUsedSize"))


def _free_port() -> int:
    return int(free_endpoint().rpartition(":")[2])


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say how long a day is, and in what time it passes."""
    parser.add_argument("--robots", type=int, default=6, metavar="N", help="in the team (6)")
    parser.add_argument("--hours", type=float, default=24.0, metavar="H", help="fed (24)")
    parser.add_argument(
        "--seconds", type=float, default=600.0, metavar="S", help="in which they pass (600)"
    )


def run(options: argparse.Namespace) -> None:
    """Record, feed, print what was taken; fail if memory grew."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "day").mkdir()
        recording = record(Path(folder), options.robots)
        print(
            f"recorded: {len(recording.maps)} maps, {len(recording.decisions)} decisions,"
            f" {len(recording.poses)} positions",
            flush=True,
        )
        rounds = max(2, round(options.hours * 3600 / ROUND))
        figures = feed(Path(folder, "day"), recording, rounds, options.seconds)
    rows = [[each.name, *(f"{n:.1f}" for n in each.numbers)] for each in figures]
    print(format_table(["", "MiB in the third quarter", "in the last", "CPU s/s"], rows))
    grown = [each.name for each in figures if each.has_grown(MOST_GROWN, LEAST_GROWN)]
    print(
        f"grew by more than {MOST_GROWN:.0%} and {LEAST_GROWN:g} MiB: {grown or 'none'}; bar: none"
    )
    write_json(OUTPUT / "day.json", {each.name: each.numbers for each in figures})
    if grown:
        sys.exit(1)
