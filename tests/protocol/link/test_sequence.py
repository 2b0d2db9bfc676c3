import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapweave.errors import MapweaveError
from mapweave.maps import JointMap
from mapweave_protocol.link.sequence import MAX_TRIES, MAX_WAITING, JointSequence
from mapweave_protocol.wire.messages import JointMapMessage
from mapweave_protocol.wire.queries import JointQuery


def message(version: int, series: str = "s1") -> JointMapMessage:
    return JointMapMessage.pack(JointMap(version, (), ()), series)


def taken(sequence: JointSequence) -> list[int]:
    return [joint.version for joint in iter(sequence.take, None)]


def ask_the_store(sequence: JointSequence, store: range) -> None:
    if sequence.gap is not None and sequence.gap.since is not None:
        for version in store:
            if version > sequence.gap.since:
                sequence.offer(message(version))


@given(st.permutations(range(1, 12)), st.lists(st.integers(1, 11), max_size=8))
@settings(deadline=None)
def test_any_order_with_repetitions_is_delivered_in_order_without_gap(
    order: list[int], again: list[int]
) -> None:
    sequence = JointSequence(from_the_first=True)
    delivered = []
    for version in [*order, *again]:
        sequence.offer(message(version))
        delivered += taken(sequence)
    assert delivered == list(range(1, 12))


@given(st.lists(st.integers(1, 30), min_size=1, unique=True).map(sorted))
@settings(deadline=None)
def test_what_is_lost_is_asked_for(heard: list[int]) -> None:
    sequence = JointSequence(from_the_first=True)
    delivered = []
    for version in heard:
        sequence.offer(message(version))
        delivered += taken(sequence)
        ask_the_store(sequence, range(1, version + 1))
        delivered += taken(sequence)
    assert delivered == list(range(1, heard[-1] + 1))
    assert sequence.gap is None


def test_who_comes_late_starts_with_the_latest() -> None:
    sequence = JointSequence(from_the_first=False)
    for version in (7, 6, 8):
        sequence.offer(message(version))
    assert taken(sequence) == [7, 8]


def test_a_gap_that_nobody_can_close_is_skipped_after_some_tries() -> None:
    sequence = JointSequence(from_the_first=True)
    sequence.offer(message(5))
    skipped = [sequence.give_up() for _ in range(MAX_TRIES)]
    assert skipped == [0] * (MAX_TRIES - 1) + [4]
    assert taken(sequence) == [5]


def test_another_store_counts_from_one_again_and_the_old_one_is_not_heard_any_more() -> None:
    sequence = JointSequence(from_the_first=False)
    for new in (message(9), message(1, "s2"), message(10), message(2, "s2")):
        sequence.offer(new)
    assert taken(sequence) == [1, 2]


def test_no_more_than_so_many_wait() -> None:
    sequence = JointSequence(from_the_first=True)
    for version in range(2, 3 * MAX_WAITING):
        sequence.offer(message(version))
    sequence.offer(message(1))
    assert taken(sequence) == list(range(1, MAX_WAITING + 1))


@pytest.mark.parametrize(
    "query", [JointQuery(), JointQuery(version=3), JointQuery(since=0), JointQuery(robot="r1")]
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
        "version=-1",
        "version=x",
        "robot=A",
        "robot=",
        "other=1",
        "version",
        "=",
    ],
)
def test_what_is_no_question_is_refused(parameters: str) -> None:
    with pytest.raises(MapweaveError):
        JointQuery.parse(parameters)
