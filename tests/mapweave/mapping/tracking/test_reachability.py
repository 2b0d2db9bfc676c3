"""A robot comes no farther than its speed and the time allow; stamps are evidence, not truth."""

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.mapping.tracking.reachability import Reachability, ReachabilityParameters
from mapweave.scan.scan import Scan

P = ReachabilityParameters()


def scan(index: int, stamp: float) -> Scan:
    return Scan([1.0, 1.0], [0.0, 0.1], index, stamp)


def after(stamps: list[float], step: float = 0.0) -> tuple[Reachability, Scan]:
    """Return what is known when the last of `stamps` comes, all before placed `step` apart [m]."""
    known = Reachability(P)
    for k, stamp in enumerate(stamps):
        known.tick(scan(k, stamp))
        if k < len(stamps) - 1:
            known.placed(scan(k, stamp), np.array([step * k, 0.0, 0.0]))
    return known, scan(len(stamps) - 1, stamps[-1])


@pytest.mark.parametrize("direction", [0.0, 1.0, 3.0])
def test_a_step_is_bound_by_speed_and_time(direction: float) -> None:
    known, now = after([0.1 * k for k in range(5)])
    far = P.slack + 0.1 * P.max_speed
    ahead = np.array([np.cos(direction), np.sin(direction), 0.0])
    within, beyond = known.allows(now, np.outer([0.99 * far, 1.01 * far], ahead))
    assert within and not beyond


def test_a_turn_is_bound_by_turn_rate_and_time() -> None:
    known, now = after([0.1 * k for k in range(5)])
    most = P.turn_slack + 0.1 * P.max_turn_rate
    turns = np.array([0.99, -0.99, 1.01, -1.01]) * most
    poses = np.column_stack([np.zeros((4, 2)), se2.wrap(turns)])
    assert known.allows(now, poses).tolist() == [True, True, False, False]


def test_small_leaps_do_not_add_up() -> None:
    """The way over a second is bound as a whole: each step errs by less than the slack."""
    known, now = after([0.1 * k for k in range(12)], step=0.4)
    assert not known.allows(now, np.array([[0.4 * 11, 0.0, 0.0]]))[0]
    slow, now = after([0.1 * k for k in range(12)], step=0.2)
    assert slow.allows(now, np.array([[0.2 * 11, 0.0, 0.0]]))[0]


@pytest.mark.parametrize("late", [0.0, -0.9, 0.001])
def test_a_stamp_that_repeats_or_runs_back_shortens_no_time(late: float) -> None:
    known, now = after([*(0.6 * k for k in range(20)), 0.6 * 19 + late])
    assert known.allows(now, np.array([[0.6 * P.max_speed, 0.0, 0.0]]))[0]


@pytest.mark.parametrize("stamps", [[0.0] * 5, [np.nan] * 5, [5.0, 4.0, 3.0, 2.0, 1.0]])
def test_stamps_that_tell_no_time_bind_nothing(stamps: list[float]) -> None:
    known, now = after(stamps)
    assert known.interval is None and known.allows(now, np.array([[50.0, 0.0, 3.0]]))[0]


def test_a_pause_takes_its_time() -> None:
    known, now = after([*(0.1 * k for k in range(20)), 11.9])
    assert known.allows(now, np.array([[19.0, 0.0, 0.0]]))[0]
    assert not known.allows(now, np.array([[21.0, 0.0, 0.0]]))[0]


def test_scans_found_again_are_bound_as_well() -> None:
    known, now = after([0.1 * k for k in range(5)])
    there, missed = np.array([0.2, 0.0, 0.0]), scan(2, 0.2)
    assert known.joins(missed, np.zeros(3), now, there)
    assert not known.joins(missed, np.array([-0.7, 0.0, 0.0]), now, there)


def test_a_copy_goes_on_by_itself() -> None:
    known, now = after([0.1 * k for k in range(5)])
    other = known.copy()
    other.placed(now, np.array([9.0, 0.0, 0.0]))
    later = np.array([[9.1, 0.0, 0.0]])
    assert not known.allows(scan(5, 0.5), later)[0]
    assert known.afresh().allows(scan(5, 0.5), later)[0]
    assert known.afresh().interval == known.interval
