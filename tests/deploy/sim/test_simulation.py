"""The simulated logs: the same bytes for a seed, and no truth in them."""

import json
from pathlib import Path

import numpy as np
import pytest

from mapweave.errors import MapweaveError
from mapweave.io.readers import read_scans
from mapweave_deploy.sim.lidar import LidarParameters
from mapweave_deploy.sim.simulation import RobotLog, simulate


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[RobotLog]:
    """Return the logs of two robots in the arena."""
    return simulate("arena", 2, 7, tmp_path_factory.mktemp("logs"))


def contents(folder: Path) -> dict[str, bytes]:
    """Return every file of `folder` by name."""
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_the_same_seed_writes_the_same_bytes(logs: list[RobotLog], tmp_path: Path) -> None:
    simulate("arena", 2, 7, tmp_path)
    assert contents(tmp_path) == contents(logs[0].log.parent)


def test_another_seed_writes_other_bytes(logs: list[RobotLog], tmp_path: Path) -> None:
    simulate("arena", 2, 8, tmp_path)
    assert contents(tmp_path)["r1.log"] != logs[0].log.read_bytes()


def test_the_pose_fields_of_a_log_are_all_zero(logs: list[RobotLog]) -> None:
    for log in logs:
        for line in log.log.read_text().splitlines():
            fields = line.split()
            after_ranges = 9 + int(fields[8])
            assert fields[after_ranges:-3] == ["0"] * 12


def test_reader_and_truth_agree_on_the_scans(logs: list[RobotLog]) -> None:
    for log in logs:
        scans = list(read_scans(log.log, on_warning=pytest.fail))
        truth = json.loads(log.truth.read_text())["poses"]
        assert [scan.index for scan in scans] == [row[0] for row in truth]
        np.testing.assert_allclose([row[1:] for row in truth], log.tour.pose, atol=1e-6)
        np.testing.assert_allclose(scans[0].angles, LidarParameters().angles, atol=1e-5)
        np.testing.assert_allclose([scan.stamp for scan in scans], log.tour.stamp, atol=1e-6)


def test_most_beams_come_back_and_some_do_not(logs: list[RobotLog]) -> None:
    hits = np.concatenate([scan.hits for scan in read_scans(logs[0].log, on_warning=pytest.fail)])
    assert 0.9 < np.mean(hits) < 1.0


def test_an_unknown_world_is_refused_with_the_known_ones(tmp_path: Path) -> None:
    with pytest.raises(MapweaveError, match=r"no world 'moon'; there are office, arena"):
        simulate("moon", 2, 1, tmp_path)
