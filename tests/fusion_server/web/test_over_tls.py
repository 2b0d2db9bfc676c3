"""The page for other machines: members of the team look, operators order, nobody else is heard."""

import http.client
import json
import re
import shutil
import socket
import ssl
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import IO, Any
from unittest.mock import Mock

import pytest
from playwright.sync_api import expect

from mapweave.cli import main
from mapweave.config import Config
from mapweave.errors import FileError
from mapweave_deploy.keys.authority import Authority
from mapweave_deploy.keys.team_keys import make_keys
from mapweave_fusion_server.store import Store
from mapweave_fusion_server.web.access.door import MAX_WAITING
from mapweave_fusion_server.web.address import HttpAddress, with_keys
from mapweave_fusion_server.web.feed import Feed
from mapweave_fusion_server.web.server import live_page
from mapweave_protocol.link.security.folder import KeyFolder, place_of
from mapweave_protocol.link.security.roster import Member, Role, Roster
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import JointMapMessage
from tests.fusion_server.web.browser import Visit, chromium
from tests.fusion_server.web.conftest import PATIENCE, TOKEN, Answer, MakeMap, make_joint

ROSTER = Roster("rescue", ("r1",), ("ann", "eve"), ("bob",))
ANN, BOB, R1 = (
    Member("rescue", role, name)
    for role, name in ((Role.OPERATOR, "ann"), (Role.VIEWER, "bob"), (Role.ROBOT, "r1"))
)
BAN = {"kind": "forbid", "reference": "a/0", "other": "b/0", "by": "ann", "reason": "two floors"}


@dataclass(frozen=True)
class SecurePage:
    """A page that others reach, and the keys of those who may."""

    address: HttpAddress
    feed: Feed
    store: Store
    keys: Path

    def context(self, folder: Path) -> ssl.SSLContext:
        """Return what a browser with the certificate in `folder` does."""
        context = ssl.create_default_context(cafile=self.keys / "ca.pem")
        context.load_cert_chain(folder / "cert.pem", folder / "key.pem")
        return context

    def ask(
        self,
        path: str,
        who: Member | Path | None,
        order: Mapping[str, Any] | None = None,
        **headers: str,
    ) -> Answer:
        """Return what the server answers to who shows this certificate."""
        folder = self.keys / place_of(who) if isinstance(who, Member) else who
        context = ssl.create_default_context(cafile=self.keys / "ca.pem")
        if folder is not None:
            context = self.context(folder)
        connection = http.client.HTTPSConnection(
            "127.0.0.1", self.address.port, timeout=PATIENCE, context=context
        )
        usual = {"Content-Type": "application/json"} if order is not None else {}
        try:
            connection.request(
                "GET" if order is None else "POST",
                path,
                None if order is None else json.dumps(order).encode(),
                usual | headers,
            )
            answer = connection.getresponse()
            return Answer(answer.status, answer.headers, answer.read())
        finally:
            connection.close()


@pytest.fixture(scope="module")
def team_keys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("keys")
    list(make_keys(ROSTER, folder, datetime.now(UTC), 30, [], ["127.0.0.1", "base.local"]))
    return folder


@pytest.fixture
def page(team_keys: Path, tmp_path: Path, make_map: MakeMap) -> Iterator[SecurePage]:
    """Serve a version of robots a and b on all addresses of this machine."""
    feed = Feed()
    address = with_keys(HttpAddress("0.0.0.0", 0), KeyFolder.read(team_keys / "coordinator"))
    with (
        Store(tmp_path / "store.sqlite", "rescue") as store,
        live_page(address, "rescue", store, Config(), feed, TOKEN) as bound,
    ):
        feed.show_version(0, (make_map("a"), make_map("b")))
        yield SecurePage(bound, feed, store, team_keys)


@pytest.mark.parametrize("who", [ANN, BOB, R1], ids=lambda who: who.name)
def test_who_is_of_the_team_may_look(page: SecurePage, who: Member) -> None:
    assert page.ask("/api/robots", who).status == 200
    assert b"mapweave_version 0.0" in page.ask("/metrics", who).body
    assert page.ask("/api/me", who).json == {"operator": "ann" if who == ANN else None}


def test_who_shows_no_certificate_of_the_team_is_not_heard(
    page: SecurePage, tmp_path: Path
) -> None:
    list(make_keys(ROSTER, tmp_path / "foreign", datetime.now(UTC), 30, []))
    expired = tmp_path / "expired"
    shutil.copytree(page.keys / "viewers" / "bob", expired)
    before = datetime.now(UTC) - timedelta(days=40)
    Authority.read(page.keys).issue(BOB, expired, before, 30)
    for folder in (None, tmp_path / "foreign" / "viewers" / "bob", expired):
        with pytest.raises((ssl.SSLError, ConnectionError)):
            page.ask("/api/robots", folder)
    plain = http.client.HTTPConnection("127.0.0.1", page.address.port, timeout=PATIENCE)
    with pytest.raises((http.client.HTTPException, ConnectionError)):
        plain.request("GET", "/api/robots")
        plain.getresponse()
    plain.close()
    assert page.ask("/healthz", BOB).status in (200, 503), "and the others are served as before"


def test_who_was_taken_from_the_roster_is_told_so(page: SecurePage, tmp_path: Path) -> None:
    former = tmp_path / "zoe"
    shutil.copytree(page.keys / "viewers" / "bob", former)
    zoe = Member("rescue", Role.VIEWER, "zoe")
    Authority.read(page.keys).issue(zoe, former, datetime.now(UTC), 30)
    answer = page.ask("/api/robots", former)
    assert answer.status == 403
    assert b"rescue.viewer.zoe is nobody of team rescue" in answer.body


def test_operators_order_in_their_own_name_and_nobody_else_does(page: SecurePage) -> None:
    for who, order, status in (
        (BOB, BAN, 403),
        (R1, BAN, 403),
        (ANN, {**BAN, "by": "eve"}, 403),
        (ANN, BAN, 202),
    ):
        assert page.ask("/api/orders", who, order).status == status, (who, order)
    # The token of a page of this machine is worth nothing here.
    assert page.ask("/api/orders", BOB, BAN, **{"X-Mapweave-Token": TOKEN}).status == 403
    [given] = page.feed.orders()
    assert given.by == "ann"


def test_a_page_of_another_site_orders_nothing_with_an_operator_s_certificate(
    page: SecurePage,
) -> None:
    port = page.address.port
    for headers in (
        {"Origin": "https://evil.example"},
        {"Origin": f"http://127.0.0.1:{port}"},
        {"Host": "evil.example"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Content-Type": "text/plain"},
    ):
        assert page.ask("/api/orders", ANN, BAN, **headers).status in (403, 415), headers
    assert page.feed.orders() == []
    for name in (f"127.0.0.1:{port}", f"base.local:{port}"):
        headers = {"Host": name, "Origin": f"https://{name}"}
        assert page.ask("/api/orders", ANN, BAN, **headers).status == 202


def test_an_operator_s_browser_gives_an_order_in_the_name_of_its_certificate(
    page: SecurePage, make_map: MakeMap
) -> None:
    joint = make_joint(1, make_map("a").lines(0), a=0.0, b=3.0)
    page.store.add_version(1, 1000.0, encode(JointMapMessage.pack(joint, page.store.series)))
    page.feed.show_version(1, (make_map("a"), make_map("b")))
    origin, folder = page.address.url().rstrip("/"), page.keys / place_of(ANN)
    shown = {"origin": origin, "certPath": folder / "cert.pem", "keyPath": folder / "key.pem"}
    with chromium() as browser:
        context = browser.new_context(
            ignore_https_errors=True,  # nobody gave this browser the team's authority
            client_certificates=[shown],  # type: ignore[list-item]
        )
        seen = Visit(context.new_page())
        seen.tab.goto(page.address.url())
        seen.tab.locator("#decisions button.decision").first.click()
        seen.tab.get_by_role("button", name="Forbid this join…").click()
        expect(seen.tab.locator("#order-name")).to_have_value("ann")
        expect(seen.tab.locator("#order-name")).not_to_be_editable()
        seen.tab.locator("#order-reason").fill("two floors")
        seen.tab.locator("#order-confirm").click()
        expect(seen.tab.locator("#order")).to_be_hidden()
        context.close()
    assert [order.by for order in page.feed.orders()] == ["ann"]


def test_who_is_refused_is_counted_and_told_with_the_reason(
    page: SecurePage, caplog: pytest.LogCaptureFixture
) -> None:
    with pytest.raises((ssl.SSLError, ConnectionError)):
        page.ask("/api/robots", None)
    assert page.ask("/api/orders", BOB, BAN).status == 403
    metrics = page.ask("/metrics", BOB).body.decode()
    for kind in ("connection", "request"):
        assert f'mapweave_refused_total{{kind="{kind}",sender="page"}} 1.0' in metrics
    assert "page: refused, peer did not return a certificate" in caplog.text
    assert "/api/orders: refused, certificate: rescue.viewer.bob gives no orders" in caplog.text


def test_those_who_connect_and_say_nothing_keep_nobody_out_and_are_few(page: SecurePage) -> None:
    before = _descriptors()
    with ExitStack() as stack:
        port = page.address.port
        for _ in range(3 * MAX_WAITING):
            stack.enter_context(socket.create_connection(("127.0.0.1", port), PATIENCE))
        assert page.ask("/api/me", ANN).json == {"operator": "ann"}
        held = _descriptors() - before - 3 * MAX_WAITING
    assert held <= 2 * MAX_WAITING
    told = re.search(r'kind="connection",sender="page"} (\d+)', str(page.ask("/metrics", BOB).body))
    assert told is not None
    assert int(told[1]) >= 2 * MAX_WAITING


def _descriptors() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


def test_keys_that_are_damaged_end_in_one_line(team_keys: Path, tmp_path: Path) -> None:
    folder = tmp_path / "coordinator"
    shutil.copytree(team_keys / "coordinator", folder)
    (folder / "cert.pem").write_text("no certificate")
    address = with_keys(HttpAddress("0.0.0.0", 0), KeyFolder.read(folder))
    with (
        Store(tmp_path / "store.sqlite", "rescue") as store,
        pytest.raises(FileError, match="no keys that can be used") as told,
        live_page(address, "rescue", store, Config(), Feed(), TOKEN),
    ):
        pass
    assert "\n" not in str(told.value)


def test_without_keys_a_coordinator_is_not_served_to_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    store = tmp_path / "store"
    assert main(["server", "--store", str(store), "--http", "0.0.0.0:0"]) == 1
    [line] = capsys.readouterr().err.splitlines()
    assert line.startswith("mapweave: --http: 0.0.0.0:0: others reach it")
    assert "--tls DIR" in line
    assert not store.exists()


@contextmanager
def _running(*commands: Sequence[str | Path]) -> Iterator[list[IO[str]]]:
    """Run commands of mapweave, and give what each says; all end well in the end."""
    program = Path(sys.executable).with_name("mapweave")
    with ExitStack() as stack:
        processes = [
            stack.enter_context(
                subprocess.Popen([program, *words], stderr=subprocess.PIPE, text=True)
            )
            for words in commands
        ]
        try:
            yield [process.stderr for process in processes if process.stderr is not None]
        finally:
            for process in processes:
                process.terminate()
                process.communicate(timeout=PATIENCE)
        assert [process.returncode for process in processes] == [0] * len(processes)


def test_a_coordinator_over_tls_serves_its_page_to_the_team(
    team_keys: Path, tmp_path: Path
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as first, socket.create_server(("", 0)) as second:
        wire, port = (each.getsockname()[1] for each in (first, second))
    router = ["router", "--listen", f"tls/127.0.0.1:{wire}", "--tls", str(team_keys / "router")]
    server = ["server", "--team", "rescue", "--connect", f"tls/127.0.0.1:{wire}"]
    server += ["--store", str(tmp_path / "store.sqlite"), "--http", f"0.0.0.0:{port}"]
    with _running(router, [*server, "--tls", str(team_keys / "coordinator")]) as (_, said):
        told = next(line for line in said if "live page: " in line)
        assert told.split("live page: ")[1].strip() == f"https://127.0.0.1:{port}/"
        assert any("coordinating team rescue" in line for line in said)
        page = SecurePage(HttpAddress("127.0.0.1", port), Feed(), Mock(), team_keys)
        assert page.ask("/healthz", BOB).body == b"alive\n"
        with pytest.raises((ssl.SSLError, ConnectionError)):
            page.ask("/healthz", None)
