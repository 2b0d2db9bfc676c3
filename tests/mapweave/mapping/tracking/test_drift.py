"""What nothing holds is known as open: it adds up, until what was mapped before holds it again."""

import numpy as np
import pytest

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.mapping.mapper import Mapper
from mapweave.mapping.tracking.drift import Drift, DriftParameters, Pace
from mapweave.maps import RobotMap
from mapweave.scan.points import OrientedPoints
from mapweave.scan.scan import Scan
from tests.mapweave.buildings import AROUND, rectangle, walls_of
from tests.mapweave.mapping.drives import scans_at, straight

SAID, SAID_TURN = 0.25, np.radians(5.0)
PACE = Pace(0.05, 0.1)
AHEAD: FloatArray = np.column_stack([np.linspace(-2, 2, 80), np.ones(80)])
BESIDE: FloatArray = np.tile([0.0, -1.0], (80, 1))
WALL = OrientedPoints(AHEAD, BESIDE, np.zeros(80, dtype=np.int64))
HELD: FloatArray = np.diag([60.0, 60.0, 500.0])
LONG: FloatArray = np.diag([0.0, 60.0, 500.0])  # a wall along x


class Endless:
    """A wall along x, that ends at x = `end` [m] and at -`end`; what is newer goes on or not.

    Attributes
    ----------
    newest, old
        The number of its newest point, and of those up to its end.
    """

    def __init__(self, newest: int, end: float, *, known_end: bool = False, old: int = 9) -> None:
        self.newest, self._old, self._end, self._known_end = newest, old, end, known_end

    def explaining(self, points: OrientedPoints, poses: FloatArray, reach: float) -> IntArray:
        """See `Surroundings`."""
        assert reach < 1.0
        x = points.points[:, 0] + poses[:, :1]
        beyond = -1 if self._known_end else self.newest
        return np.where(np.abs(x) < self._end, self._old, beyond)

    def explained(self, points: OrientedPoints, poses: FloatArray, reach: float) -> BoolArray:
        """See `Surroundings`."""
        return self.explaining(points, poses, reach) >= 0


class Noisy:
    """A wall on which so many points no longer lie when moved aside, and so many others do."""

    newest = 9

    def __init__(self, lost: int, gained: int) -> None:
        self._lost, self._gained = lost, gained

    def explained(self, points: OrientedPoints, poses: FloatArray, reach: float) -> BoolArray:
        """See `Surroundings`."""
        assert reach < 1.0
        explained = np.ones((len(poses), len(points)), dtype=np.bool_)
        explained[0, : self._gained] = False
        explained[1:, self._gained : self._gained + self._lost] = False
        return explained

    def explaining(self, points: OrientedPoints, poses: FloatArray, reach: float) -> IntArray:
        """See `Surroundings`."""
        return np.where(self.explained(points, poses, reach), self.newest, -1)


def told(robot_map: RobotMap) -> FloatArray:
    """Return (n, 4) how surely each scan was placed, in the order of the log."""
    return np.concatenate([np.asarray(s.trajectory.uncertainty) for s in robot_map.submaps])


def mapped(scans: list[Scan]) -> FloatArray:
    mapper = Mapper("a")
    for scan in scans:
        mapper.add(scan)
    return told(mapper.finish())


def usual() -> Pace:
    return PACE


def drifted(scans: int, known: Endless) -> Drift:
    drift = Drift(DriftParameters())
    for k in range(scans):
        drift.follow(np.zeros(2), np.array([0.1 * k, 0.0, 0.0]), LONG, WALL, known, usual)
    return drift


@pytest.mark.parametrize("scans", [20, 200])
def test_along_a_bare_wall_what_is_not_known_of_each_step_adds_up_without_end(scans: int) -> None:
    covariance = drifted(scans, Endless(9, 99.0)).covariance
    assert covariance[0, 0] ** 0.5 == pytest.approx(scans * PACE.way, rel=0.05)
    assert covariance[1, 1] < 1e-9
    assert covariance[2, 2] < 1e-9


def test_one_scan_or_two_that_nothing_holds_are_no_drift() -> None:
    assert not drifted(2, Endless(9, 99.0)).covariance.any()
    assert drifted(3, Endless(9, 99.0)).covariance.any()


@pytest.mark.parametrize(("lost", "gained", "held"), [(8, 0, True), (16, 10, False)])
def test_noisy_points_that_come_and_go_by_chance_hold_nothing(
    lost: int, gained: int, *, held: bool
) -> None:
    drift = Drift(DriftParameters())
    for _ in range(10):
        drift.follow(np.zeros(2), np.zeros(3), LONG, WALL, Noisy(lost, gained), usual)
    assert drift.covariance.any() != held


def test_it_is_over_when_what_was_mapped_before_holds_the_robot_again() -> None:
    drift = drifted(40, Endless(9, 99.0))
    meanwhile = Endless(20, 2.0), Endless(20, 99.0, known_end=True)
    for known in meanwhile:  # what was mapped since goes on, or nothing ends
        drift.follow(np.zeros(2), np.zeros(3), HELD, WALL, known, usual)
        assert drift.covariance.any()
    drift.follow(np.zeros(2), np.zeros(3), HELD, WALL, Endless(20, 2.0, known_end=True), usual)
    assert not drift.covariance.any()


def test_what_was_mapped_when_less_had_drifted_says_where_the_robot_is_as_well_as_then() -> None:
    drift = drifted(20, Endless(9, 99.0))
    for newest in (30, 60):
        for _ in range(20):
            drift.follow(np.zeros(2), np.zeros(3), LONG, WALL, Endless(newest, 99.0), usual)
    before = drift.covariance[0, 0] ** 0.5
    assert before == pytest.approx(60 * PACE.way, rel=0.05)
    doorway = Endless(60, 2.0, known_end=True, old=30)
    drift.follow(np.zeros(2), np.zeros(3), HELD, WALL, doorway, usual)
    assert drift.covariance[0, 0] ** 0.5 == pytest.approx(before)  # one may be held by chance
    for _ in range(DriftParameters().lately):
        drift.follow(np.zeros(2), np.zeros(3), HELD, WALL, doorway, usual)
    assert drift.covariance[0, 0] ** 0.5 == pytest.approx(20 * PACE.way, rel=0.05)


def test_of_a_lidar_of_few_beams_few_points_hold_it() -> None:
    """Three of forty, as twelve of 160."""
    few, drift = WALL.at(slice(None, None, 2)), Drift(DriftParameters())
    for _ in range(10):
        drift.follow(np.zeros(2), np.zeros(3), LONG, few, Noisy(3, 0), usual)
    assert not drift.covariance.any()


def test_a_heading_that_has_drifted_moves_places_with_the_way_that_is_driven() -> None:
    drift = Drift(DriftParameters())
    drift._covariances = np.tile(np.diag([0.0, 0.0, 0.2**2]), (2, 1, 1))
    held = Endless(9, 99.0)
    drift.follow(np.array([3.0, 0.0]), np.array([3.0, 0.0, 0.0]), np.eye(3), WALL, held, usual)
    assert drift.covariance[1, 1] ** 0.5 == pytest.approx(3.0 * 0.2)


def test_the_pace_is_asked_only_where_nothing_holds_the_robot() -> None:
    asked: list[Pace] = []

    def pace() -> Pace:
        asked.append(PACE)
        return PACE

    drift = Drift(DriftParameters())
    drift.follow(np.zeros(2), np.zeros(3), HELD, WALL, Endless(9, 99.0), pace)
    assert not asked
    drift.follow(np.zeros(2), np.zeros(3), LONG, WALL, Endless(9, 99.0), pace)
    assert asked


def test_a_slow_robot_drifts_as_well() -> None:
    slow, drift = Pace(0.004, 0.01), Drift(DriftParameters())
    for k in range(100):
        pose = np.array([0.01 * k, 0.0, 0.0])
        drift.follow(np.zeros(2), pose, LONG, WALL, Endless(9, 99.0), lambda: slow)
    assert drift.covariance[0, 0] ** 0.5 == pytest.approx(100 * slow.way, rel=0.05)


def test_a_closed_loop_ends_what_had_drifted_before_and_not_what_has_since() -> None:
    drift = drifted(40, Endless(9, 99.0))
    drift.mark()
    for _ in range(10):
        drift.follow(np.zeros(2), np.zeros(3), LONG, WALL, Endless(9, 99.0), usual)
    drift.end()
    assert drift.covariance[0, 0] ** 0.5 == pytest.approx(10 * PACE.way)


def test_a_bare_corridor_is_open_along_and_its_end_is_not() -> None:
    way = straight(np.array([0.0, 0.0]), np.array([24.0, 0.0]), 0.1)
    corridor = walls_of(rectangle(-30, -1, 60, 1.2))
    bare = mapped(scans_at(corridor, way, 0.25, max_range=6.0))
    assert bare[-1, 0] > 4.0
    assert abs(np.sin(bare[-1, 3])) < np.sin(np.radians(10))
    short = walls_of(rectangle(-8, -1, 26, 1.2))
    ended = mapped(scans_at(short, way[:100], 0.25, max_range=90.0))
    assert (ended[:, 0] < SAID).all()


def test_in_a_round_room_the_heading_is_open_and_in_a_square_one_it_is_not() -> None:
    turns = np.linspace(0, 2, 60)
    way = np.column_stack([2 * np.cos(turns), 2 * np.sin(turns), turns + np.pi / 2])
    corners = np.linspace(0, 2 * np.pi, 240, endpoint=False)
    round_room = walls_of(4 * np.column_stack([np.cos(corners), np.sin(corners)]))
    assert mapped(scans_at(round_room, way, 0.1, angles=AROUND))[-1, 2] > 2 * SAID_TURN
    square = mapped(scans_at(walls_of(rectangle(-4, -4, 4, 3.5)), way, 0.1, angles=AROUND))
    assert (square[:, 2] < SAID_TURN).all()


def test_a_scan_that_may_be_elsewhere_along_a_wall_may_be_off_by_half_of_that_at_once() -> None:
    """Until what was mapped before it holds the robot again, and by no more for each other one."""
    drift, ends = Drift(DriftParameters()), Endless(9, 2.0, known_end=True)
    drift.follow(np.zeros(2), np.zeros(3), LONG, WALL, ends, usual, 2.0)
    np.testing.assert_allclose(drift.covariance, np.diag([1.0, 0.0, 0.0]), atol=1e-9)
    drift.follow(np.zeros(2), np.zeros(3), LONG, WALL, ends, usual, 2.0)
    assert drift.covariance[0, 0] == pytest.approx(2.0)
    drift.follow(np.zeros(2), np.zeros(3), HELD, WALL, ends, usual)
    assert np.abs(drift.covariance).max() < 1e-9
