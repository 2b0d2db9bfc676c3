"""Whoever orders hears why nothing comes of it: that nobody answers, or that nobody has the map."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
import zenoh

from mapweave.maps import RobotMap
from mapweave_protocol.link.session import open_session
from mapweave_protocol.operator import delivery
from mapweave_protocol.operator.delivery import OrderError, maps_of, orders_of, runs_of
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import MapMessage, RunsMessage
from mapweave_protocol.wire.orders.runs_message import WireRun
from mapweave_protocol.wire.queries import JointQuery

MakeMap = Callable[..., RobotMap]
RUNS = encode(RunsMessage(runs=(WireRun(robot="r1", boot="x", last=0),)))


@pytest.fixture
def session(endpoint: str) -> Iterator[zenoh.Session]:
    """Return a session of the operator's."""
    with open_session([endpoint], patience=20.0) as opened:
        yield opened


@contextmanager
def _coordinator(endpoint: str, team: str, held: bytes, *, deaf_for: int = 0) -> Iterator[None]:
    """Answer with one run and its map; the first so many questions not at all."""
    key, asked = keys.JOINT_QUERY.build(team=team), []

    def answer(query: zenoh.Query) -> None:
        with query:
            asked.append(query)
            wanted = JointQuery.parse(str(query.parameters))
            if len(asked) <= deaf_for:
                return
            if wanted.runs is not None:
                query.reply(key, RUNS)
            elif wanted.robot == "r1":
                query.reply(key, held)
            else:
                query.reply_err(b"no such map")

    with open_session([endpoint]) as session, session.declare_queryable(key, answer):
        yield


def test_where_nobody_answers_that_is_said_and_not_that_there_is_no_map(
    session: zenoh.Session, team: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(delivery, "PATIENCE", 0.5)
    silent = f"no coordinator of team {team} answered within 0.5 s"
    with pytest.raises(OrderError, match=silent):
        orders_of(session, team)
    with pytest.raises(OrderError, match=silent):
        runs_of(session, team)
    with pytest.raises(OrderError, match=silent):
        maps_of(session, team, ["r1"])


def test_a_coordinator_that_answers_a_little_later_is_waited_for(
    session: zenoh.Session, endpoint: str, team: str, random_map: MakeMap
) -> None:
    held = encode(MapMessage.pack(random_map(1, 2, robot="r1")))
    with _coordinator(endpoint, team, held, deaf_for=2):
        assert maps_of(session, team, ["r1"])["r1"].robot == "r1"


def test_of_a_robot_that_does_not_exist_is_said_whose_maps_there_are(
    session: zenoh.Session, endpoint: str, team: str
) -> None:
    unknown = f"no coordinator of team {team} has a map of r7/0; it has maps of r1$"
    with _coordinator(endpoint, team, b""), pytest.raises(OrderError, match=unknown):
        maps_of(session, team, ["r7/0"])
