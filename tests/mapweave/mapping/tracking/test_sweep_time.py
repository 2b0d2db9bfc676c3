"""How long sweeps take where nobody says."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from mapweave.config import Config, Mapping
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.backend import BackendRunner, FinishedSubmap
from mapweave.mapping.mapper import Mapper, MapperParameters
from mapweave.mapping.tracking.observation import ObservationParameters, observe
from mapweave.mapping.tracking.sweep_time import SweepParameters, set_right
from mapweave.maps import RobotMap, Submap
from mapweave.scan.scan import Scan
from tests.mapweave.buildings import BUILDING, OTHER_BUILDING, cast, walls_of
from tests.mapweave.mapping.drives import tracks
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


def worst_turn(robot_map: RobotMap) -> float:
    """[rad] by which headings are off, of scans that were all placed in one component."""
    ((index, poses),) = tracks(robot_map)
    true = np.array([looking_about(k / RATE) for k in index])
    return float(np.ptp(se2.wrap(poses[:, 2] - true[:, 2])))


def in_submaps_of(count: int, backend: BackendRunner | None = None) -> Mapper:
    """Return a mapper whose submaps are finished after so many scans."""
    config = Config(mapping=Mapping(submap_scans=count))
    return Mapper(config=config, backend=backend, parameters=MapperParameters.of(config))


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
    assert worst_turn(mapped(found).finish()) < 0.5 * worst_turn(silent.finish())


def test_finished_submaps_are_mapped_once_more_as_well() -> None:
    mapper, finished = in_submaps_of(15), 0
    for scan in scans(ONCE, 60):
        known = mapper._sweeps.sweep != 0.0
        finished = finished if known else len(mapper.robot_map().submaps) - 1
        mapper.add(scan)
    assert finished >= 2
    again = mapper.finish()
    assert [s.id for s in again.submaps] == list(range(len(again.submaps)))
    assert sorted(k for s in again.submaps for k in s.trajectory.scan_index) == list(range(60))
    stated = in_submaps_of(15)
    for scan in scans(ONCE, 60):
        stated.add(replace(scan, sweep=ONCE))
    assert worst_turn(again) < 1.1 * worst_turn(stated.finish())


class Stays:
    """Leaves submaps as they were tracked, and does not begin anew."""

    is_ready = True

    def begin(self, finished: FinishedSubmap) -> None:
        """Nothing is settled."""

    def take(self) -> None:
        """There is no outcome."""

    def restart(self) -> bool:
        """Not."""
        return False


def test_where_nothing_is_settled_anew_finished_submaps_stay_as_they_are() -> None:
    mapper, finished = in_submaps_of(15, Stays()), list[Submap]()
    for scan in scans(ONCE, 60):
        finished = finished if mapper._sweeps.sweep else list(mapper.robot_map().submaps[:-1])
        mapper.add(scan)
    assert len(finished) >= 2
    for before, after in zip(finished, mapper.finish().submaps, strict=False):
        np.testing.assert_array_equal(before.trajectory.pose, after.trajectory.pose)


def test_components_that_are_mapped_once_more_take_numbers_that_were_never_given() -> None:
    """Who remembers what was said of component 1 never takes another place for it."""
    elsewhere = cast(walls_of(OTHER_BUILDING), np.array([5.0, 1.5, 0.0]), angles=FRONT)
    away = [replace(elsewhere, index=k, stamp=k / RATE) for k in range(12)]
    here = [replace(s, index=12 + s.index, stamp=s.stamp + 1.2) for s in scans(ONCE, 60)]
    mapper, given = in_submaps_of(15), set[int]()
    for scan in [*away, *here]:
        is_known = mapper._sweeps.sweep != 0.0
        component = mapper.add(scan).component
        given |= set() if is_known else {component}
    first, *others = mapper.finish().components
    assert first == 0
    assert others
    assert len(given) > 1
    assert min(others) > max(given)


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
