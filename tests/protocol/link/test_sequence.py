import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapweave.errors import MapweaveError
from mapweave.maps import JointMap
from mapweave_protocol.link.sequence import (
    ASKED_AT_ONCE,
    MAX_TRIES,
    MAX_WAITING,
    SHORT_HISTORY,
    JointSequence,
)
from mapweave_protocol.wire.messages import JointMapMessage
from mapweave_protocol.wire.model import MAX_COUNT
from mapweave_protocol.wire.queries import JointQuery


def message(version: int, series: str = "s1") -> JointMapMessage:
    return JointMapMessage.pack(JointMap(version, (), ()), series)


def taken(sequence: JointSequence) -> list[int]:
    return [joint.version for joint in iter(sequence.take, None)]


def ask_the_store(sequence: JointSequence, store: range) -> None:
    gap = sequence.gap
    if gap is not None:
        since = store[-2] if gap.since is None else gap.since
        wanted = [version for version in store if version > since]
        sequence.answered(gap, [message(version) for version in wanted[: gap.limit]])


def delivered_until_quiet(sequence: JointSequence, store: range) -> list[int]:
    delivered = taken(sequence)
    while sequence.gap is not None:
        ask_the_store(sequence, store)
        delivered += taken(sequence)
    return delivered


@given(st.permutations(range(1, 12)), st.lists(st.integers(1, 11), max_size=8))
@settings(deadline=None)
def test_any_order_with_repetitions_is_delivered_in_order_without_gap(
    order: list[int], again: list[int]
) -> None:
    sequence = JointSequence(whole_up_to=MAX_COUNT)
    delivered = []
    for version in [*order, *again]:
        sequence.offer(message(version))
        delivered += taken(sequence)
    assert delivered == list(range(1, 12))


@given(st.lists(st.integers(1, 30), min_size=1, unique=True).map(sorted))
@settings(deadline=None)
def test_what_is_lost_is_asked_for(heard: list[int]) -> None:
    sequence = JointSequence(whole_up_to=MAX_COUNT)
    delivered = []
    for version in heard:
        sequence.offer(message(version))
        delivered += taken(sequence)
        ask_the_store(sequence, range(1, version + 1))
        delivered += taken(sequence)
    assert delivered == list(range(1, heard[-1] + 1))
    assert sequence.gap is None


def test_who_comes_late_starts_with_the_latest() -> None:
    sequence = JointSequence(whole_up_to=0)
    for version in (7, 6, 8):
        sequence.offer(message(version))
    assert taken(sequence) == [7, 8]


def test_who_was_there_before_a_long_history_gets_the_latest_of_it_and_goes_on() -> None:
    sequence = JointSequence(whole_up_to=SHORT_HISTORY)
    delivered = []
    for version in (300, 301, 304):
        sequence.offer(message(version))
        delivered += delivered_until_quiet(sequence, range(1, version + 1))
    assert delivered == [300, 301, 302, 303, 304]


def test_of_a_short_history_who_was_there_before_gets_all() -> None:
    sequence = JointSequence(whole_up_to=SHORT_HISTORY)
    sequence.offer(message(SHORT_HISTORY))
    delivered = delivered_until_quiet(sequence, range(1, SHORT_HISTORY + 1))
    assert delivered == list(range(1, SHORT_HISTORY + 1))


def test_who_slept_through_two_thousand_versions_gets_all_in_order_in_portions() -> None:
    sequence = JointSequence(whole_up_to=0)
    sequence.offer(message(1))
    for version in (500, *range(1900, 2001)):
        sequence.offer(message(version))
    assert taken(sequence) == [1]
    assert sequence.gap == JointQuery(since=1, limit=ASKED_AT_ONCE)
    assert delivered_until_quiet(sequence, range(1, 2001)) == list(range(2, 2001))


def test_a_version_that_is_only_told_of_is_asked_for() -> None:
    sequence = JointSequence(whole_up_to=0)
    sequence.expect("s1", 7)
    assert sequence.gap == JointQuery()
    assert delivered_until_quiet(sequence, range(1, 8)) == [7]
    sequence.expect("s1", 8)
    assert delivered_until_quiet(sequence, range(1, 9)) == [8]


def test_what_is_told_of_another_series_is_asked_for_only_where_that_one_counts() -> None:
    sequence = JointSequence(whole_up_to=0)
    sequence.offer(message(7))
    assert taken(sequence) == [7]
    sequence.expect("s2", 9)
    assert sequence.gap == JointQuery()
    sequence.answered(JointQuery(), [message(7)])
    assert sequence.gap is None


def test_a_gap_that_nobody_can_close_is_skipped_after_some_tries() -> None:
    sequence = JointSequence(whole_up_to=MAX_COUNT)
    sequence.offer(message(5))
    asked = JointQuery(since=0, limit=ASKED_AT_ONCE)
    skipped = []
    for _ in range(MAX_TRIES):
        sequence.answered(asked, [message(5)])
        skipped.append(sequence.give_up())
    assert skipped == [0] * (MAX_TRIES - 1) + [4]
    assert taken(sequence) == [5]


def test_a_gap_that_nobody_has_been_heard_about_is_not_skipped_but_closed_later() -> None:
    sequence = JointSequence(whole_up_to=MAX_COUNT)
    sequence.offer(message(3))
    assert [sequence.give_up() for _ in range(3 * MAX_TRIES)] == [0] * 3 * MAX_TRIES
    assert delivered_until_quiet(sequence, range(1, 4)) == [1, 2, 3]


@pytest.mark.parametrize(
    ("since", "delivered"), [(0, [1, 2, 3, 4]), (2, [3, 4]), (4, []), (9, [1, 2, 3, 4])]
)
def test_who_says_since_when_gets_all_after_it(since: int, delivered: list[int]) -> None:
    sequence = JointSequence(whole_up_to=MAX_COUNT, since=since)
    sequence.expect("s1", 4)
    assert delivered_until_quiet(sequence, range(1, 5)) == delivered
    assert sequence.gap is None


def test_of_two_coordinators_that_answer_the_one_followed_is_kept() -> None:
    sequence = JointSequence(whole_up_to=0)
    sequence.offer(message(7))
    assert taken(sequence) == [7]
    for now in (0.0, 100.0):
        sequence.expect("s2", 3, now)
        assert sequence.gap == JointQuery()
        sequence.answered(JointQuery(), [message(7), message(3, "s2")], now)
        assert sequence.gap is None
    sequence.offer(message(8), 101.0)
    assert taken(sequence) == [8]


@pytest.mark.parametrize("others", [[3], [3, 4, 5], [4]])
@pytest.mark.parametrize("own", [[3], [3, 4], []])
def test_another_coordinator_that_has_come_as_far_hides_no_version_of_the_one_followed(
    own: list[int], others: list[int]
) -> None:
    sequence = JointSequence(whole_up_to=0)
    sequence.offer(message(2))
    delivered = taken(sequence)
    sequence.expect("s1", 4)
    assert sequence.gap == JointQuery(since=2, limit=ASKED_AT_ONCE)
    answers = [*(message(n) for n in own), *(message(n, "s2") for n in others)]
    sequence.answered(sequence.gap, answers)
    for version in (3, 4):
        sequence.offer(message(version))
        delivered += taken(sequence)
    assert delivered == [2, 3, 4]


def test_another_store_is_followed_once_its_coordinator_answers() -> None:
    sequence = JointSequence(whole_up_to=0)
    sequence.offer(message(9))
    assert taken(sequence) == [9]
    sequence.offer(message(1, "s2"))
    assert taken(sequence) == []
    assert sequence.gap == JointQuery()
    sequence.answered(JointQuery(), [message(1, "s2")])
    for new in (message(10), message(2, "s2")):
        sequence.offer(new)
    assert taken(sequence) == [1, 2]


def test_the_series_followed_before_is_followed_again_when_it_is_the_one_that_answers() -> None:
    sequence = JointSequence(whole_up_to=0)
    sequence.offer(message(9))
    for time, series in enumerate(("s2", "s1", "s2")):
        sequence.offer(message(20 + time, series), now=10.0 * time)
        sequence.answered(JointQuery(), [message(20 + time, series)], now=10.0 * time)
        assert taken(sequence)[-1:] == [20 + time]


def test_a_series_of_nobody_takes_nothing_from_the_one_that_is_followed() -> None:
    sequence = JointSequence(whole_up_to=0)
    sequence.offer(message(1))
    delivered, asked = taken(sequence), 0
    for version in range(2, 100):
        for forged in range(50):
            now = version + forged / 50  # [s]: a version a second, 50 forged ones between
            sequence.offer(message(10_000 + forged, "forged"), now)
            if sequence.gap is not None:
                asked += 1
                sequence.answered(sequence.gap, [message(version - 1)], now)
        sequence.offer(message(version), version)
        delivered += taken(sequence)
    assert delivered == list(range(1, 100))
    assert asked < 12


@pytest.mark.parametrize("how", ["published", "told"])
@pytest.mark.parametrize("far", [12, 300, 2**53])
def test_a_forged_version_far_ahead_is_not_waited_for_and_skips_nothing(how: str, far: int) -> None:
    sequence = JointSequence(whole_up_to=0)
    delivered: list[int] = []
    for version in range(5, 40):
        sequence.offer(message(version))
        if version == 10:
            if how == "told":
                sequence.expect("s1", far)
            else:
                sequence.offer(message(far))
        delivered += taken(sequence)
        for _ in range(3 * MAX_TRIES):
            ask_the_store(sequence, range(1, version + 1))
            if sequence.gap is None:
                break
            sequence.give_up()
        assert sequence.gap is None, "nothing is asked for for ever"
    if how == "told" or far > 40:
        assert delivered == list(range(5, 40))
    assert delivered[-1] == 39


def test_what_is_far_ahead_is_forgotten_where_nobody_answers() -> None:
    sequence = JointSequence(whole_up_to=0)
    for version in (5, 2**53):
        sequence.offer(message(version))
    assert taken(sequence) == [5]
    for _ in range(MAX_TRIES):
        assert sequence.give_up() == 0
    assert sequence.gap is None
    sequence.offer(message(6))
    assert taken(sequence) == [6]


def test_versions_of_an_earlier_series_of_the_store_are_not_waited_for() -> None:
    sequence = JointSequence(whole_up_to=SHORT_HISTORY)
    sequence.offer(message(7, "s2"))
    gap = sequence.gap
    assert gap == JointQuery(since=0, limit=ASKED_AT_ONCE)
    sequence.answered(gap, [*(message(n) for n in range(1, 6)), message(6, "s2")])
    assert taken(sequence) == [6, 7]


def test_no_more_than_so_many_wait() -> None:
    sequence = JointSequence(whole_up_to=MAX_COUNT)
    for version in range(2, 3 * MAX_WAITING):
        sequence.offer(message(version))
    sequence.offer(message(1))
    assert taken(sequence) == list(range(1, MAX_WAITING + 1))


@pytest.mark.parametrize(
    "query",
    [
        JointQuery(),
        JointQuery(version=3),
        JointQuery(since=0),
        JointQuery(since=3, limit=2),
        JointQuery(robot="r1"),
        JointQuery(robot="r1", boot="3"),
        JointQuery(of="maps"),
        JointQuery(since=3, of="alignments"),
    ],
)
def test_parsing_undoes_what_a_query_says(query: JointQuery) -> None:
    assert JointQuery.parse(query.parameters) == query


@given(st.text(max_size=40))
def test_any_other_parameters_are_refused(parameters: str) -> None:
    try:
        query = JointQuery.parse(parameters)
    except MapweaveError:
        return
    assert JointQuery.parse(query.parameters) == query


@pytest.mark.parametrize(
    "parameters",
    [
        "version=1;since=2",
        "limit=2",
        "since=1;limit=0",
        "version=1;limit=2",
        "version=-1",
        "version=x",
        "robot=A",
        "boot=b",
        "of=poses",
        "of=maps;robot=r1",
        "since=1;limit=2;of=maps",
        "robot=",
        "other=1",
        "version",
        "=",
    ],
)
def test_what_is_no_question_is_refused(parameters: str) -> None:
    with pytest.raises(MapweaveError):
        JointQuery.parse(parameters)
