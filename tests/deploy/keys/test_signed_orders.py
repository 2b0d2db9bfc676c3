"""With keys an order counts if the operator whom it names gave it, whoever passes it on."""

from __future__ import annotations

import subprocess
import sys
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import zenoh

from mapweave.errors import FileError, MissingExtraError
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave.orders import OrderKind
from mapweave_deploy.keys.team_keys import make_keys
from mapweave_protocol.errors import MessageError
from mapweave_protocol.link.asking import ask_orders, ask_runs
from mapweave_protocol.link.assembler import MapSender
from mapweave_protocol.link.security.folder import KeyFolder
from mapweave_protocol.link.security.proof import checking, signing
from mapweave_protocol.link.security.roster import Role
from mapweave_protocol.link.security.settings import LinkSettings
from mapweave_protocol.operator.delivery import deliver
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.codec import decode, encode
from mapweave_protocol.wire.messages import OrderMessage, OrdersMessage, StatusMessage
from mapweave_protocol.wire.orders.order_message import WireEnd, digest_of, taking_back
from tests.deploy.keys.conftest import MAPWEAVE, PATIENCE, ROSTER, keys_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from tests.deploy.keys.conftest import Connect, Router

TEAM = ROSTER.team
A = WireEnd(robot="a", boot="x", component="a/0", submap=0, scan=7)
B = WireEnd(robot="b", boot="0123abcd", component="b/3", submap=4)
KINDS: dict[OrderKind, dict[str, Any]] = {
    OrderKind.MARK: {"ends": (A,), "transform": (1.0, 2.123456789, 0.0), "label": "victim"},
    OrderKind.PIN: {"ends": (A, B), "transform": (1e-7, -2.0, 0.5)},
    OrderKind.FORBID: {"ends": (A, B)},
    OrderKind.FORGET: {"robot": "a", "boots": ("x", "y")},
}


def order(
    kind: OrderKind = OrderKind.FORGET, identity: str = "o1", by: str = "ann"
) -> OrderMessage:
    return OrderMessage(
        id=identity, kind=kind, by=by, time=time.time(), reason="so it is", **KINDS[kind]
    )


@dataclass
class Team:
    """Signs and checks as members do."""

    folder: Path

    def signed(self, given: OrderMessage, role: Role, name: str) -> OrderMessage:
        """Return an order with the signature of a member."""
        return signing(keys_of(self.folder, role, name))(given)

    def check(self, given: OrderMessage) -> None:
        """Check an order as the coordinator does."""
        checking(keys_of(self.folder, Role.COORDINATOR, "coordinator"))(given)


@pytest.fixture
def team(team_keys: Path) -> Team:
    return Team(team_keys)


@pytest.mark.parametrize("kind", KINDS)
def test_what_an_operator_signed_counts_after_it_travelled(team: Team, kind: OrderKind) -> None:
    given = order(kind)
    for one in (given, taking_back(given, "ann", time.time(), "no longer")):
        signed = team.signed(one, Role.OPERATOR, "ann")
        team.check(decode(OrderMessage, encode(signed)))
        [held] = decode(OrdersMessage, encode(OrdersMessage(orders=(signed,)))).orders
        team.check(held)


def test_the_coordinator_signs_what_others_order_on_its_page(team: Team) -> None:
    team.check(team.signed(order(by="somebody"), Role.COORDINATOR, "coordinator"))


@pytest.mark.parametrize(
    ("role", "name"),
    [(Role.ROBOT, "r1"), (Role.VIEWER, "bob"), (Role.OPERATOR, "eve"), (Role.ROUTER, "router")],
)
def test_nobody_signs_for_another(team: Team, role: Role, name: str) -> None:
    with pytest.raises(MessageError, match="signed by somebody else"):
        team.check(team.signed(order(), role, name))


def test_an_order_that_nobody_signed_does_not_count(team: Team) -> None:
    with pytest.raises(MessageError, match="o1 of ann: nobody signed it"):
        team.check(order())


CHANGES: dict[str, Any] = {
    "id": "o2", "kind": OrderKind.MARK, "time": 1e9 + 0.5, "reason": "so it is not",
    "takes_back": "o3", "ends": (A, A), "transform": (1.0, 2.0, 0.6), "label": "x", "robot": "b",
    "boots": ("x",),
}  # fmt: skip


def test_nothing_in_an_order_can_be_changed_by_who_passes_it_on(team: Team) -> None:
    signed = team.signed(order(OrderKind.PIN), Role.OPERATOR, "ann")
    assert set(CHANGES) == set(OrderMessage.model_fields) - {"by", "signature"}
    for name, value in CHANGES.items():
        changed = signed.model_copy(update={name: value})
        with pytest.raises(MessageError, match=r"not what was signed|was not valid"):
            team.check(changed)


def test_an_operator_of_another_team_is_nobody_here(team: Team, tmp_path: Path) -> None:
    """Though the names are the same, to the team's."""
    list(make_keys(ROSTER, tmp_path, datetime.now(UTC), 30, []))
    foreign = Team(tmp_path).signed(order(), Role.OPERATOR, "ann")
    with pytest.raises(MessageError, match="not of this team"):
        team.check(foreign)


@pytest.mark.parametrize("days", [-2, 31])
def test_an_order_counts_that_was_given_while_its_certificate_was_valid(
    team: Team, days: float
) -> None:
    """It is kept for longer than that: what counts is when it was given."""
    early = order().model_copy(update={"time": time.time() + days * 86_400})
    with pytest.raises(MessageError, match="was not valid"):
        team.check(team.signed(early, Role.OPERATOR, "ann"))


def test_without_keys_any_order_counts_and_none_is_signed() -> None:
    given = order()
    assert signing(LinkSettings())(given) is given
    checking(LinkSettings())(given)


def test_a_key_that_cannot_be_used_is_named(team_keys: Path, tmp_path: Path) -> None:
    for path in (team_keys / "operators" / "ann").iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
        (tmp_path / path.name).chmod(0o600)
    (tmp_path / "key.pem").write_text("no key")
    with pytest.raises(FileError, match=r"key\.pem: cannot be used"):
        signing(LinkSettings(KeyFolder.read(tmp_path)))


def test_who_lacks_the_package_is_told_what_to_install(
    team: Team, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "cryptography", None)
    monkeypatch.delitem(sys.modules, "mapweave_protocol.link.security.signatures", raising=False)
    monkeypatch.delattr(sys.modules["mapweave_protocol.link.security"], "signatures", raising=False)
    with pytest.raises(MissingExtraError, match=r"mapweave\[tls\]"):
        team.check(order())


@pytest.fixture
def server(router: Router, team: Team, tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """Return a coordinator's process, under keys."""
    files = ("--store", tmp_path / "store.sqlite", "--tls", team.folder / "coordinator")
    words = ("server", "--team", TEAM, "--connect", router.endpoint, *files)
    process = subprocess.Popen((MAPWEAVE, *words), stderr=subprocess.PIPE, text=True)
    yield process
    process.kill()
    process.communicate(timeout=PATIENCE)


def test_a_coordinator_takes_from_robots_what_operators_signed_and_nothing_else(
    server: subprocess.Popen[str], connect: Connect, team: Team
) -> None:
    true = team.signed(order(), Role.OPERATOR, "ann")
    held = OrdersMessage(
        orders=(
            order(identity="made-up"),
            team.signed(order(identity="own"), Role.ROBOT, "r1"),
            true.model_copy(update={"id": "changed"}),
            true,
        )
    )
    robot, viewer = connect(Role.ROBOT, "r1"), connect(Role.VIEWER, "bob")
    key = keys.AGENT_QUERY.build(team=TEAM, robot="r1")
    with robot.declare_queryable(key, lambda query: _answer(query, key, held)):
        _say(robot, [one.id for one in held.orders], until=lambda: ask_orders(viewer, TEAM, 1))
    assert ask_orders(viewer, TEAM, PATIENCE) == [true]
    later = team.signed(order(identity="later"), Role.OPERATOR, "ann")
    deliver(connect(Role.OPERATOR, "ann"), TEAM, [later])
    assert ask_orders(viewer, TEAM, PATIENCE) == [true, later]
    server.terminate()
    _, said = server.communicate(timeout=PATIENCE)
    assert "made-up of ann: nobody signed it" in said


def test_commands_of_operators_sign(
    server: subprocess.Popen[str], router: Router, connect: Connect, team: Team
) -> None:
    robot, viewer = connect(Role.ROBOT, "r1"), connect(Role.VIEWER, "bob")
    submap = Submap(0, 0, np.zeros(3), LineMap.empty(), Trajectory.empty())
    payload = MapSender().payload(RobotMap("r1", "first", 1, (submap,)))
    deadline = time.monotonic() + PATIENCE
    while not ask_runs(viewer, TEAM, 1) and time.monotonic() < deadline:
        robot.put(keys.MAP.build(team=TEAM, robot="r1"), payload)
    about = ("forget", "r1", "--reason", "fell", "--team", TEAM, "--connect", router.endpoint)
    for words in (about, (*about, "--undo")):
        subprocess.run((MAPWEAVE, *words, "--tls", team.folder / "operators" / "ann"), check=True)
    held = ask_orders(viewer, TEAM, PATIENCE) or []
    assert [one.by for one in held] == ["ann", "ann"]
    for one in held:
        team.check(one)
    assert server.poll() is None


def _answer(query: zenoh.Query, key: str, held: OrdersMessage) -> None:
    if "orders" in str(query.selector.parameters):
        query.reply(key, encode(held))


def _say(robot: zenoh.Session, ids: list[str], until: Callable[[], object]) -> None:
    """Say of r1 that it holds orders, until somebody has taken some."""
    counts = dict.fromkeys(("scans_seen", "scans_placed", "components", "submaps"), 0)
    fields = {"robot": "r1", "boot": "x", "stamp": 0.0, "state": "mapping", "map_version": 0}
    status = StatusMessage.model_validate({**counts, **fields, "orders": digest_of(ids)})
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline and not until():
        robot.put(keys.STATUS.build(team=TEAM, robot="r1"), encode(status))
        time.sleep(0.2)
