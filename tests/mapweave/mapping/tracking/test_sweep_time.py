"""How long sweeps take where nobody says."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.mapper import Mapper, MapperParameters
from mapweave.mapping.tracking.observation import ObservationParameters, observe
from mapweave.mapping.tracking.sweep_time import SweepParameters, set_right
from mapweave.scan.scan import Scan
from tests.mapweave.buildings import BUILDING, cast, walls_of
from tests.mapweave.mapping.tracking.test_deskewing import FRONT, swept

RATE = 10.0  # [Hz]
ONCE = (FRONT[-1] - FRONT[0]) / (2 * np.pi) / RATE  # [s] a sweep of a mirror that spins once
NOISE = 0.02  # [m]


def looking_about(t: float) -> FloatArray:
    """Along a corridor, looking left and right, faster and faster, up to 90° a second."""
    return np.array([3.0 + 0.3 * t, 1.1, 0.8 * np.sin(2.0 * t)])


def scans(sweep: float, count: int) -> list[Scan]:
    """Return what a lidar sees, which says nothing of its sweep; 0: all at once."""
    rng = np.random.default_rng(3)
    found = []
    for k in range(count):
        stamp = k / RATE
        if sweep == 0:
            seen = cast(walls_of(BUILDING), looking_about(stamp), angles=FRONT)
        else:
            seen = swept(looking_about, stamp - abs(sweep) / 2, FRONT, sweep)
        ranges = seen.ranges + rng.normal(0.0, NOISE, len(FRONT))
        found.append(Scan(np.where(ranges < 4.0, ranges, np.nan), FRONT, k, stamp))
    return found


def mapped(found: list[Scan], say: Callable[[str], None] | None = None) -> Mapper:
    """Return what has mapped them."""
    mapper = Mapper(on_warning=say)
    for scan in found:
        mapper.add(scan)
    return mapper


def worst_turn(mapper: Mapper) -> float:
    """[rad] by which headings are off, of scans that were all placed in one submap."""
    (submap,) = mapper.finish().submaps
    path = submap.trajectory
    true = np.array([looking_about(k / RATE) for k in path.scan_index])
    off = se2.wrap(path.pose[:, 2] + submap.pose[2] - true[:, 2])
    return float(np.ptp(off))


@pytest.mark.parametrize("sweep", [ONCE, -ONCE], ids=["counter-clockwise", "clockwise"])
def test_a_lidar_that_spins_once_a_scan_is_found_out_where_the_robot_turns(sweep: float) -> None:
    said: list[str] = []
    mapper = mapped(scans(sweep, 110), said.append)
    assert mapper._sweeps.sweep == pytest.approx(sweep, rel=0.01)
    assert len(said) == 1
    assert "0.067 s from its first beam to the last" in said[0]


@pytest.mark.parametrize("sweep", [0.0, ONCE / 4], ids=["at once", "four times a scan"])
def test_a_lidar_that_does_not_spin_once_a_scan_is_left_as_it_is(sweep: float) -> None:
    assert mapped(scans(sweep, 110))._sweeps.sweep == 0.0


def test_what_was_mapped_before_a_sweep_was_known_is_mapped_once_more() -> None:
    found = scans(ONCE, 60)
    silent = Mapper(parameters=MapperParameters(sweeps=SweepParameters(enough=1000)))
    for scan in found:
        silent.add(scan)
    assert worst_turn(mapped(found)) < 0.5 * worst_turn(silent)


def test_a_sweep_that_a_scan_states_is_not_asked_for() -> None:
    stated = [replace(scan, sweep=ONCE) for scan in scans(ONCE, 40)]
    mapper = mapped(stated)
    assert not mapper._sweeps.is_open
    assert mapper._sweeps.sweep == 0.0


def test_scans_too_far_apart_for_a_mirror_tell_nothing() -> None:
    slow = [replace(scan, stamp=5 * scan.stamp) for scan in scans(ONCE, 60)]
    mapper = mapped(slow)
    assert mapper._sweeps.is_open
    assert mapper._sweeps.sweep == 0.0


def test_points_are_set_right_as_a_scan_is() -> None:
    velocity = np.array([0.5, 0.0, 1.5])
    parameters = ObservationParameters()
    still = cast(walls_of(BUILDING), straight_on(0.0), angles=FRONT)
    squeezed = observe(swept(straight_on, -ONCE / 2, FRONT, ONCE), parameters)
    right = set_right(squeezed.oriented, FRONT, velocity, ONCE)

    def off(points: FloatArray) -> float:
        bearing = np.arctan2(points[:, 1], points[:, 0])
        ranges = np.interp(bearing, FRONT, still.ranges)
        return float(np.nanmedian(np.abs(np.hypot(*points.T) - ranges)))

    assert off(right.points) < 0.2 * off(squeezed.oriented.points)


def straight_on(t: float) -> FloatArray:
    """Forward at 0.5 m/s and round at 1.5 rad/s, for a moment."""
    return np.array([13.0 + 0.5 * t, 0.9, 1.5 * t])
