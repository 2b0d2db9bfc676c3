"""Logs of simulated robots, and a router process."""

import secrets
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from mapweave_deploy.sim.simulation import simulate

PATIENCE = 20.0  # [s]


@pytest.fixture(scope="session")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Return the logs of two robots in the same rescue arena."""
    robots = simulate("arena", 2, 1, tmp_path_factory.mktemp("logs"))
    return [robot.log for robot in robots]


def _listens(port: int) -> bool:
    with closing(socket.socket()) as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


@pytest.fixture(scope="session")
def endpoint() -> Iterator[str]:
    """Return where a router process listens."""
    with closing(socket.socket()) as probe:
        probe.bind(("127.0.0.1", 0))
        port = int(probe.getsockname()[1])
    address = f"tcp/127.0.0.1:{port}"
    mapweave = Path(sys.executable).with_name("mapweave")
    with subprocess.Popen([mapweave, "router", "--listen", address]) as router:
        deadline = time.monotonic() + PATIENCE
        while not _listens(port):
            assert router.poll() is None and time.monotonic() < deadline
            time.sleep(0.02)
        yield address
        router.terminate()


@pytest.fixture
def team() -> str:
    """Return the name of a team of this test's own."""
    return f"t{secrets.token_hex(4)}"


@pytest.fixture(autouse=True)
def _no_earlier_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have agents keep their runs in a folder of the test's own."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
