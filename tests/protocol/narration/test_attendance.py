"""Who is here is told once and when it has lasted: not that our own link was away for a moment."""

import logging
import time
from dataclasses import dataclass

import pytest

from mapweave_protocol import joint_maps
from mapweave_protocol.errors import UnreachableError
from mapweave_protocol.link.inbox import Arrival
from mapweave_protocol.link.status_schedule import SILENCE
from mapweave_protocol.narration.attendance import ALONE, GRACE
from mapweave_protocol.narration.past import WITHIN, Past
from mapweave_protocol.narration.watch import Watcher, watch
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import JointStatusMessage

R1 = keys.LIVE.build(team="t", robot="r1", boot="b1")
COORDINATOR = keys.COORDINATOR_LIVE.build(team="t", boot="c1")
NEXT_COORDINATOR = keys.COORDINATOR_LIVE.build(team="t", boot="c2")


@dataclass
class Watched:
    """A watcher at a clock that is set by hand [s]."""

    now: float = 0.0

    def __post_init__(self) -> None:
        self._watcher = Watcher("t", clock=lambda: self.now)
        self.look(0.0)

    def comes(self, *tokens: str) -> list[str]:
        """Return what is told of tokens that are seen."""
        return [line for key in tokens for line in self._watcher.tell(Arrival(key, b""))]

    def goes(self, *tokens: str) -> list[str]:
        """Return what is told of tokens that are no longer seen."""
        gone = [Arrival(key, b"", gone=True) for key in tokens]
        return [line for arrival in gone for line in self._watcher.tell(arrival)]

    def speaks(self) -> list[str]:
        """Return what is told of a status of the coordinator."""
        said = JointStatusMessage(boot="c1", stamp=0.0, series="s", version=0, pending=False)
        key = keys.JOINT_STATUS.build(team="t")
        return list(self._watcher.tell(Arrival(key, encode(said))))

    def look(self, seconds: float, *, linked: bool = True) -> list[str]:
        """Return what is told so many seconds later."""
        self.now += seconds
        return list(self._watcher.look(linked=linked))


def test_a_coordinator_that_goes_and_comes_back_is_told_once_each() -> None:
    watched = Watched()
    assert watched.comes(COORDINATOR, COORDINATOR) == ["the coordinator is here"]
    assert watched.goes(COORDINATOR) == []
    assert watched.look(GRACE) == ["the coordinator is gone"]
    assert watched.look(GRACE) == []
    assert watched.comes(COORDINATOR) == ["the coordinator is here again"]


def test_a_coordinator_that_is_restarted_is_not_two() -> None:
    watched = Watched()
    watched.comes(COORDINATOR)
    assert watched.goes(COORDINATOR) + watched.comes(NEXT_COORDINATOR) == [
        "the coordinator is gone",
        "the coordinator is here again",
    ]


def test_a_coordinator_that_is_silent_for_long_is_told_once_and_that_it_speaks_again() -> None:
    watched = Watched()
    watched.comes(COORDINATOR)
    assert watched.look(SILENCE) == []
    assert watched.look(1.0) + watched.look(1.0) == ["the coordinator has said nothing for 22 s"]
    assert watched.speaks() + watched.speaks() == ["the coordinator is heard again"]
    assert watched.look(SILENCE) == []


def test_an_outage_of_our_own_link_is_told_as_that_and_nobody_is_gone() -> None:
    watched = Watched()
    watched.comes(R1, COORDINATOR)
    lines = watched.goes(R1, COORDINATOR) + watched.look(0.0, linked=False)
    lines += watched.look(2 * SILENCE, linked=False) + watched.look(1.0, linked=False)
    assert lines == ["no router is reached any more: there is no news until one is"]
    assert watched.look(0.5) == ["the router is reached again"]
    assert watched.comes(R1, COORDINATOR) + watched.look(GRACE) == []


def test_who_is_not_back_after_an_outage_is_gone() -> None:
    watched = Watched()
    watched.comes(R1)
    watched.goes(R1)
    watched.look(0.5, linked=False)
    assert watched.look(0.5) + watched.look(GRACE) == ["r1 is gone"]


def test_a_robot_that_is_started_anew_is_gone_and_here_and_not_twice() -> None:
    watched = Watched()
    watched.comes(R1)
    again = keys.LIVE.build(team="t", robot="r1", boot="b2")
    assert watched.goes(R1) + watched.comes(again) == ["r1 is gone", "r1 is here"]


def test_that_nobody_of_the_team_is_here_is_told_once_after_a_while() -> None:
    watched = Watched()
    nobody = "nobody of team t is here yet: no robot, no coordinator"
    assert watched.look(0.9 * ALONE) + watched.look(ALONE) + watched.look(ALONE) == [nobody]
    met = Watched()
    met.comes(R1)
    assert met.look(ALONE) == []


def test_what_was_before_is_told_as_that_until_it_is_quiet_or_for_a_while() -> None:
    quiet, busy = Past(), Past()
    assert list(quiet.marked(["r1 is here"])) == ["before: r1 is here"]
    quiet.heard(0.0, something=True)
    assert list(quiet.marked(["r1 is here"])) == ["before: r1 is here"]
    quiet.heard(0.5, something=False)
    busy.heard(0.0, something=True)
    busy.heard(WITHIN, something=True)
    for past in (quiet, busy):
        assert list(past.marked(["r2 is here"])) == ["r2 is here"]


def test_a_mistyped_team_is_told_by_the_command_itself(endpoint: str) -> None:
    story = watch("nosuch", [endpoint], Watcher("nosuch"), lambda _: None)
    began = time.monotonic()
    line = next(line for line in story if line or time.monotonic() - began > 60)
    assert line == "nobody of team nosuch is here yet: no robot, no coordinator"


def test_who_waits_for_maps_without_a_router_hears_why(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING), pytest.raises(UnreachableError):
        next(joint_maps("t", connect=["tcp/127.0.0.1:9"], timeout=3.0))
    assert "waiting for a router: tcp/127.0.0.1:9: refused: nothing listens there" in caplog.text
