"""What an encoder was given a decoder finds, and few bytes do not unfold into much."""

from collections.abc import Callable, Hashable

import pytest
from hypothesis import given

from mapweave.kernels.range_coder import (
    MAX_BITS,
    NUMBERS_OF_A_BYTE,
    NUMBERS_OF_NONE,
    Beginning,
    Coder,
    Encoder,
    PythonEncoder,
    make_decoder,
    make_encoder,
    name_of,
)
from mapweave.maps import RobotMap
from mapweave_protocol.wire.coding.entropy import MAX_NUMBERS, usual
from mapweave_protocol.wire.coding.trajectory_code import Clock
from mapweave_protocol.wire.geometry import PackedSubmap
from tests.mapweave.coder_steps import BEGINNING, LIMIT, STEPS, Step, walk

MakeMap = Callable[..., RobotMap]


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


def test_the_counts_that_are_usual_are_of_contexts_that_maps_have(random_map: MakeMap) -> None:
    found = set[str]()

    class Named(PythonEncoder):
        def bit(self, context: Hashable, value: int = 0) -> int:
            found.add(name_of(context))
            return super().bit(context, value)

    for seed in range(20):
        for submap in random_map(seed).submaps:
            PackedSubmap.code(Named(usual(), MAX_NUMBERS), PackedSubmap.pack(submap), Clock())
    kinds = {name.split()[0] for name in usual()}
    assert {name.split()[0] for name in found} <= kinds
    assert all(zeros > 0 and ones > 0 for zeros, ones in usual().values())
