"""Numbers survive the wire: integers exactly, others to half a step, and twice as once."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave_protocol.wire import packing

EDGES = [sign * 2**bits + off for bits in (7, 15, 31) for sign in (-1, 1) for off in (-1, 0, 1)]
INTEGERS = st.one_of(st.sampled_from(EDGES), st.integers(-(2**62), 2**62), st.integers(-300, 300))
REACH = 1e5


def rows_of(columns: int) -> st.SearchStrategy[IntArray]:
    row = st.lists(INTEGERS, min_size=columns, max_size=columns)
    return st.lists(row, max_size=6).map(
        lambda rows: np.array(rows, dtype=np.int64).reshape(-1, columns)
    )


@given(st.integers(1, 4).flatmap(rows_of))
def test_integers_arrive_as_they_were_sent(values: IntArray) -> None:
    columns = values.shape[1]
    unpacked = packing.unpack_integers(packing.pack_integers(values), columns, 6)
    np.testing.assert_array_equal(unpacked, values)


@pytest.mark.parametrize(("value", "width"), [(127, 1), (-128, 1), (128, 2), (-129, 2), (2**31, 8)])
def test_integers_take_the_least_width_that_holds_them(value: int, width: int) -> None:
    assert len(packing.pack_integers(np.array([[value]]))) == 1 + width


@given(arrays(np.float64, st.integers(0, 8), elements=st.floats(-REACH, REACH)))
def test_lengths_arrive_within_half_a_millimetre_and_then_stay(values: FloatArray) -> None:
    once = packing.quantise(values, packing.PER_METRE, REACH)
    metres = packing.unquantise(once, packing.PER_METRE, REACH)
    assert (np.abs(metres - values) <= 0.5e-3 + 1e-9).all()
    np.testing.assert_array_equal(packing.quantise(metres, packing.PER_METRE, REACH), once)


POSES = st.tuples(st.floats(-REACH, REACH), st.floats(-REACH, REACH), st.floats(-20, 20))


@given(st.lists(POSES, max_size=4))
def test_poses_arrive_within_half_a_millimetre_and_a_microradian_and_then_stay(
    poses: list[tuple[float, float, float]],
) -> None:
    sent = np.array(poses).reshape(-1, 3)
    once = packing.quantise_poses(sent, REACH)
    came = packing.unquantise_poses(once, REACH)
    assert (np.abs(came[:, :2] - sent[:, :2]) <= 0.5e-3 + 1e-9).all()
    assert (np.abs(se2.wrap(came[:, 2] - sent[:, 2])) <= 1.5e-6).all()
    np.testing.assert_array_equal(packing.quantise_poses(came, REACH), once)


@given(arrays(np.float64, st.integers(0, 8), elements=st.floats(0, 1e10)))
def test_stamps_arrive_within_a_tenth_of_a_millisecond_and_then_stay(stamps: FloatArray) -> None:
    once = packing.quantise_stamps(stamps)
    came = packing.unquantise_stamps(once)
    np.testing.assert_allclose(came, stamps, atol=1e-4, rtol=1e-15)
    np.testing.assert_array_equal(packing.quantise_stamps(came), once)


@given(st.binary(max_size=40), st.integers(1, 5))
def test_bytes_that_no_integers_pack_into_are_refused(data: bytes, columns: int) -> None:
    try:
        values = packing.unpack_integers(data, columns, 4)
    except ValueError:
        return
    again = packing.unpack_integers(packing.pack_integers(values), columns, 4)
    np.testing.assert_array_equal(again, values)
