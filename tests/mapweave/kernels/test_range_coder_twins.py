"""The compiled coder and its twin write the same bytes, and read the same from any."""

from collections.abc import Hashable, Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapweave.kernels.loading import COMPILED
from mapweave.kernels.range_coder import (
    NUMBERS_OF_A_BYTE,
    NUMBERS_OF_NONE,
    Beginning,
    Coder,
    PythonDecoder,
    PythonEncoder,
    make_decoder,
    make_encoder,
)

LIMIT = 2**21
BEGINNING: Beginning = {"a 0": (3, 21), "a 1 1": (20, 4), "b 2 sign": (1, 23), "d 1": (9, 15)}
CONTEXTS: Sequence[Hashable] = ("a", ("b", 2), ("b", True), (("c", 1), 2), "é")
NUMBERS = st.tuples(st.sampled_from(CONTEXTS), st.integers(-(2**60), 2**60))
SMALL = st.tuples(st.sampled_from(CONTEXTS), st.integers(-3, 3))
DECISIONS = st.tuples(st.sampled_from(["d", ("d", 1), ("d", False)]), st.booleans())
Step = tuple[Hashable, int]
STEPS = st.lists(NUMBERS | SMALL | DECISIONS, max_size=300)

pytestmark = pytest.mark.skipif(COMPILED is None, reason="kernels are not compiled")


def walk(coder: Coder, steps: Sequence[Step], *, known: bool = True) -> list[int]:
    """Code what `steps` are, numbers or decisions; return what came out."""
    found = []
    for context, number in steps:
        value = number if known else 0
        found.append((coder.bit if isinstance(number, bool) else coder.signed)(context, value))
        found.append(coder.even(value & 1))
    return found


@given(STEPS, st.integers(0, 300))
def test_compiled_and_twin_write_the_same_bytes_also_from_a_copy(
    steps: list[Step], cut: int
) -> None:
    ours, twin = make_encoder(BEGINNING, LIMIT), PythonEncoder(BEGINNING, LIMIT)
    walk(ours, steps[:cut])
    walk(twin, steps[:cut])
    copies = ours.copy(), twin.copy()
    walk(ours, [("a", 77)])  # a copy has nothing of what comes after
    walk(twin, [("a", 77)])
    for each in copies:
        walk(each, steps[cut:])
    assert copies[0].finish() == copies[1].finish()
    assert ours.finish() == twin.finish()


@given(st.binary(max_size=200), STEPS)
def test_compiled_and_twin_read_the_same_from_any_bytes(data: bytes, steps: list[Step]) -> None:
    allowed = min(LIMIT, NUMBERS_OF_NONE + NUMBERS_OF_A_BYTE * len(data))
    seen = []
    for coder in (make_decoder(data, BEGINNING, LIMIT), PythonDecoder(data, BEGINNING, allowed)):
        found: list[object] = []
        try:
            for step in steps:
                found += walk(coder, [step], known=False)
        except ValueError as error:
            found.append(str(error))
        seen.append(found)
    assert seen[0] == seen[1]
