"""The compiled coder and its twin write the same bytes, and read the same from any."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapweave.kernels.loading import COMPILED
from mapweave.kernels.range_coder import (
    NUMBERS_OF_A_BYTE,
    NUMBERS_OF_NONE,
    PythonDecoder,
    PythonEncoder,
    make_decoder,
    make_encoder,
)
from tests.mapweave.coder_steps import BEGINNING, LIMIT, STEPS, Step, walk

pytestmark = pytest.mark.skipif(COMPILED is None, reason="kernels are not compiled")


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
