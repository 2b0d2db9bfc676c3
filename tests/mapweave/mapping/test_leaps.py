"""No step is taken that a robot cannot make, whatever it scores."""

from dataclasses import replace

import numpy as np
import pytest

from mapweave.mapping.mapper import Mapper
from tests.mapweave.buildings import BUILDING, walls_of
from tests.mapweave.mapping.drives import (
    WIDE,
    colonnade,
    errors,
    longest_step,
    mapped,
    scans_at,
    straight,
)


@pytest.mark.parametrize(
    ("pitch", "step", "interval", "seed"),
    [
        (0.9, 0.1, 0.1, 0),
        (0.9, 0.05, 0.05, 1),
        (1.2, 0.12, 0.1, 2),
        (0.8, 0.1, 0.1, 3),
        (1.0, 0.06, 0.1, 4),
    ],
)
def test_a_robot_between_look_alike_pillars_takes_no_leap(
    pitch: float, step: float, interval: float, seed: int
) -> None:
    true = straight(np.zeros(2), np.array([4.0, 0.0]), step)
    walls = colonnade(pitch)
    robot_map = mapped(
        scans_at(walls, true, interval, angles=WIDE, max_range=4.0, lost=0.5, seed=seed)
    )
    assert longest_step(robot_map) < 2.0 * interval + 0.25
    off = errors(robot_map, true)
    assert len(off) > 0.9 * len(true) and np.hypot(off[:, 0], off[:, 1]).max() < 0.3


@pytest.mark.parametrize(("timed", "placed"), [(True, True), (False, False)])
def test_where_stamps_tell_no_time_the_pace_bounds_a_step(timed: bool, placed: bool) -> None:
    """1.2 m between steps of 0.1 m: in a second a robot may, in a step of its own it does not."""
    way = straight(np.array([2.0, 1.0]), np.array([5.0, 1.0]), 0.1)
    true = np.vstack([way, way[-1] + np.array([1.2, 0.0, 0.0])])
    scans = scans_at(walls_of(BUILDING), true, 1.0)
    mapper = Mapper("a")
    for scan in scans if timed else [replace(scan, stamp=np.nan) for scan in scans]:
        last = mapper.add(scan)
    assert last.placed == placed
