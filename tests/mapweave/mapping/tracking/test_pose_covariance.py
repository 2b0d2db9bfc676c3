"""Every placed scan says how well determined its pose was, per direction."""

from pathlib import Path

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.io.map_files import read_map, write_map
from mapweave.mapping.mapper import Mapper
from mapweave.mapping.tracking.pose_covariance import (
    EXACT,
    PoseCovarianceParameters,
    pose_uncertainty,
    turn_uncertainty,
)
from mapweave.maps import RobotMap
from tests.mapweave.buildings import AROUND, cast, rectangle, walls_of

BARE = PoseCovarianceParameters(floor=0.0, turn_floor=0.0)
CORRIDOR = walls_of(rectangle(-40, -1, 40, 1.2))
TURN = 0.7  # the corridor's direction in the frame of its first scan


def information(direction: float, along: float, across: float, heading: float) -> FloatArray:
    """Return (3, 3) that many points held in and across `direction` [rad], and the heading."""
    r = se2.rotation(direction)
    held = np.zeros((3, 3))
    held[:2, :2] = r @ np.diag([along, across]) @ r.T
    held[2, 2] = heading
    return held


@pytest.fixture(scope="module")
def corridor() -> RobotMap:
    """Return the map of a robot that drives along the middle of a corridor, seeing no end."""
    rng = np.random.default_rng(3)
    mapper = Mapper("a")
    for k in range(12):
        pose = np.array([-3 + 0.3 * k, 0.0, -TURN])
        mapper.add(cast(CORRIDOR, pose, index=k, angles=AROUND, noise=rng, max_range=12.0))
    return mapper.finish()


def test_deviations_are_those_of_the_points_that_hold_each_direction() -> None:
    """N points of 0.1 m noise hold a direction to 0.1 / sqrt(N), less what a step is known to."""
    found = pose_uncertainty(information(0.4, 25.0, 100.0, 400.0), BARE)
    bounded = [
        (1 / (n / 0.1**2 + unheld**-2)) ** 0.5
        for n, unheld in [(25.0, 0.5), (100.0, 0.5), (400.0, 0.35)]
    ]
    np.testing.assert_allclose(found, [*bounded, 0.4])


def test_a_direction_that_nothing_holds_is_known_no_better_than_a_step() -> None:
    weakest, strongest, _, direction = pose_uncertainty(information(0.3, 0.0, 100.0, 50.0), BARE)
    assert weakest == pytest.approx(BARE.step)
    assert strongest < 0.011
    assert direction == pytest.approx(0.3)


def test_however_many_points_agree_no_pose_is_better_known_than_the_map() -> None:
    found = pose_uncertainty(information(0.0, 1e9, 1e9, 1e9))
    floor = PoseCovarianceParameters()
    np.testing.assert_allclose(found[:3], [floor.floor, floor.floor, floor.turn_floor], rtol=1e-3)


def test_turning_the_frame_turns_the_direction_and_nothing_else(rng: Generator) -> None:
    for direction, angle in rng.uniform(-np.pi, np.pi, (20, 2)):
        there = pose_uncertainty(information(direction + angle, 4.0, 90.0, 300.0))
        here = pose_uncertainty(information(direction, 4.0, 90.0, 300.0))
        turned = turn_uncertainty(here, angle)
        np.testing.assert_allclose(turned[:3], there[:3])
        assert np.sin(turned[3] - there[3]) == pytest.approx(0, abs=1e-9)
        assert -np.pi / 2 < turned[3] <= np.pi / 2


def test_in_a_corridor_the_weakest_direction_is_along_it(corridor: RobotMap) -> None:
    [submap] = corridor.submaps
    told = submap.trajectory.uncertainty
    assert told is not None
    np.testing.assert_array_equal(told[0], EXACT)
    assert (told[1:, 0] > 3 * told[1:, 1]).all()
    np.testing.assert_allclose(np.sin(told[1:, 3] - TURN), 0, atol=0.1)


def test_it_is_told_of_each_scan_and_survives_the_file(corridor: RobotMap, tmp_path: Path) -> None:
    write_map(tmp_path / "map.json", corridor)
    for before, after in zip(
        corridor.submaps, read_map(tmp_path / "map.json").submaps, strict=True
    ):
        told, read = before.trajectory.uncertainty, after.trajectory.uncertainty
        assert told is not None
        assert read is not None
        assert told.shape == (len(before.trajectory.scan_index), 4)
        np.testing.assert_allclose(read, told, atol=5.1e-5)
