"""How far a robot is looked for: as far as time allows, and its pace."""

import numpy as np
import pytest

from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.tracking.motion_model import MotionModel, MotionModelParameters
from mapweave.mapping.tracking.reach import Reach, reach
from mapweave.mapping.tracking.reachability import Reachability, ReachabilityParameters
from mapweave.scan.scan import Scan

HELD: FloatArray = np.diag([20.0, 20.0, 20.0])


def scan_at(index: int, stamp: float) -> Scan:
    return Scan(np.full(181, 2.0), np.radians(np.arange(-90.0, 91.0)), index, stamp)


def looked_for(
    interval: float, since: float, *, step: float | None = None, missed: int = 0
) -> Reach:
    """Return how far one is looked for `since` [s] after scans every `interval` [s]."""
    reachability = Reachability(ReachabilityParameters())
    motion_model = MotionModel(MotionModelParameters())
    for k in range(30):
        scan = scan_at(k, k * interval)
        reachability.tick(scan)
        reachability.placed(scan, np.zeros(3))
        if step is not None:
            motion_model.add(np.array([step, 0.0, 0.0]), HELD)
    next_one = scan_at(30 + missed, 29 * interval + since)
    return reach(next_one, missed, 2.5, motion_model, reachability)


def test_it_can_have_come_as_far_as_its_speed_and_the_time_allow() -> None:
    assert looked_for(0.1, 0.1).far == pytest.approx(0.25 + 2.0 * 0.1)
    assert looked_for(4.0, 4.0).far == pytest.approx(0.25 + 2.0 * 4.0)


def test_a_step_of_an_untimed_log_is_as_long_as_a_second_allows() -> None:
    assert looked_for(0.0, 0.0).far == 2.5


@pytest.mark.parametrize("missed", [0, 3])
def test_one_that_keeps_a_short_pace_is_not_looked_for_afar(missed: int) -> None:
    """Though 9 s would do for 18 m."""
    found = looked_for(9.0, 9.0 * (1 + missed), step=0.4, missed=missed)
    assert found.paced == pytest.approx((1 + missed) * 1.5 * 0.4 + 0.5)
    assert found.window(1.2, 4.0) == pytest.approx(max(1.2, found.paced / 2))


def test_as_long_as_its_pace_is_not_known_all_of_its_way_is_searched() -> None:
    assert looked_for(9.0, 9.0).window(1.2, 4.0) == 4.0
    assert looked_for(0.1, 0.1).window(1.2, 4.0) == 1.2


def test_the_window_of_a_sparse_log_is_half_of_its_longest_steps() -> None:
    assert looked_for(9.0, 9.0, step=3.0).window(1.2, 4.0) == pytest.approx(5.0 / 2)
