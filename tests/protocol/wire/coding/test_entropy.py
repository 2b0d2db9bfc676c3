"""What an encoder was given a decoder finds, and few bytes do not unfold into much."""

from collections.abc import Callable, Hashable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapweave.maps import RobotMap
from mapweave_protocol.wire.coding.entropy import (
    MAX_BITS,
    NUMBERS_OF_A_BYTE,
    NUMBERS_OF_NONE,
    Coder,
    Decoder,
    Encoder,
    name_of,
    usual,
)
from mapweave_protocol.wire.coding.trajectory_code import Clock
from mapweave_protocol.wire.geometry import PackedSubmap

MakeMap = Callable[..., RobotMap]
NUMBERS = st.lists(st.tuples(st.sampled_from("ab"), st.integers(-(2**60), 2**60)), max_size=60)
SMALL = st.lists(st.tuples(st.sampled_from("ab"), st.integers(-3, 3)), max_size=300)


@given(NUMBERS | SMALL)
def test_numbers_arrive_as_they_were_sent(numbers: list[tuple[str, int]]) -> None:
    encoder = Encoder()
    for context, number in numbers:
        encoder.signed(context, number)
    decoder = Decoder(encoder.finish())
    assert [decoder.signed(context) for context, _ in numbers] == [n for _, n in numbers]


@given(st.lists(st.integers(0, 1), max_size=400))
def test_even_bits_arrive_as_they_were_sent(bits: list[int]) -> None:
    encoder = Encoder()
    for bit in bits:
        encoder.even(bit)
    decoder = Decoder(encoder.finish())
    assert [decoder.even() for _ in bits] == bits


def test_what_is_usual_costs_next_to_nothing() -> None:
    encoder = Encoder()
    for _ in range(900):
        encoder.unsigned("same", 0)
    assert len(encoder.finish()) < 20


def test_what_a_context_begins_with_is_as_if_it_had_been_seen() -> None:
    sizes = []
    for beginning in ({}, {"same 0": (1, 23)}):
        encoder = Encoder(beginning)
        encoder.unsigned("same", 6)
        sizes.append(encoder.finish())
        decoder = Decoder(sizes[-1], beginning)
        assert decoder.unsigned("same") == 6
    assert len(sizes[1]) <= len(sizes[0])


def test_the_counts_that_are_usual_are_of_contexts_that_maps_have(random_map: MakeMap) -> None:
    found = set[str]()

    class Named(Encoder):
        def bit(self, context: Hashable, value: int = 0) -> int:
            found.add(name_of(context))
            return super().bit(context, value)

    for seed in range(20):
        for submap in random_map(seed).submaps:
            PackedSubmap.code(Named(), PackedSubmap.pack(submap), Clock())
    kinds = {name.split()[0] for name in usual()}
    assert {name.split()[0] for name in found} <= kinds
    assert all(zeros > 0 and ones > 0 for zeros, ones in usual().values())


def until_refused(coder: Coder) -> int:
    """Return how many numbers come before the decoder refuses to go on."""
    with pytest.raises(ValueError, match="numbers in"):
        while True:
            coder.unsigned("same")
    return coder.numbers - 1


def test_few_bytes_unfold_into_no_more_than_so_many_numbers() -> None:
    encoder = Encoder()
    for _ in range(NUMBERS_OF_NONE + 100 * NUMBERS_OF_A_BYTE):
        encoder.unsigned("same", 0)
    payload = encoder.finish()
    assert until_refused(Decoder(payload)) == NUMBERS_OF_NONE + NUMBERS_OF_A_BYTE * len(payload)
    assert len(payload) >= 100  # padded, so that whoever sends so many may


def test_a_number_without_end_is_refused() -> None:
    encoder = Encoder()
    for bits in range(MAX_BITS + 2):
        encoder.bit(("long", bits), 1)
    with pytest.raises(ValueError, match="bits"):
        Decoder(encoder.finish()).unsigned("long")


def test_more_of_something_than_its_limit_is_refused_before_it_is_made() -> None:
    encoder = Encoder()
    encoder.unsigned("walls", 1_000_000)
    with pytest.raises(ValueError, match="1000000 in a row, expected at most 999"):
        Decoder(encoder.finish()).count("walls", 999)
