"""Links that bring nothing any more, and sockets of real sessions at a real router."""

import time
from collections.abc import Callable

import pytest
import zenoh

from mapweave_protocol.link.guard import deaf_link
from mapweave_protocol.link.session import open_session

PATIENCE = 20.0  # [s] for what takes milliseconds on a quiet machine


def wait_for(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def links_of(session: zenoh.Session) -> list[str]:
    return [link.src for link in session.info.links()]


def test_a_link_that_was_cut_is_opened_anew_and_brings_what_was_subscribed(
    endpoint: str, team: str
) -> None:
    heard: list[bytes] = []
    with open_session([endpoint]) as session, open_session([endpoint]) as other:
        with session.declare_subscriber(team, lambda sample: heard.append(bytes(sample.payload))):
            before, of_other = links_of(session), links_of(other)
            deaf_link.cut_links(session)
            wait_for(lambda: links_of(session) not in ([], before))
            while b"after" not in heard:
                other.put(team, b"after")
                time.sleep(0.01)
        assert links_of(other) == of_other, "the link of another session was cut"


def test_a_link_that_brings_something_is_told_from_one_that_brings_nothing(
    endpoint: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with open_session([endpoint]) as session:
        assert deaf_link.answers(session)
        # A router that strikes a client out of its books is not to be had at will: who waits for
        # no answer at all sees the same.
        monkeypatch.setattr(deaf_link, "ANSWER_WITHIN", 0.0)
        assert not deaf_link.answers(session)


def test_a_link_that_was_opened_again_is_cut_until_it_brings_something(
    endpoint: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    looks: list[list[str]] = []

    def answers(session: zenoh.Session) -> bool:
        looks.append(links_of(session))
        return len(looks) > deaf_link.TRIES

    monkeypatch.setattr(deaf_link, "answers", answers)
    with (
        open_session([endpoint]) as session,
        deaf_link.mending_deaf_links(session, looked_at_after=(0.0,)),
    ):
        deaf_link.cut_links(session)  # as when the network was away
        wait_for(lambda: len(looks) > deaf_link.TRIES)
        deaf, anew = looks[deaf_link.TRIES - 1], looks[deaf_link.TRIES]
        assert deaf != anew
