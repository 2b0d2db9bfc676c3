"""Which scans are key scans, and how few bytes they are."""

import zlib

import numpy as np

from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave.scan.scan import Scan
from mapweave_deploy.run.key_scans import chosen, compressed, path_length


def test_a_key_scan_is_taken_after_half_a_metre_or_half_a_radian() -> None:
    poses = np.array(
        [[0, 0, 0], [0.4, 0, 0], [0.6, 0, 0], [0.6, 0, 0.4], [0.6, 0, 0.6], [1.0, 0, 0.6]]
    )
    assert list(chosen(np.arange(10, 16), poses)) == [10, 12, 14]


def test_ranges_travel_as_differences_of_millimetres() -> None:
    scan = Scan.of([1.0, 1.002, np.inf, 2.5], -0.1, 0.1)
    steps = np.frombuffer(zlib.decompress(compressed(scan)), dtype="<i2")
    assert np.cumsum(steps).tolist() == [1000, 1002, 0, 2500]


def test_a_path_is_as_long_as_that_of_all_submaps_together() -> None:
    def submap(number: int, component: int, x: float) -> Submap:
        pose = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
        trajectory = Trajectory(np.arange(2) + 2 * number, np.zeros(2), pose)
        return Submap(number, component, np.array([x, 0.0, 0.0]), LineMap.empty(), trajectory)

    robot_map = RobotMap("a", "b", 1, (submap(0, 0, 0.0), submap(1, 0, 1.5), submap(2, 1, 9.0)))
    assert path_length(robot_map) == 2.5 + 1.0
