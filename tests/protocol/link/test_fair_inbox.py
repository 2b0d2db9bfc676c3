"""A flood of one sender neither delays the others nor takes their place."""

import threading
import time
from collections import Counter

from hypothesis import given
from hypothesis import strategies as st

from mapweave_protocol.link.inbox import Arrival, Inbox
from mapweave_protocol.wire import keys


def _arrival(robot: str, number: int, size: int = 10) -> Arrival:
    return Arrival(keys.MAP.build(team="t", robot=robot), number.to_bytes(8, "big").ljust(size))


def _taken(inbox: Inbox, count: int) -> list[tuple[str, int]]:
    found = [inbox.get(0.0) for _ in range(count)]
    return [
        (keys.sender_of(a.key), int.from_bytes(a.payload[:8], "big"))
        for a in found
        if a is not None
    ]


def test_senders_take_turns_each_in_its_own_order() -> None:
    inbox = Inbox(clock=lambda: 0.0)
    for number in range(100):
        inbox.add(_arrival("flood", number))
    for number in range(3):
        inbox.add(_arrival("quiet", number))
    assert _taken(inbox, 6) == [
        ("flood", 0), ("quiet", 0), ("flood", 1), ("quiet", 1), ("flood", 2), ("quiet", 2),
    ]  # fmt: skip
    assert _taken(inbox, 200) == [("flood", number) for number in range(3, 100)]
    assert inbox.get(0.0) is None


def test_a_flood_drops_its_own_oldest_only() -> None:
    inbox = Inbox(capacity=50)
    inbox.add(_arrival("quiet", 7))
    for number in range(1000):
        inbox.add(_arrival("flood", number))
    taken = _taken(inbox, 100)
    assert ("quiet", 7) in taken
    assert [n for robot, n in taken if robot == "flood"] == list(range(951, 1000))
    assert inbox.dropped == 951


def test_what_waits_is_bounded_in_bytes() -> None:
    inbox = Inbox(room=10_000)
    inbox.add(_arrival("quiet", 7))
    for number in range(100):
        inbox.add(_arrival("flood", number, size=3000))
    taken = _taken(inbox, 100)
    assert ("quiet", 7) in taken
    assert [n for robot, n in taken if robot == "flood"] == [97, 98, 99]
    inbox.add(_arrival("large", 1, size=20_000))
    assert _taken(inbox, 2) == [("large", 1)], "one always fits"


@given(st.lists(st.tuples(st.sampled_from("abc"), st.integers(0, 3000)), max_size=60))
def test_nothing_is_lost_or_doubled_while_there_is_room(sent: list[tuple[str, int]]) -> None:
    inbox = Inbox(clock=lambda: 0.0)
    for robot, number in sent:
        inbox.add(_arrival(robot, number))
    taken = _taken(inbox, 100)
    assert Counter(taken) == Counter(sent)
    for robot in "abc":
        assert [n for r, n in taken if r == robot] == [n for r, n in sent if r == robot]


def test_of_several_at_a_key_the_newest_is_taken_and_others_stay() -> None:
    inbox = Inbox(clock=lambda: 0.0)
    for number in range(5):
        inbox.add(_arrival("a", number))
        inbox.add(_arrival("b", number))
    newest = [inbox.newest(0.0) for _ in range(3)]
    assert [a and int.from_bytes(a.payload[:8], "big") for a in newest] == [4, 4, None]


def test_who_sends_is_read_from_the_key_and_only_ids_are_names() -> None:
    assert keys.sender_of("mapweave/v2/t/agent/r1/map") == "r1"
    assert keys.sender_of("mapweave/v2/t/live/agent/r1/boot") == "r1"
    assert keys.sender_of("mapweave/v2/t/live/coordinator/boot") == keys.COORDINATOR
    assert keys.sender_of("mapweave/v2/t/joint/map") == keys.COORDINATOR
    for key in ("mapweave/v2/t/agent/R 1\n/map", "other/a/b", "", "mapweave/v2/t/agent"):
        assert keys.sender_of(key) == keys.UNKNOWN


def test_who_costs_much_waits_while_others_are_served() -> None:
    now = 0.0
    inbox = Inbox(clock=lambda: now)
    for number in range(100):
        inbox.add(_arrival("costly", number))
    for number in range(20):
        inbox.add(_arrival("cheap", number))
    served = []
    for _ in range(22):
        arrival = inbox.get(0.0)
        assert arrival is not None
        served.append(keys.sender_of(arrival.key))
        now += 1.0 if served[-1] == "costly" else 0.01
    assert served.count("cheap") == 20
    assert served.count("costly") == 2


def test_who_was_away_has_not_saved_up() -> None:
    now = 0.0
    inbox = Inbox(clock=lambda: now)
    for number in range(200):
        inbox.add(_arrival("a", number))
    for _ in range(100):
        inbox.get(0.0)
        now += 0.1
    for number in range(100):
        inbox.add(_arrival("b", number))
    served = []
    for _ in range(40):
        arrival = inbox.get(0.0)
        assert arrival is not None
        served.append(keys.sender_of(arrival.key))
        now += 0.1
    assert 15 <= served.count("b") <= 25


def test_who_waits_for_an_arrival_can_be_woken_and_loses_none() -> None:
    inbox = Inbox()
    threading.Timer(0.05, inbox.wake).start()
    began = time.monotonic()
    assert inbox.get(600.0) is None
    assert time.monotonic() - began < 300.0
    inbox.wake()
    assert inbox.get(600.0) is None  # who was not waiting yet is woken as well
    inbox.add(_arrival("a", 1))
    inbox.wake()
    assert _taken(inbox, 2) == [("a", 1)]
