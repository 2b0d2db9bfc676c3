"""Over a real router: who has no keys is not let in, and who has some writes only what is his."""

from __future__ import annotations

import shutil
import time
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

import pytest
import zenoh

from mapweave_deploy.keys.authority import Authority
from mapweave_deploy.keys.team_keys import make_keys
from mapweave_protocol.errors import NotEncryptedError, UnreachableError
from mapweave_protocol.link.inbox import Inbox
from mapweave_protocol.link.security.folder import KeyFolder
from mapweave_protocol.link.security.roster import Member, Role
from mapweave_protocol.link.security.settings import LinkSettings
from mapweave_protocol.link.session import (
    declare_map_publisher,
    declare_subscriber,
    open_session,
)
from mapweave_protocol.wire import keys
from tests.deploy.keys.conftest import PATIENCE, ROSTER, keys_of

if TYPE_CHECKING:
    from pathlib import Path

    from tests.deploy.keys.conftest import Connect, Router

TEAM = ROSTER.team
MAP_1, MAP_2 = (keys.MAP.build(team=TEAM, robot=robot) for robot in ("r1", "r2"))
JOINT, QUERY = keys.JOINT_MAP.build(team=TEAM), keys.JOINT_QUERY.build(team=TEAM)
SHORT = 1.5  # [s] for those who are not let in


def _heard(inbox: Inbox, until: str) -> list[str]:
    """Return the keys of what arrives, up to that of the last one."""
    heard: list[str] = []
    while until not in heard:
        arrival = inbox.get(PATIENCE)
        assert arrival is not None, heard
        heard.append(arrival.key)
    return heard


def _listen(session: zenoh.Session) -> tuple[Inbox, object]:
    inbox = Inbox()
    return inbox, session.declare_subscriber(keys.everything(TEAM), inbox.put)


def test_each_member_writes_what_is_its_own_and_everybody_reads_it(connect: Connect) -> None:
    coordinator = connect(Role.COORDINATOR)
    inbox, _subscriber = _listen(connect(Role.VIEWER, "bob"))
    for session, key in (
        (connect(Role.ROBOT, "r1"), MAP_1),
        (connect(Role.ROBOT, "r2"), keys.STATUS.build(team=TEAM, robot="r2")),
        (connect(Role.OPERATOR, "ann"), keys.ORDER.build(team=TEAM, name="ann", order="pin")),
        (connect(Role.OPERATOR, "eve"), MAP_2),
        (coordinator, JOINT),
    ):
        _put_until_heard(session, inbox, key)
    with coordinator.declare_queryable(QUERY, lambda query: query.reply(QUERY, b"answer")):
        assert _answers(connect(Role.VIEWER, "bob")) == [b"answer"]


def _put_until_heard(session: zenoh.Session, inbox: Inbox, key: str) -> None:
    """Put until it comes: a subscription takes a moment to reach the other side."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        session.put(key, b"")
        arrival = inbox.get(0.2)
        if arrival is not None and arrival.key == key:
            return
    raise AssertionError(f"{key} never came")


def _answers(session: zenoh.Session) -> list[bytes]:
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        answers = [reply.ok.payload.to_bytes() for reply in session.get(QUERY) if reply.ok]
        if answers:
            return answers
        time.sleep(0.1)
    return []


FORGED = [
    (Role.ROBOT, "r1", MAP_2),
    (Role.ROBOT, "r1", keys.STATUS.build(team=TEAM, robot="r2")),
    (Role.ROBOT, "r1", keys.ALIGNMENT.build(team=TEAM, robot="r2", reference="r1", other="r2")),
    (Role.ROBOT, "r1", JOINT),
    (Role.ROBOT, "r1", keys.JOINT_STATUS.build(team=TEAM)),
    (Role.ROBOT, "r1", f"{JOINT}/@adv/pub/forged"),
    (Role.ROBOT, "r1", MAP_1.replace("/agent/r1/map", "/operator/ann/pin")),
    (Role.ROBOT, "r1", keys.MAP.pattern(team=TEAM)),
    (Role.VIEWER, "bob", MAP_1),
    (Role.VIEWER, "bob", JOINT),
    (Role.OPERATOR, "ann", keys.POSE.build(team=TEAM, robot="r2")),
    (Role.OPERATOR, "ann", MAP_1.replace("/agent/r1/map", "/operator/eve/pin")),
    (Role.OPERATOR, "ann", JOINT),
]


def test_nobody_writes_what_is_another_s(connect: Connect) -> None:
    r1 = connect(Role.ROBOT, "r1")
    inbox, _subscriber = _listen(connect(Role.COORDINATOR))
    _put_until_heard(r1, inbox, MAP_1)
    sessions = {
        (role, name): r1 if name == "r1" else connect(role, name) for role, name, _ in FORGED
    }
    for role, name, key in FORGED:
        sessions[role, name].put(key, b"forged")
        sessions[role, name].delete(key)
    time.sleep(0.5)  # of sessions that may write nothing, nothing tells that it was refused
    for number in range(3):
        r1.put(keys.POSE.build(team=TEAM, robot="r1"), str(number).encode())
    heard = _heard(inbox, keys.POSE.build(team=TEAM, robot="r1"))
    assert set(heard) <= {MAP_1, keys.POSE.build(team=TEAM, robot="r1")}


def test_nobody_answers_or_is_present_as_another(connect: Connect) -> None:
    r1, coordinator = connect(Role.ROBOT, "r1"), connect(Role.COORDINATOR)
    live = coordinator.liveliness()
    own = keys.LIVE.build(team=TEAM, robot="r1", boot="x")
    tokens = [
        r1.liveliness().declare_token(key)
        for key in (
            keys.LIVE.build(team=TEAM, robot="r2", boot="x"),
            keys.COORDINATOR_LIVE.build(team=TEAM, boot="x"),
            own,
        )
    ]
    with r1.declare_queryable(QUERY, lambda query: query.reply(QUERY, b"forged")):
        present: list[str] = []
        deadline = time.monotonic() + PATIENCE
        while own not in present and time.monotonic() < deadline:
            present = [str(r.ok.key_expr) for r in live.get(keys.everything(TEAM)) if r.ok]
        assert present == [own]
        assert [reply.ok for reply in connect(Role.VIEWER, "bob").get(QUERY) if reply.ok] == []
    assert len(tokens) == 3


def test_who_has_no_keys_is_not_let_in(router: Router) -> None:
    nobody = LinkSettings()
    for endpoint in (router.endpoint, router.endpoint.replace("tls/", "tcp/")):
        with (
            pytest.raises(UnreachableError) as told,
            open_session([endpoint], patience=SHORT, link=nobody),
        ):
            pass
        assert "lets us in" in str(told.value)


def test_keys_are_not_used_over_what_is_not_encrypted(router: Router, team_keys: Path) -> None:
    link = keys_of(team_keys, Role.ROBOT, "r1")
    plain = router.endpoint.replace("tls/", "tcp/")
    with pytest.raises(NotEncryptedError, match="tls/"), open_session([plain], link=link):
        pass


def test_who_has_keys_of_another_authority_is_told_so(
    router: Router, tmp_path: Path, team_keys: Path
) -> None:
    list(make_keys(ROSTER, tmp_path, datetime.now(UTC), 30, []))
    foreign = keys_of(tmp_path, Role.ROBOT, "r1")
    with (
        pytest.raises(UnreachableError, match="is not to be trusted"),
        open_session([router.endpoint], patience=SHORT, link=foreign),
    ):
        pass
    assert foreign.keys is not None
    shutil.copy(team_keys / "ca.pem", foreign.keys.path / "ca.pem")  # trusts, but is not trusted
    with (
        pytest.raises(UnreachableError, match="does not take our certificate"),
        open_session([router.endpoint], patience=SHORT, link=foreign),
    ):
        pass


def test_a_certificate_that_has_expired_does_not_let_in(
    router: Router, tmp_path: Path, team_keys: Path
) -> None:
    folder = tmp_path / "r1"
    shutil.copytree(team_keys / "robots" / "r1", folder)
    before = datetime.now(UTC) - timedelta(days=40)
    Authority.read(team_keys).issue(Member(TEAM, Role.ROBOT, "r1"), folder, before, 30)
    link = LinkSettings(KeyFolder.read(folder))
    with (
        pytest.raises(UnreachableError, match="does not take our certificate"),
        open_session([router.endpoint], patience=SHORT, link=link),
    ):
        pass


def test_a_member_that_is_not_on_the_router_s_roster_may_do_nothing(
    connect: Connect, router: Router, tmp_path: Path, team_keys: Path
) -> None:
    folder = tmp_path / "r9"
    shutil.copytree(team_keys / "robots" / "r1", folder)
    Authority.read(team_keys).issue(Member(TEAM, Role.ROBOT, "r9"), folder, datetime.now(UTC), 30)
    r1 = connect(Role.ROBOT, "r1")
    inbox, _subscriber = _listen(connect(Role.COORDINATOR))
    _put_until_heard(r1, inbox, MAP_1)
    link = LinkSettings(KeyFolder.read(folder))
    with open_session([router.endpoint], patience=PATIENCE, link=link) as stranger:
        stranger.put(keys.MAP.build(team=TEAM, robot="r9"), b"forged")
        stranger.put(MAP_1, b"forged")
        time.sleep(0.5)
        r1.put(keys.POSE.build(team=TEAM, robot="r1"), b"")
        heard = _heard(inbox, keys.POSE.build(team=TEAM, robot="r1"))
    assert set(heard) <= {MAP_1, keys.POSE.build(team=TEAM, robot="r1")}


def test_what_was_published_during_an_outage_comes_under_the_rules_too(
    connect: Connect, router: Router
) -> None:
    r1, coordinator = connect(Role.ROBOT, "r1"), connect(Role.COORDINATOR)
    inbox = Inbox()
    with (
        declare_map_publisher(r1, MAP_1) as publisher,
        declare_subscriber(coordinator, keys.MAP.pattern(team=TEAM), inbox.put, history=64),
    ):
        publisher.put(b"before")
        assert _payloads(inbox, 1) == [b"before"]
        router.stop()
        for number in range(3):
            publisher.put(f"during {number}".encode())
        router.start()
        assert _payloads(inbox, 3) == [f"during {number}".encode() for number in range(3)]
        with open_late(connect) as late:
            found = Inbox()
            with declare_subscriber(late, keys.MAP.pattern(team=TEAM), found.put, history=64):
                assert len(_payloads(found, 4)) == 4, "who comes late gets the history"


def open_late(connect: Connect) -> zenoh.Session:
    """Return a session of somebody who may read."""
    return connect(Role.VIEWER, "bob")


def _payloads(inbox: Inbox, count: int) -> list[bytes]:
    found = [inbox.get(PATIENCE) for _ in range(count)]
    return [arrival.payload for arrival in found if arrival is not None]


def test_messages_larger_than_their_kind_are_not_passed_on(connect: Connect) -> None:
    r1 = connect(Role.ROBOT, "r1")
    inbox, _subscriber = _listen(connect(Role.COORDINATOR))
    pose = keys.POSE.build(team=TEAM, robot="r1")
    _put_until_heard(r1, inbox, pose)
    for key in (pose, MAP_1):
        r1.put(key, bytes(100_000), congestion_control=zenoh.CongestionControl.BLOCK)
    while (arrival := inbox.get(PATIENCE)) is not None and arrival.key != MAP_1:
        assert len(arrival.payload) < 100_000
    assert arrival is not None
