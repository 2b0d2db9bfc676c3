"""What lies between two scans takes its time: a robot that was blind may be anywhere in reach."""

import numpy as np
import pytest

from mapweave.mapping.mapper import Mapper
from tests.mapweave.buildings import rectangle, walls_of
from tests.mapweave.mapping.drives import errors, mapped, scans_at, straight, tracks

WALLS = walls_of(rectangle(0, 0, 9, 6))


@pytest.mark.parametrize(
    ("width", "depth", "sight", "step"),
    [
        (14, 9, 3.5, 0.2),
        (13, 11, 3.8, 0.25),
        (16, 12, 4.0, 0.2),
        (12, 12, 3.5, 0.15),
        (20, 18, 4.5, 0.3),
    ],
)
def test_a_robot_that_was_blind_for_long_is_not_where_it_was_before(
    width: float, depth: float, sight: float, step: float
) -> None:
    """Each corner of a bare hall looks like the next: on neither side of the gap is one wrong."""
    start, end = np.array([1.5, 1.3]), np.array([width - 1.5, depth - 1.3])
    true = straight(start, end, step)
    walls = walls_of(rectangle(0, 0, width, depth))
    robot_map = mapped(scans_at(walls, true, 0.4, max_range=sight))
    assert len(robot_map.components) > 1
    off = errors(robot_map, true)
    assert np.hypot(off[:, 0], off[:, 1]).max() < 0.3
    assert np.degrees(np.abs(off[:, 2])).max() < 3
    for index, _ in tracks(robot_map):
        assert index == list(range(index[0], index[-1] + 1))  # both sides are mapped whole


def test_a_robot_that_is_blind_before_it_sees_anything_has_lost_nothing() -> None:
    true = straight(np.array([2.0, 2.0]), np.array([4.0, 2.0]), 0.2)
    scans = scans_at(WALLS, true, 0.4)
    blind = scans_at(WALLS, true, 0.4, max_range=0.1)
    mapper = Mapper("a")
    placements = [mapper.add(scan) for scan in blind]
    assert not any(p.lost or p.placed for p in placements)
    for k, scan in enumerate(scans):
        assert mapper.add(type(scan)(scan.ranges, scan.angles, len(blind) + k, scan.stamp)).placed


@pytest.mark.parametrize("blind", [1, 2, 4])
def test_a_few_blind_scans_are_got_over_once_the_next_scan_but_one_confirms(blind: int) -> None:
    true = straight(np.array([2.0, 2.0]), np.array([6.0, 2.5]), 0.2)
    scans = scans_at(WALLS, true, 0.4)
    nothing = scans_at(WALLS, true, 0.4, max_range=0.1)
    mapper = Mapper("a")
    seen = [*scans[:8], *nothing[8 : 8 + blind], *scans[8 + blind :]]
    placements = [mapper.add(scan) for scan in seen]
    assert not placements[8 + blind].placed and placements[9 + blind].placed
    robot_map = mapper.finish()
    assert robot_map.components == [0]
    off = errors(robot_map, true)
    assert len(off) == len(scans) - blind and np.abs(off[:, :2]).max() < 0.1


def test_a_doubtful_scan_before_a_gap_is_looked_for_where_it_can_have_been_taken() -> None:
    """On probation when the robot goes blind for good: it is not lost, and found by itself."""
    true = straight(np.array([2.0, 2.0]), np.array([6.0, 2.5]), 0.2)
    scans = scans_at(WALLS, true, 0.4)
    nothing = scans_at(WALLS, true, 0.4, max_range=0.1)
    robot_map = mapped([*scans[:5], nothing[5], scans[6], *nothing[7:15], *scans[15:]])
    parts = [index for index, _ in tracks(robot_map)]
    assert parts == [[0, 1, 2, 3, 4, 6], [*range(15, len(scans))]]
    off = errors(robot_map, true)
    assert np.abs(off[:, :2]).max() < 0.1
