"""In a corridor, what can be seen along it holds a robot; it is not slid along the walls.

Sliding along a straight wall changes nothing that the wall can tell. What tells is what stands
across: an end wall, a doorway.
"""

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.tracking.observation import ObservationParameters, observe
from mapweave.mapping.tracking.tracker import Tracker
from mapweave.maps import LineMap
from mapweave.scan.scan import Scan
from tests.mapweave.buildings import FRONT, cast, corridor, walls_of

MIDDLE = 1.1  # [m] of a corridor 2.2 m wide
# Unevenly spaced, 0.5 m deep and more; the ends are out of sight for most of the drives.
DOORWAYS = corridor(
    90.0,
    below=[
        (x, x + 1.0, deep) for x, deep in ((13, 0.5), (19, 0.7), (27, 0.5), (33, 0.6), (42, 0.5))
    ],
    above=[
        (x, x + 1.2, deep) for x, deep in ((11, 0.6), (16, 0.5), (23, 0.6), (30, 0.5), (38, 0.7))
    ],
)
ENDS = corridor(34.0, [], [])
BARE = corridor(200.0, [], [])


def drive(outline: FloatArray, path: FloatArray, noise: Generator) -> FloatArray:
    """Return (n, 3) by how much each scan of a drive was misplaced: along, across, turned.

    `path` (n,) tells how far along [m] the corridor each scan is taken, a little off its middle.
    """
    true = np.column_stack([path, MIDDLE + 0.15 * np.sin(path / 3), 0.05 * np.cos(path / 3)])
    scans = [
        cast(walls_of(outline), pose, index=k, angles=FRONT, noise=noise)
        for k, pose in enumerate(true)
    ]
    tracker = Tracker()
    found = np.array([placed(tracker, scan) for scan in scans])
    off = se2.compose(true[0], found) - true
    off[:, 2] = se2.wrap(off[:, 2])
    return off


def placed(tracker: Tracker, scan: Scan) -> FloatArray:
    found = tracker.place(observe(scan, ObservationParameters()), LineMap.empty)
    assert len(found) == 1, f"scan {scan.index} was not placed"
    return found[0][1].pose


def assert_followed(off: FloatArray, most: float) -> None:
    """Check that no scan is off by more than `most` [m] and 1°."""
    assert np.hypot(*off[:, :2].T).max() < most
    assert np.degrees(np.abs(off[:, 2])).max() < 1


@pytest.mark.parametrize("step", [0.2, 0.6, 1.2])
def test_doorways_hold_a_robot_at_any_speed(step: float, rng: Generator) -> None:
    assert_followed(drive(DOORWAYS, np.arange(14, 14 + 18 * step, step), rng), 0.15)


@pytest.mark.parametrize("step", [0.1, 0.3, 0.5, 1.0])
def test_an_end_wall_in_sight_holds_a_robot_at_any_speed(step: float, rng: Generator) -> None:
    """Two bare walls and an end that is up to 24 m away.

    It is told from where the robot went by few returns; those far along the walls, metres apart,
    must not outvote them by falling on the same places when nothing moves.
    """
    assert_followed(drive(ENDS, np.arange(10, 10 + 20 * step, step), rng), 0.3)


def test_an_end_wall_holds_a_robot_that_changes_its_speed(rng: Generator) -> None:
    """From a crawl to 1 m a scan, to a stop, and back: no motion model knows."""
    speeds = np.concatenate([np.linspace(0.1, 1.0, 12), np.zeros(4), np.full(6, -0.6)])
    assert_followed(drive(ENDS, 14 + np.cumsum(speeds), rng), 0.25)


def test_doorways_hold_a_robot_that_stops_and_turns_back(rng: Generator) -> None:
    speeds = np.concatenate([np.full(12, 0.5), np.zeros(5), np.full(12, -0.5)])
    assert_followed(drive(DOORWAYS, 14 + np.cumsum(speeds), rng), 0.15)


def test_a_leap_along_a_corridor_with_doorways_is_found(rng: Generator) -> None:
    """Twice a robot leaps: 1.4 m where it went 0.3 m a scan, as where scans got lost."""
    steps = np.full(30, 0.3)
    steps[[10, 20]] = 1.4
    assert_followed(drive(DOORWAYS, 14 + np.cumsum(steps), rng), 0.15)


def test_where_nothing_tells_a_robot_goes_on_at_its_pace(rng: Generator) -> None:
    """Past the last doorway two bare walls are all there is, for 25 m."""
    path = np.arange(26, 68, 0.5)
    off = drive(DOORWAYS, path, rng)
    assert np.abs(off[path < 42, 0]).max() < 0.15
    assert np.abs(off[:, 0]).max() < 0.15 * 25


def test_across_a_bare_corridor_a_robot_is_held(rng: Generator) -> None:
    off = drive(BARE, np.arange(90, 100, 0.4), rng)
    assert np.abs(off[:, 1]).max() < 0.1
    assert np.degrees(np.abs(off[:, 2])).max() < 1
