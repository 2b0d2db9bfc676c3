"""The fit of how much maps are bent finds what was drawn."""

import numpy as np
import pytest
from numpy.random import Generator

from benchmarks.reach_fit import fit_reach
from mapweave.geometry.arrays import FloatArray


def drawn(rng: Generator, exact: float, bend: float) -> tuple[FloatArray, FloatArray]:
    reach = rng.uniform(0, 40, 4000)
    off = rng.normal(0, 1, (4000, 2)) * np.hypot(exact, bend * reach)[:, None]
    return reach, np.hypot(*off.T)


@pytest.mark.parametrize(("exact", "bend"), [(0.05, 0.012), (0.1, 0.002)])
def test_it_finds_the_parameters_that_errors_were_drawn_with(exact: float, bend: float) -> None:
    rng = np.random.default_rng(1)
    assert fit_reach(*drawn(rng, exact, bend)) == pytest.approx((exact, bend), rel=0.1)


def test_one_that_is_exact_breaks_nothing_and_one_that_is_unknown_is_refused() -> None:
    reach, distance = drawn(np.random.default_rng(3), 0.05, 0.012)
    distance[0] = 0.0
    assert fit_reach(reach, distance) == pytest.approx((0.05, 0.012), rel=0.1)
    distance[1] = np.inf
    with pytest.raises(ValueError, match="finite"):
        fit_reach(reach, distance)


def test_a_few_mistaken_outcomes_bend_it_little() -> None:
    rng = np.random.default_rng(2)
    reach, distance = drawn(rng, 0.05, 0.012)
    distance[:20] = 8.0
    assert fit_reach(reach, distance) == pytest.approx((0.05, 0.012), rel=0.1)
