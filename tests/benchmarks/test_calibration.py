"""The share of steps within 2 sigma is that of the errors that were made."""

import numpy as np
import pytest
from numpy.random import Generator

from benchmarks.calibration import within_two_sigma
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory

SCANS = 4000


def mapped(truth: FloatArray, rng: Generator, factor: float) -> RobotMap:
    """Return a map whose poses err by `factor` times what they say, in a frame of its own."""
    told = np.column_stack(
        [
            rng.uniform(0.1, 0.3, SCANS),
            rng.uniform(0.01, 0.03, SCANS),
            rng.uniform(0.001, 0.003, SCANS),
            rng.uniform(-np.pi / 2, np.pi / 2, SCANS),
        ]
    )
    pose = se2.compose([3.0, -2.0, 1.1], truth)
    error = factor * told[:, :3] * rng.normal(size=(SCANS, 3))
    pose[:, 0] += error[:, 0] * np.cos(told[:, 3]) - error[:, 1] * np.sin(told[:, 3])
    pose[:, 1] += error[:, 0] * np.sin(told[:, 3]) + error[:, 1] * np.cos(told[:, 3])
    pose[:, 2] += error[:, 2]
    trajectory = Trajectory(np.arange(SCANS), np.arange(SCANS, dtype=float), pose, told)
    return RobotMap("a", "0", 1, (Submap(0, 0, np.zeros(3), LineMap.empty(), trajectory),))


@pytest.mark.parametrize(("factor", "share"), [(1.0, 0.954), (2.0, 0.683), (0.1, 1.0)])
def test_errors_as_large_as_told_are_within_two_sigma_in_95_of_100_steps(
    factor: float, share: float
) -> None:
    rng = np.random.default_rng(8)
    truth = rng.uniform(-3, 3, (SCANS, 3)) * [0.01, 0.01, 1.0]  # short steps: no lever
    found = within_two_sigma(mapped(truth, rng, factor), truth)
    np.testing.assert_allclose(found, share, atol=0.02)


def test_nothing_is_claimed_of_a_map_that_does_not_say() -> None:
    trajectory = Trajectory(np.arange(2), np.zeros(2), np.zeros((2, 3)))
    silent = RobotMap("a", "0", 1, (Submap(0, 0, np.zeros(3), LineMap.empty(), trajectory),))
    assert np.isnan(within_two_sigma(silent, np.zeros((2, 3)))).all()
