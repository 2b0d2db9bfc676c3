"""A robot is lost when what it sees is a place of its own, or nothing: not when people stand by."""

import numpy as np
from numpy.random import Generator

from mapweave.mapping.tracking.loss import LONGER, Loss
from mapweave.mapping.tracking.observation import ObservationParameters, observe
from mapweave.mapping.tracking.tracker import Tracker
from mapweave.maps import LineMap
from mapweave.scan.scan import Scan
from tests.mapweave.buildings import FRONT, cast, rectangle, walls_of

HALL = walls_of(rectangle(-6, -4, 7, 5))
ROOM = walls_of(np.array([[-1.5, -1.0], [2.5, -1.0], [2.5, 0.5], [1.5, 2.0], [-1.5, 2.0]]))
PATIENCE = 5


class Robot:
    """One that has looked around in a hall."""

    def __init__(self) -> None:
        self.tracker, self.loss = Tracker(), Loss(PATIENCE)
        for k in range(6):
            assert not self.is_lost_after(cast(HALL, [0.1 * k, 0, 0], index=k))
        assert not self.tracker.missed

    def is_lost_after(self, scan: Scan) -> bool:
        """Follow it to a scan; return whether it is lost then."""
        seen = observe(scan, ObservationParameters())
        found = self.tracker.place(seen, LineMap.empty)
        self.loss.note(seen, self.tracker, placed=any(each is seen for each, _ in found))
        return self.loss.is_certain(len(self.tracker.missed), PATIENCE)


def crowd(rng: Generator, index: int) -> Scan:
    """Return a scan of nothing but people close by, who were elsewhere a moment ago."""
    ranges = rng.uniform(0.5, 1.5, 30)
    return Scan(np.repeat(ranges, 7)[: len(FRONT)], FRONT, index, float(index))


def test_one_whose_scans_fit_each_other_elsewhere_is_lost_once_patience_is_over() -> None:
    robot = Robot()
    scans = [cast(ROOM, [0.1 * k, 0, 0], index=6 + k) for k in range(PATIENCE)]
    assert [robot.is_lost_after(scan) for scan in scans] == [False] * (PATIENCE - 1) + [True]


def test_one_that_sees_nothing_is_lost_once_patience_is_over() -> None:
    robot, nothing = Robot(), np.full(len(FRONT), np.nan)
    scans = [Scan(nothing, FRONT, 6 + k, 6.0 + k) for k in range(PATIENCE)]
    assert [robot.is_lost_after(scan) for scan in scans] == [False] * (PATIENCE - 1) + [True]


def test_one_whose_scans_fit_nothing_is_looked_for_longer_and_then_lost(rng: Generator) -> None:
    robot = Robot()
    scans = [crowd(rng, 6 + k) for k in range((1 + LONGER) * PATIENCE)]
    *before, last = [robot.is_lost_after(scan) for scan in scans]
    assert last and not any(before)


def test_one_that_is_found_again_begins_anew_with_its_patience(rng: Generator) -> None:
    robot = Robot()
    for k in range(2 * PATIENCE):
        assert not robot.is_lost_after(crowd(rng, 6 + k))
    for k in range(2):  # the second one confirms the first
        assert not robot.is_lost_after(cast(HALL, [0.6, 0, 0], index=16 + k))
    assert not robot.tracker.missed
    assert not any(robot.is_lost_after(crowd(rng, 18 + k)) for k in range(2 * PATIENCE))
