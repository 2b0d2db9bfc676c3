"""An agent tells when its router is away, and when it is back: each once."""

from typing import cast
from unittest.mock import Mock

import zenoh

from mapweave_agent.live.joining import GRACE, LOOK, LinkNews

AWAY = "no router is reached any more: maps by itself until one is"
BACK = "the router is reached again"


def told(*linked: bool) -> list[str]:
    """Return what is told where the router is there, or not, for some seconds each."""
    said: list[str] = []
    news, session, now = LinkNews(said.append, said.append), Mock(), 100.0
    for there in linked:
        session.info.routers_zid.return_value = ["router"] if there else []
        until = now + 2 * GRACE
        while now < until:
            news.look(cast(zenoh.Session, session), now)
            now += LOOK / 5
    return said


def test_a_router_that_is_there_is_no_news() -> None:
    assert told(True, True) == []


def test_each_outage_and_its_end_is_told_once() -> None:
    assert told(True, False, False, True, False) == [AWAY, BACK, AWAY]


def test_before_there_is_a_session_nothing_is_told() -> None:
    said: list[str] = []
    LinkNews(said.append, said.append).look(None, 100.0)
    assert not said
