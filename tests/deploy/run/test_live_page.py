"""A whole team with its live page: from the first scan until somebody has seen enough."""

import json
import os
import pty
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.fusion_server.web.browser import chromium, visit

pytestmark = pytest.mark.slow
MAPWEAVE = Path(sys.executable).with_name("mapweave")
PATIENCE = 300.0  # [s] for a team of two on a busy machine
STAYS = "Ctrl-C ends them"


class Terminal:
    """A team at a terminal, and what it has written there."""

    def __init__(self, process: "subprocess.Popen[bytes]", screen: int) -> None:
        self.process = process
        self.text = ""
        self._screen = screen

    def wait_for(self, pattern: str) -> re.Match[str]:
        """Return where it has written `pattern`, as soon as it has."""
        deadline = time.monotonic() + PATIENCE
        while (match := re.search(pattern, self.text)) is None:
            assert time.monotonic() < deadline, self.text
            self.text += os.read(self._screen, 4096).decode(errors="replace")
        return match


@contextmanager
def team_at_a_terminal(folder: Path) -> Iterator[Terminal]:
    """Run a team as somebody does at a terminal."""
    screen, terminal = pty.openpty()
    process = subprocess.Popen(
        arguments(folder),
        stdin=terminal,
        stdout=terminal,
        stderr=terminal,
        env={**os.environ, "COLUMNS": "200", "TERM": "dumb"},
    )
    os.close(terminal)
    try:
        yield Terminal(process, screen)
    finally:
        process.kill()
        process.wait()
        os.close(screen)


def arguments(folder: Path) -> list[str]:
    team = ["team", "--world", "arena", "--robots", "2", "--output", str(folder)]
    return [str(MAPWEAVE), *team, "--http", "127.0.0.1:0"]


def test_the_page_shows_the_map_that_is_written_and_stays_until_ctrl_c(tmp_path: Path) -> None:
    with team_at_a_terminal(tmp_path) as team, chromium() as browser:
        url = team.wait_for(r"Live page: (http://127\.0\.0\.1:\d+/#token=\w+)")[1]
        with visit(browser, url) as seen:
            expect(seen.tab.locator("#headline")).to_contain_text(
                "2 robots in", timeout=1000 * PATIENCE
            )
            team.wait_for(STAYS)
            joint = json.loads((tmp_path / "joint.json").read_text())
            expect(seen.tab.locator("#map")).to_have_attribute(
                "data-version", str(joint["version"])
            )
            expect(seen.tab.locator("#live")).to_have_text("live")
            count = len(joint["components"])
            expect(seen.tab.locator("#headline")).to_contain_text(
                f"2 robots in {count} component{'s' if count > 1 else ''}"
            )
            walls = sum(len(p) for c in joint["components"] for p in c["polylines"])
            expect(seen.tab.locator("#sure")).to_contain_text(f"of {walls} walls")
        assert team.process.poll() is None
        team.process.send_signal(signal.SIGINT)
        assert team.process.wait(60) == 0


def test_where_nobody_is_there_to_end_it_the_team_ends_by_itself(tmp_path: Path) -> None:
    done = subprocess.run(
        arguments(tmp_path), stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "Live page: http://127.0.0.1:" in done.stdout
    assert STAYS not in done.stdout
