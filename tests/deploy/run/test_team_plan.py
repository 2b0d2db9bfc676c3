"""Who is in a team."""

from pathlib import Path

import numpy as np
import pytest

from mapweave.errors import FileError
from mapweave_deploy.run.team_plan import team_from_logs

HEAD = "ROBOTLASER1 0 -1.57 3.14 1.57 30 0.01 0 3 1.0 2.0 3.0 0"


def write_log(path: Path, scans: int) -> Path:
    """Write a log whose k-th scan was taken at (k, 0)."""
    poses = [f"{k} 0 0 {k} 0 0 0 0 0 0 0" for k in range(scans)]
    path.write_text("".join(f"{HEAD} {pose} {k}.0 host {k}.0\n" for k, pose in enumerate(poses)))
    return path


def test_several_logs_give_a_team_each_robot_with_a_name_and_stretch_of_its_own(
    tmp_path: Path,
) -> None:
    logs = [write_log(tmp_path / "one.log", 20), write_log(tmp_path / "two.log", 10)]
    members = team_from_logs(logs, 2)
    assert [member.robot for member in members] == ["r1", "r2", "r3", "r4"]
    assert [member.scans for member in members] == [(0, 12), (8, 20), (0, 6), (4, 10)]
    assert members[0].place == members[1].place != members[2].place == members[3].place
    np.testing.assert_allclose(members[2].truth_pose[:, 0], np.arange(10))


def test_a_log_whose_poses_never_change_tells_no_truth(tmp_path: Path) -> None:
    log = tmp_path / "still.log"
    log.write_text("".join(f"{HEAD}{' 0' * 11} {k}.0 host {k}.0\n" for k in range(4)))
    [member] = team_from_logs([log], 1)
    assert len(member.truth_index) == len(member.truth_pose) == 0


@pytest.mark.parametrize(("count", "said"), [(1, "1 scan"), (2, "2 scans")])
def test_a_log_with_fewer_scans_than_robots_is_refused(
    count: int, said: str, tmp_path: Path
) -> None:
    with pytest.raises(FileError, match=rf"{said}, expected at least one for each robot \(3\)"):
        team_from_logs([write_log(tmp_path / "short.log", count)], 3)
