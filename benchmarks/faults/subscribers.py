"""Subscribers of the joint map against a long history: how soon each has the latest, and the order.

One is there before the coordinator, one comes while robots map, one afterwards; one sleeps
meanwhile. Each is a process; it counts from when it has loaded, or has woken up.
"""

import argparse
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import zenoh

from benchmarks.faults.trial import Trial, team_on_trial, two_in_the_same_rooms, until
from benchmarks.tables import OUTPUT, format_table, write_json
from mapweave.maps import JointMap
from mapweave_fusion_server.store import Store
from mapweave_protocol.link.session import open_session
from mapweave_protocol.wire.codec import decode, encode
from mapweave_protocol.wire.keys import JOINT_MAP
from mapweave_protocol.wire.messages import JointMapMessage

HISTORY = 2000  # versions in the store when the coordinator starts
ASLEEP = 60.0  # [s]
WITHIN = 2.0  # [s] from a version's publication, or one's own coming, to having it
RATE = 2.0
PROGRAM = """
import sys
from mapweave_protocol import joint_maps
print("ready", flush=True)
for joint in joint_maps(sys.argv[1], connect=sys.argv[2]):
    print(joint.version, flush=True)
"""


@dataclass
class Subscriber:
    """A subscriber in a process of its own.

    Attributes
    ----------
    name
        What it is there for.
    since
        When it had loaded, or woke up; none while it loads or sleeps [s].
    delivered
        The versions that it got, and when [s].
    """

    name: str
    process: subprocess.Popen[str]
    since: float | None = None
    delivered: list[tuple[int, float]] = field(default_factory=list)

    def listen(self) -> None:
        """Note what it says until it ends."""
        assert self.process.stdout is not None  # piped
        for line in self.process.stdout:
            if line.strip() == "ready":
                self.since = time.monotonic()
            else:
                self.delivered.append((int(line), time.monotonic()))

    def sleep(self) -> None:
        """Stop it in its tracks."""
        self.process.send_signal(signal.SIGSTOP)
        self.since = None

    def wake(self) -> None:
        """Have it go on."""
        self.since = time.monotonic()
        self.process.send_signal(signal.SIGCONT)

    def lags(self, published: dict[int, float]) -> Iterator[float]:
        """Yield how long it took for versions that it could have [s]."""
        assert self.since is not None
        came = dict(self.delivered)
        latest = max((v for v, at in published.items() if at <= self.since), default=0)
        for version, at in published.items():
            if version >= latest and version in came:
                yield max(came[version] - max(at, self.since), 0.0)

    @property
    def is_in_order(self) -> bool:
        """Whether each version followed the one before."""
        versions = [version for version, _ in self.delivered]
        return versions == list(range(versions[0], versions[0] + len(versions)))

    def has(self, version: int) -> bool:
        """Tell whether it got a version."""
        return any(v == version for v, _ in self.delivered)


@contextmanager
def _subscribed(trial: Trial, name: str) -> Iterator[Subscriber]:
    words = [sys.executable, "-c", PROGRAM, trial.plan.team, trial.plan.listen]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        subscriber = Subscriber(name, process)
        thread = threading.Thread(target=subscriber.listen)
        thread.start()
        try:
            until(lambda: subscriber.since is not None, f"subscriber {name}")
            yield subscriber
        finally:
            process.kill()
            thread.join()


@contextmanager
def _published(trial: Trial) -> Iterator[dict[int, float]]:
    """Give when each version was published first [s]."""
    published: dict[int, float] = {}

    def note(sample: zenoh.Sample) -> None:
        now = time.monotonic()
        published.setdefault(decode(JointMapMessage, sample.payload.to_bytes()).version, now)

    key = JOINT_MAP.build(team=trial.plan.team)
    with (
        open_session([trial.plan.listen], patience=60.0) as session,
        session.declare_subscriber(key, note),
    ):
        yield published


def _fill(store: Path, team: str) -> None:
    with Store(store, team) as filled:
        for number in range(1, HISTORY + 1):
            message = JointMapMessage.pack(JointMap(number, (), ()), filled.series)
            filled.add_version(number, float(number), encode(message))


def try_out(folder: Path) -> tuple[list[Subscriber], dict[int, float]]:
    """Return the subscribers of a team that maps, and when versions were published."""
    with (
        team_on_trial(folder, two_in_the_same_rooms(), f"{RATE:g}") as trial,
        _published(trial) as published,
        ExitStack() as stack,
    ):
        _fill(trial.plan.store, trial.plan.team)
        before = stack.enter_context(_subscribed(trial, "before"))
        trial.start_coordinator()
        until(lambda: before.has(HISTORY), "the latest of the history")
        sleeper = stack.enter_context(_subscribed(trial, "asleep"))
        until(lambda: sleeper.has(HISTORY), "the latest of the history")
        sleeper.sleep()
        slept = time.monotonic()
        for robot in trial.plan.robots:
            trial.start_robot(robot)
        until(lambda: HISTORY + 1 in published, "a version")
        during = stack.enter_context(_subscribed(trial, "during"))
        until(lambda: all(_is_parked(trial, r) for r in trial.plan.robots), "robots to park")
        time.sleep(max(0.0, slept + ASLEEP - time.monotonic()))
        sleeper.wake()
        after = stack.enter_context(_subscribed(trial, "after"))
        those = [before, during, sleeper, after]
        until(lambda: all(s.has(max(published)) for s in those), "the latest at all subscribers")
        return those, dict(published)


def _is_parked(trial: Trial, robot: str) -> bool:
    return trial.says(f"agent-{robot}", "finished:")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say where results go."""
    parser.add_argument("--output", type=Path, default=OUTPUT / "subscribers", help="folder")


def run(options: argparse.Namespace) -> None:
    """Print how soon each subscriber had what; fail if it was late, or out of order."""
    with tempfile.TemporaryDirectory() as folder:
        subscribers, published = try_out(Path(folder))
    rows, good = [], True
    for subscriber in subscribers:
        latest = max(subscriber.lags(published))
        good &= subscriber.is_in_order and latest <= WITHIN
        rows.append(_row(subscriber, latest))
    print(format_table(["subscriber", "versions", "most s", "order"], rows))
    print(f"each version within {WITHIN:g} s and in order: {'yes' if good else 'no'}, bar: yes")
    write_json(options.output / "subscribers.json", rows)
    if not good:
        sys.exit(1)


def _row(subscriber: Subscriber, latest: float) -> Sequence[str]:
    order = "as counted" if subscriber.is_in_order else str([v for v, _ in subscriber.delivered])
    return [subscriber.name, str(len(subscriber.delivered)), f"{latest:.2f}", order]
