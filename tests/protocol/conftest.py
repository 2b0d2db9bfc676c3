"""Random maps, and a router process, for the tests of what travels."""

import secrets
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from mapweave.evidence import Evidence, RunnerUp
from mapweave.maps import (
    Alignment,
    JointComponent,
    JointMap,
    LineMap,
    RobotMap,
    Submap,
    Trajectory,
)
from mapweave.reasons import Reason

ROUTER = """
import sys, zenoh
from mapweave_protocol.link.session import router_config
with zenoh.open(router_config(sys.argv[1:])):
    print("listening", flush=True)
    sys.stdin.read()
"""


def _random_lines(rng: np.random.Generator, segments: int) -> LineMap:
    starts = np.cumsum(rng.normal(0, 1, (segments, 2)), axis=0)
    ends = starts + rng.uniform(0.1, 1, (segments, 2))
    polyline = np.cumsum(rng.integers(0, 2, segments))
    rings = tuple(rng.uniform(-9, 9, (n, 2)) for n in rng.integers(3, 9, int(rng.integers(3))))
    polyline -= polyline[0] if segments else 0
    return LineMap(np.hstack([starts, ends]), polyline, rng.integers(0, 99, segments), rings)


def _random_submap(rng: np.random.Generator, number: int) -> Submap:
    scans = int(rng.integers(0, 9))
    stamps = np.where(rng.random(scans) < 0.2, np.nan, 1e9 + np.cumsum(rng.random(scans)))
    poses = np.column_stack([rng.normal(0, 9, (scans, 2)), rng.uniform(-np.pi, np.pi, scans)])
    trajectory = Trajectory(np.arange(scans) + 100 * number, stamps, poses)
    lines = _random_lines(rng, int(rng.integers(0, 12)))
    return Submap(number, int(rng.integers(3)), rng.uniform(-3, 3, 3), lines, trajectory)


def make_random_map(
    seed: int, submaps: int = 3, *, robot: str = "a", boot: str = "b1", version: int = 1
) -> RobotMap:
    """Return a map that `seed` determines."""
    rng = np.random.default_rng(seed)
    return RobotMap(
        robot, boot, version, tuple(_random_submap(rng, number) for number in range(submaps))
    )


def make_random_joint(seed: int, version: int = 1) -> JointMap:
    """Return a joint map that `seed` determines."""
    rng = np.random.default_rng(seed)
    lines = _random_lines(rng, 10)
    robots = {"a/0": np.zeros(3), "b/0": rng.uniform(-3, 3, 3)}
    component = JointComponent(robots, float(rng.random()), lines, rng.random(10))
    alignment = Alignment(
        "a/0",
        "b/0",
        rng.normal(0, 1, 3),
        "ambiguous",
        0.4,
        Reason.words("two places look alike"),
        Evidence(common=3.5),
        RunnerUp(np.array([1.0, 2.0, 3.0]), evidence=Evidence(common=3.0)),
    )
    return JointMap(version, (component,), (alignment,))


@pytest.fixture(scope="session")
def random_map() -> Callable[..., RobotMap]:
    """Return the maker of robot maps: `random_map(seed, submaps, robot=, boot=, version=)`."""
    return make_random_map


@pytest.fixture(scope="session")
def random_joint() -> Callable[..., JointMap]:
    """Return the maker of joint maps: `random_joint(seed, version)`."""
    return make_random_joint


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextmanager
def _router() -> Iterator[str]:
    endpoint = f"tcp/127.0.0.1:{_free_port()}"
    with subprocess.Popen(
        [sys.executable, "-c", ROUTER, endpoint],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdin is not None and process.stdout is not None
        assert process.stdout.readline() == "listening\n"
        yield endpoint
        process.stdin.close()


@pytest.fixture(scope="session")
def endpoint() -> Iterator[str]:
    """Return where a router process listens."""
    with _router() as listening:
        yield listening


@pytest.fixture
def team() -> str:
    """Return the name of a team of this test's own."""
    return f"t{secrets.token_hex(4)}"
