"""Drives on which a robot was wrong without a word, as they were reported."""

from pathlib import Path

import numpy as np

from mapweave.io.readers import read_scans
from mapweave.maps import RobotMap
from tests.mapweave.mapping.drives import longest_step, mapped, tracks

CASES = Path(__file__).parents[2] / "cases"


def map_of(case: str, log: str) -> RobotMap:
    return mapped(list(read_scans(CASES / case / log)))


def test_the_corner_after_a_gap_is_not_laid_on_the_corner_before_it() -> None:
    """Both look alike; between them the robot drove 6 m and saw nothing."""
    found = list(tracks(map_of("blind_gap", "gap.log.gz")))
    before, after = [*range(17)], [*range(46, 65)]
    assert sorted(index for index, _ in found) == [before, after]


def test_a_robot_between_pillars_goes_as_far_as_it_drove() -> None:
    """A metre a second and ten scans a second, straight on: 3.9 m, and no leap on the way."""
    robot_map = map_of("leap_in_colonnade", "colonnade.log.gz")
    ((index, poses),) = tracks(robot_map)
    assert index == [*range(40)]
    assert longest_step(robot_map) < 0.3
    assert abs(np.hypot(*(poses[-1] - poses[0])[:2]) - 3.9) < 0.2
