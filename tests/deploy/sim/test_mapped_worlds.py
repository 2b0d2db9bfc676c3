"""What robots make of worlds that are hard: the place as it is, and joined where it is one place.

Round rooms, bare halls and ramps are not here: robots are off there, and say so mostly
(``python -m benchmarks robots``).
"""

import json
from pathlib import Path

import numpy as np
import pytest

from mapweave.fusion.align import align
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.io.readers import read_scans
from mapweave.mapping.mapper import Mapper
from mapweave.maps import Alignment, RobotMap
from mapweave_deploy.sim.simulation import RobotLog, simulate

pytestmark = pytest.mark.slow

OFF = 0.25  # [m] that a scan may be off, as seen from the first
SEED = 3
WORLDS = ["doors", "moved", "glass", "mirrors", "colonnade", "twins"]
# Whole and bare, or the same again: nothing tells such a building from another that is built alike.
MAY_EXIST_TWICE = ("mirrors", "colonnade", "twins")


def map_of(log: RobotLog) -> RobotMap:
    mapper = Mapper(log.robot)
    for scan in read_scans(log.log):
        mapper.add(scan)
    return mapper.finish()


def truth_of(log: RobotLog) -> FloatArray:
    """Return the (n, 3) true poses of a log's scans."""
    return np.array([row[1:] for row in json.loads(log.truth.read_text())["poses"]])


def assert_is_right(robot_map: RobotMap, truth: FloatArray) -> None:
    """Check that all but a few scans are in one component, and where they were taken."""
    assert robot_map.components == [0]
    index = np.concatenate([s.trajectory.scan_index for s in robot_map.submaps])
    poses = np.vstack([se2.compose(s.pose, s.trajectory.pose) for s in robot_map.submaps])
    first = np.argmin(index)
    seen, true = se2.between(poses[first], poses), se2.between(truth[index[first]], truth[index])
    assert len(index) >= 0.98 * len(truth)
    assert np.hypot(*(seen - true)[:, :2].T).max() < OFF


def assert_not_wrong(found: Alignment, truths: list[FloatArray]) -> None:
    """Check that maps which begin at their first scans are joined as those lay, if they are."""
    error = se2.between(se2.between(truths[0][0], truths[1][0]), found.transform)
    right = np.hypot(*error[:2]) < 0.5 and abs(error[2]) < np.radians(5)
    assert found.decision != "accepted" or right, found.reason


@pytest.mark.parametrize("world", WORLDS)
def test_robots_map_a_hard_world_as_it_is_and_are_joined_rightly_or_not_at_all(
    world: str, tmp_path: Path
) -> None:
    logs = simulate(world, 2, SEED, tmp_path)
    maps, truths = [map_of(log) for log in logs], [truth_of(log) for log in logs]
    for robot_map, truth in zip(maps, truths, strict=True):
        assert_is_right(robot_map, truth)
    (found,) = align(maps[0], maps[1])
    assert_not_wrong(found, truths)
    assert found.decision == "accepted" or world in MAY_EXIST_TWICE, found.reason


def test_robots_one_of_whose_sensors_hangs_upside_down_unsaid_are_told_so(tmp_path: Path) -> None:
    usual, turned = (
        simulate("office", 2, 1, tmp_path / str(lidar), lidar) for lidar in (None, "mirrored")
    )
    first, second = (map_of(log) for log in (usual[0], turned[1]))
    (found,) = align(first, second)
    assert found.decision == "refused"
    assert "one of the sensors seems to hang upside down" in found.reason
