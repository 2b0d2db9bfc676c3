"""What time lies between scans is found out from stamps of every kind."""

import numpy as np
import pytest

from mapweave.scan.clock import ScanClock
from mapweave.scan.scan import Scan


def scan(index: int, stamp: float) -> Scan:
    return Scan([1.0, 1.0], [0.0, 0.1], index, stamp)


def ticked(stamps: list[float]) -> ScanClock:
    clock = ScanClock()
    for index, stamp in enumerate(stamps):
        clock.tick(scan(index, stamp))
    return clock


@pytest.mark.parametrize("rate", [4.0, 10.0, 40.0])
@pytest.mark.parametrize("batch", [1, 2, 3, 4, 7, 10, 16])
def test_scans_that_come_in_batches_take_as_long_as_evenly_spaced_ones(
    rate: float, batch: int
) -> None:
    stamps = [k // batch * batch / rate + k % batch * 0.0005 for k in range(200)]
    told = [ticked(stamps[:count]).interval for count in range(64, 200)]
    assert all(interval is not None and 0.8 < interval * rate < 1.4 for interval in told)


@pytest.mark.parametrize("seed", range(5))
def test_jitter_a_pause_and_a_clock_that_is_set_change_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    stamps = 0.1 * np.arange(100) + rng.uniform(-0.03, 0.03, 100)
    stamps[50:] += rng.choice([20.0, 1e6, -1e6])
    interval = ticked(stamps.tolist()).interval
    assert interval == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize("step", [0.0, 1e-6, 0.0005, -0.1, np.nan])
def test_stamps_at_which_no_lidar_spins_tell_no_time(step: float) -> None:
    clock = ticked([5.0 + step * k for k in range(100)])
    assert clock.interval is None


def test_a_scan_that_is_missing_takes_its_time() -> None:
    clock = ticked([0.1 * k for k in range(30)])
    assert clock.since(25, 2.5, scan(30, 2.51)) == pytest.approx(0.5)  # by their numbers
    assert clock.since(25, 2.5, scan(26, 9.5)) == pytest.approx(7.0)  # by their stamps
    assert clock.since(25, 2.5, scan(30, np.nan)) == pytest.approx(0.5)


def test_a_copy_goes_on_by_itself_and_one_afresh_knows_the_interval() -> None:
    clock = ticked([0.1 * k for k in range(30)])
    other = clock.copy()
    other.tick(scan(30, 99.0))
    afresh = clock.afresh()
    afresh.tick(scan(900, 5000.0))
    assert clock.interval == other.interval == afresh.interval == pytest.approx(0.1)


@pytest.mark.parametrize("at", [3, 12, 20, 45])
@pytest.mark.parametrize("second", [0, 30])
def test_pauses_are_no_batches(at: int, second: int) -> None:
    stamps = 0.1 * np.arange(120)
    stamps[at:] += 60.0
    if second:
        stamps[at + second :] += 15.0
    told = [ticked(stamps[:count].tolist()).interval for count in range(12, 120)]
    assert all(interval == pytest.approx(0.1) for interval in told)


def test_steps_take_what_stamps_say_and_in_batches_what_scans_usually_take() -> None:
    clock = ticked([0.1 * k for k in range(30)])
    assert clock.until(scan(30, 2.93), scan(29, 2.9)) == pytest.approx(0.03)
    assert clock.until(scan(30, 5.9), scan(29, 2.9)) == pytest.approx(3.0)
    assert clock.until(scan(30, 2.0), scan(29, 2.9)) == 0.0
    batched = ticked([k // 10 + k % 10 * 0.002 for k in range(70)])
    step = batched.until(scan(66, 6.012), scan(65, 6.01))
    assert step == batched.interval == pytest.approx(0.1, abs=0.03)
