"""The router as a process."""

import signal
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest
import zenoh

from mapweave_deploy.run.launcher import free_endpoint
from mapweave_deploy.run.router import cause_of
from mapweave_deploy.run.router import command as router
from mapweave_protocol.link.session import open_session

PROGRAM = [sys.executable, "-c", "import sys; from mapweave.cli import main; sys.exit(main())"]


@pytest.fixture
def endpoint() -> Iterator[str]:
    """Return where a router listens."""
    listen = free_endpoint()
    command = [*PROGRAM, "router", "--listen", listen]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert "listening" in process.stderr.readline()
        yield listen
        process.terminate()
        assert process.wait(10) == 0


def test_a_message_of_one_client_reaches_another(endpoint: str) -> None:
    with open_session([endpoint], patience=10) as one, open_session([endpoint]) as other:
        queryable = one.declare_queryable("test/echo", lambda query: query.reply("test/echo", b"x"))
        assert answers(other) == [b"x"]
        del queryable


def answers(session: zenoh.Session) -> list[bytes]:
    """Ask until somebody answers: it takes a moment until the router knows who would."""
    deadline = time.monotonic() + 10
    found: list[bytes] = []
    while not found and time.monotonic() < deadline:
        replies = list(session.get("test/echo", timeout=10))
        found = [reply.ok.payload.to_bytes() for reply in replies if reply.ok]
    return found


def test_a_port_in_use_ends_in_one_line_and_status_1(endpoint: str) -> None:
    second = subprocess.run(
        [*PROGRAM, "router", "--listen", endpoint], capture_output=True, text=True, check=False
    )
    assert second.returncode == 1
    assert (
        second.stderr == f"mapweave: router: cannot listen at {endpoint} (Address already in use)\n"
    )


def test_the_example_in_its_help_does_listen() -> None:
    listen = free_endpoint().replace("127.0.0.1", "0.0.0.0")
    words = router.example.replace("tcp/0.0.0.0:7447", listen).split()
    assert listen in words
    with subprocess.Popen([*PROGRAM, "router", *words], stderr=subprocess.PIPE, text=True) as run:
        assert run.stderr is not None
        said = run.stderr.readline()
        run.terminate()
    assert "listening" in said


def test_ctrl_c_ends_a_router_with_status_0() -> None:
    command = [*PROGRAM, "router", "--listen", free_endpoint()]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        process.stderr.readline()
        process.send_signal(signal.SIGINT)
        assert process.wait(10) == 0


def test_of_zenohs_long_message_the_operating_systems_part_is_told() -> None:
    text = "Can not create x: [10.0.0.1:7: Cannot assign requested address (os error 99) at /a.rs]"
    assert cause_of(text) == "Cannot assign requested address"
    assert cause_of("something else\nmore") == "something else"
