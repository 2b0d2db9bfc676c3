"""Numbers survive the wire: integers exactly, others to half a step, and twice as once."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave_protocol.wire import packing

REACH = 1e5


@given(arrays(np.float64, st.integers(0, 8), elements=st.floats(-REACH, REACH)))
def test_lengths_arrive_within_half_a_millimetre_and_then_stay(values: FloatArray) -> None:
    once = packing.quantise(values, packing.PER_METRE, REACH)
    metres = packing.unquantise(once, packing.PER_METRE, REACH)
    assert (np.abs(metres - values) <= 0.5e-3 + 1e-9).all()
    np.testing.assert_array_equal(packing.quantise(metres, packing.PER_METRE, REACH), once)


POSES = st.tuples(st.floats(-REACH, REACH), st.floats(-REACH, REACH), st.floats(-20, 20))


@given(st.lists(POSES, max_size=4))
def test_poses_arrive_within_half_a_millimetre_and_a_hundredth_of_a_milliradian_and_then_stay(
    poses: list[tuple[float, float, float]],
) -> None:
    sent = np.array(poses).reshape(-1, 3)
    once = packing.quantise_poses(sent, REACH)
    came = packing.unquantise_poses(once, REACH)
    assert (np.abs(came[:, :2] - sent[:, :2]) <= 0.5e-3 + 1e-9).all()
    assert (np.abs(se2.wrap(came[:, 2] - sent[:, 2])) <= 1.5e-5).all()
    np.testing.assert_array_equal(packing.quantise_poses(came, REACH), once)


@pytest.mark.parametrize("value", [2**53 + 1, -(2**60), 2**70])
def test_numbers_that_no_double_holds_are_refused(value: int) -> None:
    with pytest.raises(ValueError, match="whole numbers"):
        packing.whole_numbers([0, value])
