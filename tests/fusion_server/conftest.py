"""Maps and alignments made by hand, and the processes: a real router, real servers.

The maps are of an L-shaped room, seen by robots that never were.
"""

import resource
import secrets
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TypeAlias

import numpy as np
import pytest
import zenoh
import zenoh.ext as ze

from mapweave.evidence import Evidence
from mapweave.geometry import se2
from mapweave.maps import (
    Alignment,
    Decision,
    JointMap,
    LineMap,
    RobotMap,
    Submap,
    Trajectory,
    component_name,
)
from mapweave.reasons import Reason
from mapweave_protocol.link import session
from mapweave_protocol.link.asking import ask_joint_maps
from mapweave_protocol.link.assembler import MapSender
from mapweave_protocol.link.inbox import Inbox, joint_reader
from mapweave_protocol.link.joint_changes import JointAssembler
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import AlignmentMessage, MapVersion
from mapweave_protocol.wire.queries import JointQuery

MakeMap: TypeAlias = Callable[..., RobotMap]
MakeAlignments: TypeAlias = Callable[..., AlignmentMessage]
Found: TypeAlias = tuple[RobotMap, RobotMap, AlignmentMessage]

MAPWEAVE = Path(sys.executable).with_name("mapweave")
PATIENCE = 30.0  # [s] for what takes a fraction of a second on a quiet machine
POSE_A, POSE_B = (1.0, 1.0, 0.3), (3.0, 2.0, -2.0)
A_TO_B = tuple(se2.between(POSE_A, POSE_B))

# Corners counter-clockwise [m]: the walls' visible side, inside, is on their left.
L_ROOM = np.array([[0, 0], [9, 0], [9, 4], [5, 4], [5, 7], [0, 7]], dtype=float)


def _l_room(pose: tuple[float, float, float]) -> LineMap:
    """Return the room as seen from a frame at `pose` [m, m, rad] in the room's."""
    corners = se2.transform_points(se2.inverse(pose), L_ROOM)
    walls = np.hstack([corners, np.roll(corners, -1, axis=0)])
    count = len(walls)
    free_space = (se2.transform_points(se2.inverse(pose), L_ROOM * 0.96 + 0.1),)
    return LineMap(walls, np.zeros(count, dtype=np.int64), np.full(count, 20), free_space)


def _make_map(
    robot: str,
    version: int = 1,
    *,
    boot: str = "first",
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    components: int = 1,
    first: int = 0,
) -> RobotMap:
    trajectory = Trajectory(np.array([0]), np.array([0.0]), np.zeros((1, 3)))
    submaps = tuple(
        Submap(number, first + number, np.zeros(3), _l_room(pose), trajectory)
        for number in range(components)
    )
    return RobotMap(robot, boot, version, submaps)


def _make_alignments(
    reference: RobotMap,
    other: RobotMap,
    decision: Decision = "accepted",
    *,
    transform: tuple[float, float, float] = (0.0, 0.0, 0.0),
    confidence: float = 0.9,
    reason: str = "40 m of wall in common",
    evidence: Mapping[str, float] | None = None,
) -> AlignmentMessage:
    """Return what robot `reference` found for the first component of both."""
    ends = (component_name(m.robot, min(m.components, default=0)) for m in (reference, other))
    ours, theirs = ends
    cause = Reason.words(reason)
    measured = Evidence.of(evidence or {})
    alignment = Alignment(ours, theirs, np.array(transform), decision, confidence, cause, measured)
    return AlignmentMessage.pack(
        reference.robot, MapVersion.of(reference), MapVersion.of(other), [alignment]
    )


@pytest.fixture
def make_map() -> MakeMap:
    """Return the maker of robot maps: `make_map(robot, version, boot=, pose=, components=)`."""
    return _make_map


@pytest.fixture
def make_alignments() -> MakeAlignments:
    """Return the maker of alignments: `make_alignments(reference, other, decision, …)`."""
    return _make_alignments


class ServerProcess:
    """A running ``mapweave server``; what it logs goes to a file."""

    def __init__(self, endpoint: str, team: str, store: Path, interval: float, *words: str) -> None:
        self.store = store
        self._log = store.with_name(f"{secrets.token_hex(4)}.log")
        arguments = ["--connect", endpoint, "--team", team, "--store", str(store), *words]
        with self._log.open("w") as log:
            self._process = subprocess.Popen(
                [MAPWEAVE, "server", *arguments, "--min-interval", str(interval)], stderr=log
            )

    @property
    def log(self) -> str:
        """What it said so far."""
        return self._log.read_text()

    def wait_for_log(self, text: str) -> None:
        """Wait until it has said `text`."""
        deadline = time.monotonic() + PATIENCE
        while text not in self.log:
            assert self._process.poll() is None, self.log
            assert time.monotonic() < deadline, self.log
            time.sleep(0.02)

    def limit_files(self, size: int | None) -> None:
        """Let no file it writes grow beyond `size` [bytes], as if the disk were full."""
        _, hard = resource.prlimit(self._process.pid, resource.RLIMIT_FSIZE)
        soft = resource.RLIM_INFINITY if size is None else size
        resource.prlimit(self._process.pid, resource.RLIMIT_FSIZE, (soft, hard))

    def stop(self, how: int = signal.SIGINT) -> int:
        """Signal it, wait for its end, and return its exit status."""
        if self._process.poll() is None:
            self._process.send_signal(how)
        return self._process.wait(PATIENCE)


class Robot:
    """A robot's session: its token, its publishers."""

    def __init__(self, connection: zenoh.Session, team: str, name: str, stack: ExitStack) -> None:
        live = keys.LIVE.build(team=team, robot=name, boot="first")
        stack.enter_context(connection.liveliness().declare_token(live))
        self._connection = connection
        self._parts = {"team": team, "robot": name}
        self._sender = MapSender()
        self._pairs: dict[str, ze.AdvancedPublisher] = {}
        self._maps = session.declare_map_publisher(connection, keys.MAP.build(**self._parts))

    def publish_map(self, robot_map: RobotMap) -> None:
        """Publish what is new in a map."""
        self._maps.put(self._sender.payload(robot_map))

    def publish_alignments(self, message: AlignmentMessage) -> None:
        """Publish what was found."""
        pair = {"reference": message.reference.robot, "other": message.other.robot}
        key = keys.ALIGNMENT.build(**self._parts, **pair)
        if key not in self._pairs:
            self._pairs[key] = session.declare_alignment_publisher(self._connection, key)
        self._pairs[key].put(encode(message))


class Watcher:
    """Collects the versions of the joint map as they come."""

    def __init__(self, connection: zenoh.Session, team: str, stack: ExitStack) -> None:
        self._inbox = Inbox()
        self._connection, self._team = connection, team
        key = keys.JOINT_MAP.build(team=team)
        stack.enter_context(session.declare_subscriber(connection, key, self._inbox.put))
        self._reader = joint_reader()
        self._assembler = JointAssembler()

    def next(self) -> JointMap:
        """Return the next version."""
        joint = self.within(PATIENCE)
        assert joint is not None, "no joint map came"
        return joint

    def within(self, seconds: float) -> JointMap | None:
        """Return the next version, None if there is none within so long."""
        arrival = self._inbox.get(seconds)
        if arrival is None:
            return None
        message = self._reader.read(arrival)
        assert message is not None
        whole = self._assembler.update(message)
        if whole is None:  # what changed since a version from before it listened
            query = JointQuery(version=message.version)
            [answer] = ask_joint_maps(self._connection, self._team, query)
            whole = self._assembler.update(answer)
        assert whole is not None
        return whole.unpack()


class Network:
    """Sessions of the test's own at the router."""

    patience = PATIENCE

    def __init__(self, endpoint: str, team: str, stack: ExitStack) -> None:
        self.endpoint = endpoint
        self.team = team
        self._stack = stack

    @staticmethod
    def groups(joint: JointMap) -> list[list[str]]:
        """Return which robots' components are joined."""
        return sorted(sorted(component.robots) for component in joint.components)

    def connect(self) -> zenoh.Session:
        """Return a session, closed when the test ends."""
        return self._stack.enter_context(session.open_session([self.endpoint], patience=PATIENCE))

    def watcher(self) -> Watcher:
        """Return a watcher that listens already."""
        return Watcher(self.connect(), self.team, self._stack)

    @contextmanager
    def robot(self, name: str) -> Iterator[Robot]:
        """Return a robot that is gone when the block ends."""
        with ExitStack() as stack:
            connection = stack.enter_context(
                session.open_session([self.endpoint], patience=PATIENCE)
            )
            yield Robot(connection, self.team, name, stack)


@pytest.fixture
def network(endpoint: str, team: str) -> Iterator[Network]:
    with ExitStack() as stack:
        yield Network(endpoint, team, stack)


StartServer: TypeAlias = Callable[..., ServerProcess]


@contextmanager
def _router(endpoint: str) -> Iterator[None]:
    process = subprocess.Popen([MAPWEAVE, "router", "--listen", endpoint])
    try:
        yield
    finally:
        process.terminate()
        process.wait(PATIENCE)


@pytest.fixture(scope="session")
def endpoint() -> Iterator[str]:
    """Return where a router listens, a process of its own."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    with _router(f"tcp/127.0.0.1:{port}"):
        yield f"tcp/127.0.0.1:{port}"


@pytest.fixture
def team() -> str:
    """Return the id of a team nobody else has: all tests share a router."""
    return f"t{secrets.token_hex(6)}"


@pytest.fixture
def start_server(endpoint: str, team: str, tmp_path: Path) -> Iterator[StartServer]:
    """Return what starts a server of the team on its store, and waits until it serves."""
    with ExitStack() as stack:

        def start(*words: str, interval: float = 0.0, store: Path | None = None) -> ServerProcess:
            file = store or tmp_path / "store.sqlite"
            server = ServerProcess(endpoint, team, file, interval, *words)
            stack.callback(server.stop, signal.SIGKILL)
            server.wait_for_log(f"coordinating team {team}")
            return server

        yield start


@pytest.fixture
def found(make_map: MakeMap, make_alignments: MakeAlignments) -> Found:
    """Return the maps of robots a and b, and how they lie to each other."""
    map_a, map_b = make_map("a", pose=POSE_A), make_map("b", pose=POSE_B)
    return map_a, map_b, make_alignments(map_a, map_b, transform=A_TO_B)


@pytest.fixture
def finished_team(network: Network, start_server: StartServer, found: Found) -> ServerProcess:
    """Return a server that saw three versions, and whose robots are gone."""
    server = start_server()
    watcher = network.watcher()
    map_a, map_b, alignments = found
    with network.robot("a") as a, network.robot("b") as b:
        a.publish_map(map_a)
        watcher.next()
        b.publish_map(map_b)
        watcher.next()
        a.publish_alignments(alignments)
        assert watcher.next().version == 3
    return server
