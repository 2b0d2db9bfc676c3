"""What an encoder was given a decoder finds, and few bytes do not unfold into much.

The compiled coder and its twin write the same bytes, and read the same from any.
"""

from collections.abc import Hashable, Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapweave.kernels.loading import COMPILED
from mapweave.kernels.range_coder import (
    MAX_BITS,
    NUMBERS_OF_A_BYTE,
    NUMBERS_OF_NONE,
    Beginning,
    Coder,
    Encoder,
    PythonDecoder,
    PythonEncoder,
    make_decoder,
    make_encoder,
    name_of,
)

LIMIT = 2**21
BEGINNING: Beginning = {"a 0": (3, 21), "a 1 1": (20, 4), "b 2 sign": (1, 23), "d 1": (9, 15)}
CONTEXTS: Sequence[Hashable] = ("a", ("b", 2), ("b", True), (("c", 1), 2), "é")
NUMBERS = st.tuples(st.sampled_from(CONTEXTS), st.integers(-(2**60), 2**60))
SMALL = st.tuples(st.sampled_from(CONTEXTS), st.integers(-3, 3))
DECISIONS = st.tuples(st.sampled_from(["d", ("d", 1), ("d", False)]), st.booleans())
Step = tuple[Hashable, int]
STEPS = st.lists(NUMBERS | SMALL | DECISIONS, max_size=300)

compiled_only = pytest.mark.skipif(COMPILED is None, reason="kernels are not compiled")


def walk(coder: Coder, steps: Sequence[Step], *, known: bool = True) -> list[int]:
    """Code what `steps` are, numbers or decisions; return what came out."""
    found = []
    for context, number in steps:
        value = number if known else 0
        found.append((coder.bit if isinstance(number, bool) else coder.signed)(context, value))
        found.append(coder.even(value & 1))
    return found


def encoder(beginning: Beginning = BEGINNING) -> Encoder:
    return make_encoder(beginning, LIMIT)


def decoder(data: bytes, beginning: Beginning = BEGINNING) -> Coder:
    return make_decoder(data, beginning, LIMIT)


@given(STEPS)
def test_numbers_and_decisions_arrive_as_they_were_sent(steps: list[Step]) -> None:
    sender = encoder()
    walk(sender, steps)
    sent = [each for _, number in steps for each in (number, number & 1)]
    assert walk(decoder(sender.finish()), steps, known=False) == sent


@compiled_only
@given(STEPS, st.integers(0, 300))
def test_compiled_and_twin_write_the_same_bytes_also_from_a_copy(
    steps: list[Step], cut: int
) -> None:
    ours, twin = encoder(), PythonEncoder(BEGINNING, LIMIT)
    walk(ours, steps[:cut])
    walk(twin, steps[:cut])
    copies = ours.copy(), twin.copy()
    walk(ours, [("a", 77)])  # a copy has nothing of what comes after
    walk(twin, [("a", 77)])
    for each in copies:
        walk(each, steps[cut:])
    assert copies[0].finish() == copies[1].finish()
    assert ours.finish() == twin.finish()


@compiled_only
@given(st.binary(max_size=200), STEPS)
def test_compiled_and_twin_read_the_same_from_any_bytes(data: bytes, steps: list[Step]) -> None:
    allowed = min(LIMIT, NUMBERS_OF_NONE + NUMBERS_OF_A_BYTE * len(data))
    seen = []
    for coder in (decoder(data), PythonDecoder(data, BEGINNING, allowed)):
        found: list[object] = []
        try:
            for step in steps:
                found += walk(coder, [step], known=False)
        except ValueError as error:
            found.append(str(error))
        seen.append(found)
    assert seen[0] == seen[1]


def test_a_context_is_known_by_the_parts_of_its_name() -> None:
    assert name_of((("aside", True), 0, 3)) == "aside 1 0 3"


def test_what_is_usual_costs_next_to_nothing() -> None:
    sender = encoder()
    for _ in range(900):
        sender.unsigned("same", 0)
    assert len(sender.finish()) < 20


def test_what_a_context_begins_with_is_as_if_it_had_been_seen() -> None:
    sizes = []
    beginnings: tuple[Beginning, ...] = {}, {"same 0": (1, 23)}
    for beginning in beginnings:
        sender = encoder(beginning)
        sender.unsigned("same", 6)
        sizes.append(sender.finish())
        receiver = decoder(sizes[-1], beginning)
        assert receiver.unsigned("same") == 6
    assert len(sizes[1]) <= len(sizes[0])


def until_refused(coder: Coder) -> int:
    """Return how many numbers come before the decoder refuses to go on."""
    with pytest.raises(ValueError, match="numbers in"):
        while True:
            coder.unsigned("same")
    return coder.numbers - 1


def test_few_bytes_unfold_into_no_more_than_so_many_numbers() -> None:
    sender = encoder()
    for _ in range(NUMBERS_OF_NONE + 100 * NUMBERS_OF_A_BYTE):
        sender.unsigned("same", 0)
    payload = sender.finish()
    assert until_refused(decoder(payload)) == NUMBERS_OF_NONE + NUMBERS_OF_A_BYTE * len(payload)
    assert len(payload) >= 100  # padded, so that whoever sends so many may


def test_a_number_without_end_is_refused() -> None:
    sender = encoder()
    for bits in range(MAX_BITS + 2):
        sender.bit(("long", bits), 1)
    with pytest.raises(ValueError, match="bits"):
        decoder(sender.finish()).unsigned("long")


def test_more_of_something_than_its_limit_is_refused_before_it_is_made() -> None:
    sender = encoder()
    sender.unsigned("walls", 1_000_000)
    with pytest.raises(ValueError, match="1000000 in a row, expected at most 999"):
        decoder(sender.finish()).count("walls", 999)
