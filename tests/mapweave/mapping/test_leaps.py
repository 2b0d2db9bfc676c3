"""No step is taken that a robot cannot make, whatever it scores."""

import numpy as np
import pytest

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
