"""Processes of a team killed, stopped and started again at random: what becomes of its joint map.

Robots play their logs on from where they were stopped; router and coordinator come back as they
were. In the end every scan is in the joint map, where it is in that of a team that nothing befell.
"""

import argparse
import random
import sys
import tempfile
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.faults.trial import Trial, TrialError, last_scan, team_on_trial, until
from benchmarks.tables import OUTPUT, format_table, write_json
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import JointMap, RobotMap, component_name
from mapweave_deploy.run.evaluation import component_path
from mapweave_deploy.run.team_plan import simulated_team
from mapweave_protocol.link.inbox import Inbox, joint_reader
from mapweave_protocol.link.session import open_session
from mapweave_protocol.link.subscriber import joint_maps
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.keys import JOINT_MAP
from mapweave_protocol.wire.messages import JointMapMessage

DISTANCE, ANGLE = 0.1, np.radians(1.0)  # [m], [rad] from where it is in the undisturbed joint map
PAUSE = 0.5, 4.0  # [s] between two events
AWAY = 0.2, 3.0  # [s] that a process is gone
QUIET = 20.0  # [s] without a new version: the team is done
SHARE_OF_AGENTS = 0.7

Scan = tuple[str, int]  # robot and index


@dataclass
class Heard:
    """What came of the joint map.

    Attributes
    ----------
    delivered
        Versions as a subscriber got them.
    last
        The last one of these.
    published
        By version, what was published as it.
    since
        When the last one came [s].
    """

    delivered: list[int] = field(default_factory=list)
    last: JointMap | None = None
    published: dict[int, list[JointMapMessage]] = field(default_factory=lambda: defaultdict(list))
    since: float = field(default_factory=time.monotonic)

    def take(self, joint: JointMap) -> None:
        """Take in a version."""
        self.delivered.append(joint.version)
        self.last, self.since = joint, time.monotonic()


@dataclass(frozen=True)
class Result:
    """What a team came to.

    Attributes
    ----------
    joint
        Its last joint map.
    maps
        Of all runs of all robots.
    events
        What befell it.
    faults
        What went wrong with versions.
    """

    joint: JointMap
    maps: list[RobotMap]
    events: list[str]
    faults: list[str]

    def places(self) -> Iterator[tuple[str, str, dict[Scan, FloatArray]]]:
        """Yield of each component its name, that of its joint frame, and the poses of its scans."""
        for robot_map in self.maps:
            for number in robot_map.components:
                name = component_name(robot_map.robot, number)
                index, poses = component_path(robot_map, number)
                for part in self.joint.components:
                    if name in part.robots:
                        placed = se2.compose(part.robots[name], poses)
                        scans = [(robot_map.robot, int(i)) for i in index]
                        frame = min(part.robots)
                        yield name, frame, dict(zip(scans, placed, strict=True))


class Disturbances:
    """What befalls a team, drawn by a seed."""

    def __init__(self, trial: Trial, seed: int) -> None:
        self._trial = trial
        self._draw = random.Random(seed)
        self.told: list[str] = []

    def befall(self) -> None:
        """End something that runs, and start it again after a while."""
        time.sleep(self._draw.uniform(*PAUSE))
        kill = self._draw.random() < 0.5
        driving = [robot for robot in self._trial.plan.robots if not _parked(self._trial, robot)]
        if driving and self._draw.random() < SHARE_OF_AGENTS:
            self._restart_agent(self._draw.choice(driving), kill=kill)
        elif self._draw.random() < 0.5:
            self._restart("router", kill=kill)
        else:
            self._restart("server", kill=kill)

    def _restart_agent(self, robot: str, *, kill: bool) -> None:
        before = len(self._trial.kept(robot))
        self._restart(f"agent {robot}", kill=kill)
        # Another one of it only when it has begun to map: else nothing is put to the test.
        runs = self._trial.kept(robot)
        self.told[-1] += f", run {before} of it ended at scan {last_scan(runs[-1].map)}"

    def _restart(self, name: str, *, kill: bool) -> None:
        self._trial.end(name, kill=kill)
        self.told.append(f"{name} {'killed' if kill else 'stopped'}")
        time.sleep(self._draw.uniform(*AWAY))
        if name == "router":
            self._trial.start_router()
        elif name == "server":
            self._trial.start_coordinator()
        else:
            _go_on(self._trial, name.removeprefix("agent "))


def _go_on(trial: Trial, robot: str) -> None:
    """Start a robot again, from the scan after the last that is on its disk."""
    runs = trial.kept(robot)
    trial.start_robot(robot, max((last_scan(run.map) for run in runs), default=-1) + 1)
    until(lambda: len(trial.kept(robot)) > len(runs) or _parked(trial, robot), f"{robot} to map")


def _parked(trial: Trial, robot: str) -> bool:
    """Tell whether a robot has mapped the last scan of its log; the last few may fit nowhere."""
    return trial.says(f"agent-{robot}", "finished:")


def drive(folder: Path, options: argparse.Namespace, events: int) -> Result:
    """Let a team map while so many events befall it; return what it came to."""
    members = simulated_team(options.world, options.robots, options.seed, folder / "logs")
    with (
        team_on_trial(folder, members, f"{options.rate:g}") as trial,
        _hearing(trial) as heard,
    ):
        trial.start_coordinator()
        for robot in trial.plan.robots:
            trial.start_robot(robot)
        until(lambda: all(map(trial.kept, trial.plan.robots)), "robots that map")
        disturbances = Disturbances(trial, options.seed)
        for _ in range(events):
            disturbances.befall()
            print(f"{len(disturbances.told)}: {disturbances.told[-1]}", flush=True)
        for robot in trial.plan.robots:
            until(lambda robot=robot: _parked(trial, robot), f"{robot} to park")  # type: ignore[misc]
        until(lambda: time.monotonic() - heard.since > QUIET, "the last version")
        maps = [run.map for robot in trial.plan.robots for run in trial.kept(robot)]
    if heard.last is None:
        raise TrialError("no joint map")
    return Result(heard.last, maps, disturbances.told, list(_faults(heard)))


@contextmanager
def _hearing(trial: Trial) -> Iterator[Heard]:
    """Give what a subscriber gets, and what is published."""
    heard, inbox, over = Heard(), Inbox(), threading.Event()
    key = JOINT_MAP.build(team=trial.plan.team)

    def subscribe() -> None:
        endpoint = [trial.plan.listen]
        for joint in joint_maps(trial.plan.team, connect=endpoint, since=0, stopping=over.is_set):
            heard.take(joint)

    with (
        open_session([trial.plan.listen], patience=60.0) as session,
        session.declare_subscriber(key, inbox.put),
        ThreadPoolExecutor(1) as thread,
    ):
        done = thread.submit(subscribe)
        try:
            yield heard
        finally:
            over.set()
            done.result()
            reader = joint_reader()
            while (arrival := inbox.get(0.0)) is not None:
                message = reader.read(arrival)
                if message is not None:
                    heard.published[message.version].append(message)


def _faults(heard: Heard) -> Iterator[str]:
    """Yield what went wrong with versions: lost, out of order, or a number used twice."""
    if heard.delivered != list(range(1, len(heard.delivered) + 1)):
        yield f"versions at a subscriber: {heard.delivered}"
    for version, messages in heard.published.items():
        used = times_used(messages)
        if used > 1:
            yield f"version {version} was used {used} times"


def times_used(messages: Sequence[JointMapMessage]) -> int:
    """Return for how many versions one number was used, of all that was published under it.

    After a restart the latest version is published again whole, which was published before as what
    changed: both say where every robot is.
    """
    forms = [{encode(m) for m in messages if m.changes == changed} for changed in (True, False)]
    placed = {
        (m.series, repr([(c.robots, c.confidence, c.marks) for c in m.components]))
        for m in messages
    }
    return max(len(placed), *(len(form) for form in forms))


def differences(quiet: Result, disturbed: Result) -> Iterator[str]:
    """Yield how the joint map of a disturbed team differs from that of one left in peace."""
    truth = {
        scan: (frame, pose) for _, frame, scans in quiet.places() for scan, pose in scans.items()
    }
    seen: set[Scan] = set()
    frames: dict[str, tuple[str, FloatArray]] = {}
    for name, frame, scans in sorted(disturbed.places(), key=lambda each: -len(each[2])):
        common = [scan for scan in scans if scan in truth]
        if seen.issuperset(common):  # such as the last scan, again, of who had delivered not all
            continue
        seen |= set(common)
        theirs = truth[common[0]][0]
        poses = np.array([scans[scan] for scan in common])
        true = np.array([truth[scan][1] for scan in common])
        if frame not in frames:
            frames[frame] = theirs, se2.fit(poses, true)
            continue
        if frames[frame][0] != theirs:
            yield f"{name}: in the joint frame {frame}, and not in the undisturbed one"
            continue
        yield from _off(name, se2.compose(frames[frame][1], poses), true)
    parts = {frame for _, frame, _ in quiet.places()}
    if len(frames) > len(parts):
        sizes = Counter[str]()
        for _, frame, scans in disturbed.places():
            sizes[frame] += len(scans)
        told = ", ".join(f"{frame} of {size} scans" for frame, size in sizes.most_common())
        apart = [frame for frame, _ in sizes.most_common()][len(parts) :]
        yield "\n".join(
            [
                f"joint components: {told}; undisturbed {sorted(parts)}",
                *_found(disturbed, apart),
            ]
        )
    lost = truth.keys() - seen
    if lost:
        yield f"scans lost: {len(lost)} of {len(truth)}, such as {sorted(lost)[:5]}"


def _found(disturbed: Result, apart: Sequence[str]) -> Iterator[str]:
    """Yield what was found of each component that stayed `apart`."""
    for name in apart:
        told = [
            f"  {a.reference} + {a.other} {a.decision}, {a.confidence:.0%}: {a.reason}"
            for a in disturbed.joint.alignments
            if name in (a.reference, a.other)
        ]
        yield f"{name} was compared {len(told)} times"
        yield from told


def _off(name: str, poses: FloatArray, true: FloatArray) -> Iterator[str]:
    apart = se2.fit(poses, true)
    moved = se2.compose(apart, poses)
    distance = float(np.median(np.linalg.norm(moved[:, :2] - poses[:, :2], axis=1)))
    angle = abs(float(se2.wrap(apart[2])))
    if distance > DISTANCE or angle > ANGLE:
        yield f"{name}: off by {distance:.2f} m, {np.degrees(angle):.1f} deg ({len(poses)} scans)"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say what befalls which team."""
    parser.add_argument("--events", type=int, default=50, metavar="N", help="how many (50)")
    parser.add_argument("--robots", type=int, default=6, metavar="N", help="in the team (6)")
    parser.add_argument("--world", default="arena", help="where they drive (%(default)s)")
    parser.add_argument("--rate", type=float, default=1.0, help="times real time (1)")
    parser.add_argument("--seed", type=int, default=1, help="of world and events (1)")
    parser.add_argument("--output", type=Path, default=OUTPUT / "kills", help="folder")


def run(options: argparse.Namespace) -> None:
    """Drive the team undisturbed and disturbed, print how they differ; fail if they do."""
    results: Mapping[str, Result] = {
        name: _drive(options, events) for name, events in (("quiet", 0), ("kills", options.events))
    }
    quiet, disturbed = results["quiet"], results["kills"]
    wrong = [*quiet.faults, *disturbed.faults, *differences(quiet, disturbed)]
    rows = [
        [
            name,
            str(len(r.events)),
            str(len(r.maps)),
            str(r.joint.version),
            str(len(r.joint.components)),
        ]
        for name, r in results.items()
    ]
    print(format_table(["team", "events", "runs", "versions", "joint components"], rows))
    print("\n".join(wrong))
    print(f"differences: {len(wrong)}, bar: none (of {DISTANCE:g} m, {np.degrees(ANGLE):.0f} deg)")
    write_json(options.output / "kills.json", {"events": disturbed.events, "wrong": wrong})
    if wrong:
        sys.exit(1)


def _drive(options: argparse.Namespace, events: int) -> Result:
    with tempfile.TemporaryDirectory() as folder:
        return drive(Path(folder), options, events)
