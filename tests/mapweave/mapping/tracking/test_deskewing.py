"""Beams that were taken one after the other, by a robot on its way."""

from collections.abc import Callable

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.mapper import Mapper, MapperParameters
from mapweave.mapping.tracking.deskewing import Deskewer, deskewed
from mapweave.mapping.tracking.sweep_time import SweepParameters
from mapweave.scan.mounting import Mounting
from mapweave.scan.scan import Scan
from tests.mapweave.buildings import BUILDING, cast, walls_of

AROUND = np.radians(np.arange(-180.0, 180.0, 0.5))
FRONT = np.radians(np.arange(-120.0, 120.5, 0.5))
SWEEP = 0.1  # [s]
PIECES = 48  # of a sweep, each of which is taken at once
Way = Callable[[float], FloatArray]


def swept(way: Way, stamp: float, angles: FloatArray, sweep: float = SWEEP, index: int = 0) -> Scan:
    """Return what a laser sees whose first beam is taken at `stamp`; clockwise where negative."""
    walls = walls_of(BUILDING)
    ranges = np.full(len(angles), np.nan)
    order = np.arange(len(angles)) if sweep > 0 else np.arange(len(angles))[::-1]
    taken = 0
    for piece in np.array_split(order, PIECES):
        middle = (taken + len(piece) / 2) / len(angles)
        taken += len(piece)
        seen = cast(walls, way(stamp + middle * abs(sweep)), angles=np.sort(angles[piece]))
        ranges[np.sort(piece)] = seen.ranges
    return Scan(ranges, angles, index, stamp, sweep=sweep)


def turning(t: float) -> FloatArray:
    """Forward at 1 m/s and round at 1.5 rad/s."""
    x, y = np.sin(1.5 * t) / 1.5, (1 - np.cos(1.5 * t)) / 1.5
    return np.array([13.0 + x, 0.9 + y, 1.5 * t])


def weaving(t: float) -> FloatArray:
    """Along the corridor at 0.8 m/s, looking left and right as fast as 1.2 rad/s."""
    return np.array([2.0 + 0.8 * t, 1.1 + 0.3 * np.sin(0.5 * t), 0.8 * np.sin(1.5 * t)])


@pytest.mark.parametrize("sweep", [SWEEP, -SWEEP])
@pytest.mark.parametrize("angles", [AROUND, FRONT], ids=["around", "front"])
def test_a_scan_is_as_if_taken_at_once_in_mid_sweep(sweep: float, angles: FloatArray) -> None:
    velocity = np.array([1.0, 0.0, 1.5])
    still = cast(walls_of(BUILDING), turning(SWEEP / 2), angles=angles)
    skewed = swept(turning, 0.0, angles, sweep)
    straight = deskewed(skewed, velocity)
    assert straight.sweep == 0.0
    np.testing.assert_array_equal(straight.angles, angles)

    def median_error(scan: Scan) -> float:
        return float(np.nanmedian(np.abs(scan.ranges - still.ranges)))

    assert median_error(straight) < 0.01 < 0.04 < median_error(skewed)


def test_returns_come_only_from_where_something_was_seen() -> None:
    scan = Scan(np.full(181, np.nan), np.radians(np.arange(-90.0, 91.0)), sweep=0.1)
    assert not deskewed(scan, np.array([1.0, 0.5, 2.0])).hits.any()
    ranges = np.full(181, np.nan)
    ranges[80:100] = 3.0
    found = deskewed(Scan(ranges, scan.angles, sweep=0.1), np.array([0.0, 0.0, 1.0]))
    assert 15 <= found.hits.sum() <= 22
    np.testing.assert_allclose(found.ranges[found.hits], 3.0)


def drive(way: Way, seconds: float, period: float, *, told: bool) -> FloatArray:
    """Map a drive; return how far off each step of a second is found [m], [rad]."""
    given = MapperParameters(sweeps=SweepParameters(enough=1000))  # which asks for more turns
    mapper, found, true = Mapper(parameters=given), [], []
    for k in range(int(seconds / period)):
        scan = swept(way, k * period, AROUND, index=k)
        if not told:
            scan = Scan(scan.ranges, scan.angles, k, scan.stamp)
        placement = mapper.add(scan)
        assert placement.pose is not None
        found.append(placement.pose)
        true.append(way(k * period))
    second = round(1 / period)
    steps = [se2.between(np.array(p[:-second]), np.array(p[second:])) for p in (found, true)]
    x, y, turn = se2.between(steps[1], steps[0]).T
    return np.array([np.median(np.hypot(x, y)), np.median(np.abs(turn))])


def test_a_weaving_robot_is_placed_better_where_it_is_known_when_beams_were_taken() -> None:
    told, untold = (drive(weaving, 12.0, 0.1, told=each) for each in (True, False))
    assert told[0] < 0.7 * untold[0]
    assert told[1] < 0.5 * untold[1]


def at(stamp: float, index: int = 0) -> Scan:
    """Return a scan that was taken then."""
    return Scan([2.0, 2.0], [0.0, 0.1], index, stamp)


def go(deskewer: Deskewer, stamp: float, index: int, pose: list[float]) -> None:
    """Have a scan taken, and placed."""
    deskewer.placed(deskewer.straight(at(stamp, index)), np.array(pose))


def test_the_robots_velocity_is_that_of_its_last_step_and_odometry_goes_before_it() -> None:
    angles = np.radians(np.arange(-45.0, 46.0))
    scan = Scan(np.full(91, 2.0), angles, stamp=0.2, sweep=0.1)
    deskewer = Deskewer()
    unknown = deskewer.straight(scan)
    assert unknown.stamp == pytest.approx(0.25)
    assert unknown.sweep == 0.0
    np.testing.assert_array_equal(unknown.ranges, scan.ranges)
    go(deskewer, 0.0, 0, [0.0, 0.0, 0.0])
    go(deskewer, 0.1, 1, [0.1, 0.0, 0.0])
    by_track = deskewer.straight(scan)
    np.testing.assert_allclose(by_track.ranges, deskewed(scan, np.array([1.0, 0, 0])).ranges)
    np.testing.assert_allclose(deskewer.to_stamp, [-0.05, 0.0, 0.0], atol=1e-12)
    told = [
        Scan(scan.ranges, angles, stamp=stamp, sweep=0.1, odometry=[x, 0.0, 0.0])
        for stamp, x in ((0.2, 5.0), (0.3, 5.05))
    ]
    deskewer.straight(told[0])
    by_odometry = deskewer.straight(told[1])
    expected = deskewed(scan, np.array([0.5, 0, 0])).ranges
    np.testing.assert_allclose(by_odometry.ranges, expected)


@pytest.mark.parametrize("stamps", [(0.0, 0.0), (1.0, 0.5), (0.0, 3.0), (np.nan, np.nan)])
def test_stamps_that_tell_no_time_tell_no_velocity(stamps: tuple[float, float]) -> None:
    scan = Scan(np.full(91, 2.0), np.radians(np.arange(-45.0, 46.0)), stamp=4.0, sweep=0.1)
    deskewer = Deskewer()
    for k, stamp in enumerate(stamps):
        go(deskewer, stamp, k, [k * 1.0, 0.0, 0.5 * k])
    np.testing.assert_array_equal(deskewer.straight(scan).ranges, scan.ranges)


def test_scans_that_come_in_batches_tell_the_velocity_of_evenly_spaced_ones() -> None:
    """Ten scans of 10 Hz within 20 ms, each second: what was driven takes the time it takes."""
    angles = np.radians(np.arange(-45.0, 46.0))
    deskewer = Deskewer()
    for k in range(60):
        stamp = k // 10 + k % 10 * 0.002
        straight = deskewer.straight(Scan(np.full(91, 2.0), angles, k, stamp, sweep=0.1))
        deskewer.placed(straight, np.array([0.05 * k, 0.0, 0.0]))
    np.testing.assert_allclose(deskewer.to_stamp, [-0.025, 0.0, 0.0], atol=0.008)


def test_one_that_starts_afresh_knows_how_long_scans_take() -> None:
    before = Deskewer()
    for k in range(20):
        go(before, 0.1 * k, k, [0.05 * k, 0.0, 0.0])
    deskewer = before.afresh()
    deskewer.placed(at(2.0, 20), np.zeros(3))  # which waited, and was straightened before
    deskewer.placed(at(2.1, 21), np.array([0.05, 0.0, 0.0]))
    deskewer.straight(
        Scan(np.full(91, 2.0), np.radians(np.arange(-45.0, 46.0)), 22, 2.2, sweep=0.1)
    )
    np.testing.assert_allclose(deskewer.to_stamp, [-0.025, 0.0, 0.0], atol=1e-6)


def test_a_robot_that_hardly_moves_is_left_as_it_is() -> None:
    scan = Scan(np.full(91, 2.0), np.radians(np.arange(-45.0, 46.0)), stamp=0.2, sweep=0.1)
    deskewer = Deskewer()
    go(deskewer, 0.0, 0, [0.0, 0.0, 0.0])
    go(deskewer, 0.1, 1, [0.002, 0.001, 0.0005])
    np.testing.assert_array_equal(deskewer.straight(scan).ranges, scan.ranges)


def test_a_scan_of_one_instant_is_not_touched() -> None:
    scan = Scan(np.full(91, 2.0), np.radians(np.arange(-45.0, 46.0)), stamp=0.2)
    deskewer = Deskewer()
    go(deskewer, 0.0, 0, [0.0, 0.0, 0.0])
    go(deskewer, 0.1, 1, [0.1, 0.0, 0.2])
    assert deskewer.straight(scan) is scan
    assert not deskewer.to_stamp.any()


def test_a_sweep_is_turned_round_with_the_beams() -> None:
    scan = Scan.of([1.0, 2.0, 3.0], 0.2, -0.1, time_increment=0.01)
    assert scan.angles[0] < scan.angles[-1]
    assert scan.sweep == pytest.approx(-0.02)
    hung = Mounting(upside_down=True).turned(scan)
    assert hung.sweep == pytest.approx(0.02)
    assert Mounting(theta=0.3).turned(scan).sweep == pytest.approx(-0.02)
