"""What a flood of hostile messages does to a running team: versions, memory, refusals.

It ends with 1 where a bar is not held: versions slow down, a message is not counted, memory grows.
"""

import argparse
import json
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import zenoh

from benchmarks.faults.flood import room
from mapweave_protocol.link.assembler import MapSender
from mapweave_protocol.link.inbox import Inbox, joint_reader
from mapweave_protocol.link.session import declare_map_publisher, open_session
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.codec import decode
from mapweave_protocol.wire.messages import JointStatusMessage

MAPWEAVE = Path(sys.executable).with_name("mapweave")
TEAM = "team"
ROBOTS = ("r1", "r2")
COMPONENTS = ["r1/0", "r2/0"]
PACE = 0.2  # [s] between two maps of a robot
BEFORE = 10.0  # [s]
PATIENCE = 60.0
MIB = 2**20
SHARE = 0.8  # of the versions a second before, at the least
GROWTH = 50 * MIB  # of a process, at the most


@dataclass
class Outcome:
    """What was seen.

    Attributes
    ----------
    before, during
        Versions a second, before the flood and in it.
    sent, refused, dropped
        Messages of the flood; those that the coordinator counted.
    grown
        By process, by how much its memory was more than before, at its most [bytes].
    robots
        The components in the last version.
    rate
        At which the flood came [1/s].
    """

    before: float
    during: float
    sent: int
    refused: int
    dropped: int
    grown: dict[str, int]
    robots: list[str]
    rate: float

    @property
    def share(self) -> float:
        """Of the versions a second before, how many came in the flood."""
        return self.during / self.before if self.before else 0.0

    def shortfalls(self) -> Iterator[str]:
        """Yield which bars are not held, in words with figure and bar."""
        if self.share < SHARE:
            yield f"versions flow at {self.share:.0%} of before, bar {SHARE:.0%}"
        if self.refused + self.dropped < self.sent:
            yield f"{self.refused + self.dropped} messages are counted, bar all {self.sent}"
        if self.robots != COMPONENTS:
            yield f"the joint map is of {self.robots}, bar {COMPONENTS}"
        for name, grown in self.grown.items():
            if grown > GROWTH:
                yield f"{name} grew by {grown / MIB:.0f} MiB, bar {GROWTH / MIB:.0f}"


def measure(count: int, rate: float) -> Outcome:
    """Run a router, a coordinator, a watcher and two robots; flood them; return what came."""
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        endpoint = _free_endpoint()
        processes = dict(_processes(endpoint, Path(folder), stack))
        session = stack.enter_context(open_session([endpoint], patience=PATIENCE))
        said = stack.enter_context(_hearing(session))
        stack.enter_context(_mapping(session))
        said.wait_for_version()
        before = said.versions_in(BEFORE)
        sizes = {name: _forget_peak(process.pid) for name, process in processes.items()}
        flood = [sys.executable, "-m", "benchmarks.faults.flood"]
        started, first = time.monotonic(), said.version
        done = subprocess.run(
            [*flood, endpoint, TEAM, str(count), str(rate)],
            check=True, capture_output=True, text=True,
        )  # fmt: skip
        during = (said.version - first) / (time.monotonic() - started)
        said.wait_for(count)
        grown = {name: _peak(p.pid) - sizes[name] for name, p in processes.items()}
        status = said.status
        return Outcome(
            before, during, count, sum(status.refused.values()), status.dropped, grown,
            said.robots, count / float(done.stdout),
        )  # fmt: skip


def _free_endpoint() -> str:
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


def _processes(
    endpoint: str, folder: Path, stack: ExitStack
) -> Iterator[tuple[str, "subprocess.Popen[bytes]"]]:
    reach = ["--connect", endpoint, "--team", TEAM]
    store = ["--store", str(folder / "store.sqlite"), "--min-interval", "0.2"]
    commands = {
        "router": ["router", "--listen", endpoint],
        "coordinator": ["server", *reach, *store],
        "watch": ["watch", *reach],
    }
    for name, words in commands.items():
        log = stack.enter_context((folder / f"{name}.log").open("wb"))
        process = subprocess.Popen([MAPWEAVE, *words], stdout=log, stderr=log)
        stack.callback(process.wait)
        stack.callback(process.kill)
        yield name, process


class _Said:
    """What the coordinator says."""

    def __init__(self) -> None:
        self.inbox = Inbox()
        self.version = 0
        self.robots: list[str] = []
        self.status = JointStatusMessage(
            boot="none", stamp=0.0, series="none", version=0, pending=False
        )
        self._reader = joint_reader()

    def hear(self, timeout: float) -> None:
        """Take in what comes next."""
        arrival = self.inbox.get(timeout)
        if arrival is None:
            return
        if keys.JOINT_STATUS.matches(arrival.key):
            self.status = decode(JointStatusMessage, arrival.payload)
            self.robots = sorted(self.status.frames)
        elif (message := self._reader.read(arrival)) is not None:
            self.version = message.version

    def wait_for_version(self) -> None:
        """Wait for a version with all robots."""
        deadline = time.monotonic() + PATIENCE
        while self.robots != COMPONENTS:
            if time.monotonic() > deadline:
                sys.exit(f"no version with {', '.join(COMPONENTS)} within {PATIENCE:g} s")
            time.sleep(0.1)

    def versions_in(self, seconds: float) -> float:
        """Return how many versions a second come in so long a time."""
        first = self.version
        time.sleep(seconds)
        return (self.version - first) / seconds

    def wait_for(self, count: int) -> None:
        """Wait until the coordinator has counted so many messages."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            if sum(self.status.refused.values()) + self.status.dropped >= count:
                return
            time.sleep(0.2)


@contextmanager
def _hearing(session: zenoh.Session) -> Iterator[_Said]:
    said, over = _Said(), threading.Event()

    def hear() -> None:
        while not over.is_set():
            said.hear(0.1)

    thread = threading.Thread(target=hear)
    with (
        session.declare_subscriber(keys.JOINT_MAP.build(team=TEAM), said.inbox.put),
        session.declare_subscriber(keys.JOINT_STATUS.build(team=TEAM), said.inbox.put),
    ):
        thread.start()
        try:
            yield said
        finally:
            over.set()
            thread.join()


@contextmanager
def _mapping(session: zenoh.Session) -> Iterator[None]:
    """Publish maps that grow, of each robot one every `PACE`."""
    over = threading.Event()

    def publish() -> None:
        senders = {robot: MapSender() for robot in ROBOTS}
        with ExitStack() as stack:
            publishers = {
                robot: stack.enter_context(
                    declare_map_publisher(session, keys.MAP.build(team=TEAM, robot=robot))
                )
                for robot in ROBOTS
            }
            version = 0
            while not over.wait(PACE):
                version += 1
                for robot in ROBOTS:
                    publishers[robot].put(senders[robot].payload(room(robot, version)))

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def _forget_peak(pid: int) -> int:
    """Let the peak of a process be what it takes now, and return it [bytes]."""
    Path(f"/proc/{pid}/clear_refs").write_text("5")
    return _peak(pid)


def _peak(pid: int) -> int:
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith("VmHWM"))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what can be chosen."""
    parser.add_argument("--count", type=int, default=10_000, help="messages (default 10000)")
    parser.add_argument("--rate", type=float, default=1000.0, help="a second (default 1000)")


def run(options: argparse.Namespace) -> None:
    """Measure and print."""
    found = measure(options.count, options.rate)
    print(f"{found.sent} hostile messages at {found.rate:.0f}/s, one in 100 a bomb")
    print(
        f"  versions: {found.before:.2f}/s before, {found.during:.2f}/s during ({found.share:.0%})"
    )
    print(f"  counted by the coordinator: {found.refused} refused, {found.dropped} without room")
    for name, grown in found.grown.items():
        print(f"  {name}: {grown / MIB:+.0f} MiB at its most")
    print(f"  in the last version: {', '.join(found.robots)}")
    Path("bench").mkdir(exist_ok=True)
    Path("bench/hostile.json").write_text(json.dumps(vars(found), indent=2))
    short = list(found.shortfalls())
    print("\n".join(short or ["all bars held"]))
    if short:
        sys.exit(1)
