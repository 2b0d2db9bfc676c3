"""A team's keys, a router that asks for them, and sessions of its members."""

import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeAlias

import pytest
import zenoh

from mapweave_deploy.keys.team_keys import make_keys
from mapweave_protocol.link.security.folder import KeyFolder, place_of
from mapweave_protocol.link.security.roster import Member, Role, Roster
from mapweave_protocol.link.security.settings import LinkSettings
from mapweave_protocol.link.session import open_session

MAPWEAVE = Path(sys.executable).with_name("mapweave")
PATIENCE = 30.0  # [s] for what takes a fraction of a second on a quiet machine
ROSTER = Roster("rescue", ("r1", "r2"), ("ann", "eve"), ("bob",))

Connect: TypeAlias = Callable[..., zenoh.Session]


def keys_of(folder: Path, role: Role, name: str) -> LinkSettings:
    """Return the keys of a member, out of all of the team's."""
    return LinkSettings(KeyFolder.read(folder / place_of(Member(ROSTER.team, role, name))))


@pytest.fixture(scope="session")
def team_keys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the team's keys."""
    folder = tmp_path_factory.mktemp("keys")
    assert set(make_keys(ROSTER, folder, datetime.now(UTC), 30, [])) == {
        member.name for member in ROSTER.members
    }
    return folder


class Router:
    """A router process that lets in who has the team's keys."""

    def __init__(self, keys: Path) -> None:
        with socket.create_server(("127.0.0.1", 0)) as probe:
            self.endpoint = f"tls/127.0.0.1:{probe.getsockname()[1]}"
        self._keys = keys
        self.start()

    def start(self) -> None:
        """Start it, again, where it was."""
        self._process = subprocess.Popen(
            [MAPWEAVE, "router", "--listen", self.endpoint, "--tls", self._keys / "router"],
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self._process.stderr is not None
        assert "listening" in self._process.stderr.readline()

    def stop(self) -> None:
        """End it."""
        self._process.terminate()
        self._process.wait(PATIENCE)
        assert self._process.stderr is not None
        self._process.stderr.close()


@pytest.fixture
def router(team_keys: Path) -> Iterator[Router]:
    """Return a router of the test's own."""
    running = Router(team_keys)
    yield running
    running.stop()


@pytest.fixture
def connect(router: Router, team_keys: Path) -> Iterator[Connect]:
    """Return what opens a session of a member: `connect(Role.ROBOT, "r1")`."""
    with ExitStack() as stack:

        def open_one(role: Role, name: str | None = None) -> zenoh.Session:
            link = keys_of(team_keys, role, name or role.value)
            return stack.enter_context(
                open_session([router.endpoint], patience=PATIENCE, link=link)
            )

        yield open_one
