"""What a robot sends again, when others say what they hold."""

from collections.abc import Callable, Iterator
from typing import TypeAlias

import pytest

from mapweave_agent.needs import ARRIVAL, RETURN, Missing, Needs
from mapweave_protocol.link.lacking import GRACE
from mapweave_protocol.wire.messages import (
    AlignmentMessage,
    JointStatusMessage,
    MapVersion,
    StatusMessage,
)

Holder: TypeAlias = Callable[..., JointStatusMessage | StatusMessage]
NOTHING = Missing()


def state(robot: str, version: int, boot: str = "x") -> MapVersion:
    return MapVersion(robot=robot, boot=boot, version=version)


def found(of_a: int, of_b: int) -> AlignmentMessage:
    return AlignmentMessage.pack("a", state("a", of_a), state("b", of_b), [])


def coordinator(*maps: MapVersion, pair: tuple[int, int] | None = None) -> JointStatusMessage:
    ends = () if pair is None else ((state("a", pair[0]), state("b", pair[1])),)
    return JointStatusMessage(
        boot="c", stamp=0.0, series="s", version=1, pending=False, maps=maps, alignments=ends
    )


def peer(*maps: MapVersion) -> StatusMessage:
    counts = dict.fromkeys(("scans_seen", "scans_placed", "components", "submaps"), 1)
    fields = {"robot": "b", "boot": "y", "stamp": 0.0, "state": "mapping", "map_version": 1}
    return StatusMessage.model_validate({**counts, **fields, "holds": maps})


def asked_twice(
    status: JointStatusMessage | StatusMessage,
    own: MapVersion | None,
    *messages: AlignmentMessage,
    pause: float = GRACE,
) -> Missing:
    """Return what is missing when `status` is heard again after a `pause`."""
    needs = Needs("a")
    missing = NOTHING
    for now in (0.0, pause):
        if isinstance(status, JointStatusMessage):
            needs.coordinator(status)
        else:
            needs.peer(status)
        missing = needs.missing(own, messages, now)
    return missing


@pytest.mark.parametrize("held", [(), (state("a", 6),), (state("a", 9, "earlier"),)])
@pytest.mark.parametrize("who", [coordinator, peer])
def test_who_has_not_the_latest_map_gets_it(who: Holder, held: tuple[MapVersion, ...]) -> None:
    assert asked_twice(who(*held), state("a", 7)) == Missing(map=True)


def test_nothing_is_sent_again_while_it_may_be_on_its_way() -> None:
    assert asked_twice(coordinator(), state("a", 7), pause=GRACE / 2) == NOTHING


def asked_after_publication(came: float) -> float:
    """Return after how long a map that never arrives is sent again, somebody coming at `came`."""
    needs, now = Needs("a"), 0.0
    needs.met(came)
    needs.published(now)
    needs.published(now, found(7, 3))
    while now < 60.0:
        needs.coordinator(coordinator())
        missing = needs.missing(state("a", 7), [found(7, 3)], now)
        assert missing.map == bool(missing.alignments)
        if missing.map:
            return now
        now += GRACE / 8
    pytest.fail("never")


def test_what_was_published_on_links_that_hold_is_given_time_to_be_told_of() -> None:
    assert asked_after_publication(came=-RETURN) == pytest.approx(ARRIVAL + GRACE, abs=GRACE / 4)


def test_after_links_were_broken_what_was_published_before_is_sent_again_soon() -> None:
    assert asked_after_publication(came=0.0) == pytest.approx(2 * GRACE, abs=GRACE / 4)


@pytest.mark.parametrize("who", [coordinator, peer])
def test_who_has_the_latest_map_gets_nothing(who: Holder) -> None:
    assert asked_twice(who(state("b", 2), state("a", 7)), state("a", 7)) == NOTHING


def test_where_there_is_no_map_nothing_is_missing() -> None:
    assert asked_twice(coordinator(), None) == NOTHING


@pytest.mark.parametrize("held", [None, (7, 2), (6, 3)])
def test_a_coordinator_without_what_was_found_gets_it(held: tuple[int, int] | None) -> None:
    status = coordinator(state("a", 7), pair=held)
    assert asked_twice(status, state("a", 7), found(7, 3)).alignments == (found(7, 3),)


@pytest.mark.parametrize("held", [(7, 3), (8, 3), (6, 4)])
def test_what_another_found_since_is_not_replaced(held: tuple[int, int]) -> None:
    assert asked_twice(coordinator(state("a", 7), pair=held), state("a", 7), found(7, 3)) == NOTHING


def test_a_status_is_answered_once() -> None:
    needs = Needs("a")
    needs.coordinator(coordinator())
    needs.missing(state("a", 7), (), 0.0)
    assert needs.missing(state("a", 7), (), 10 * GRACE) == NOTHING


@pytest.mark.parametrize(
    ("held", "missing"),
    [
        ((), (state("a", 3, "before"),)),
        ((state("a", 2, "before"),), (state("a", 3, "before"),)),
        ((state("a", 3, "before"),), ()),
    ],
)
def test_a_coordinator_gets_the_maps_of_earlier_runs_too(
    held: tuple[MapVersion, ...], missing: tuple[MapVersion, ...]
) -> None:
    needs = Needs("a")
    for now in (0.0, GRACE):
        needs.coordinator(coordinator(state("a", 7), *held))
        needs.peer(peer(state("a", 7)))
        found = needs.missing(state("a", 7), (), now, [state("a", 3, "before")])
    assert found == Missing(past=missing)


def test_while_nobody_speaks_what_was_found_is_not_gone_through() -> None:
    def unread() -> Iterator[AlignmentMessage]:
        raise AssertionError("read although nobody has spoken")
        yield

    needs = Needs("a")
    assert needs.missing(state("a", 7), unread(), 0.0) == NOTHING
    needs.coordinator(coordinator())
    with pytest.raises(AssertionError):
        needs.missing(state("a", 7), unread(), 1.0)
