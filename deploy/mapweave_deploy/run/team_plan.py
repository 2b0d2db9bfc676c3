"""Who is in a team, and whose scans each one maps."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mapweave.errors import FileError
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.io.readers import count_scans, read_reference_poses
from mapweave.text import counted
from mapweave_deploy.run.log_split import cut
from mapweave_deploy.sim.simulation import RobotLog, simulate


@dataclass(frozen=True, slots=True, eq=False)
class Member:
    """A robot of the team.

    Attributes
    ----------
    robot
        Its id.
    log
        Whose scans it maps.
    scans
        First and behind the last of them.
    place
        Where the truth is given: in one log, or one world. How places lie to each other, nobody
        knows.
    truth_index, truth_pose
        (m,) scan indices and (m, 3) where they were taken [m, m, rad]: simulated, or the poses
        in the log; none where they are not known.
    """

    robot: str
    log: Path
    scans: tuple[int, int]
    place: str
    truth_index: IntArray
    truth_pose: FloatArray


def simulated_team(
    world: str, robots: int, seed: int, folder: Path, lidar: str | None = None
) -> list[Member]:
    """Return a team in a built-in world, its logs written into `folder`."""
    return [_simulated(world, log) for log in simulate(world, robots, seed, folder, lidar)]


def _simulated(world: str, log: RobotLog) -> Member:
    count = len(log.tour.stamp)
    index = np.arange(count, dtype=np.int64)
    return Member(log.robot, log.log, (0, count), world, index, log.tour.pose)


def team_from_logs(logs: list[Path], robots: int) -> list[Member]:
    """Return a team of `robots` robots for each of `logs`, each mapping a stretch of its log.

    Raises
    ------
    FileError
        If a log cannot be used, or has fewer scans than robots.
    """
    members: list[Member] = []
    for log in logs:
        count = count_scans(log)
        if count < robots:
            held = counted(count, "scan")
            raise FileError(log, f"{held}, expected at least one for each robot ({robots})")
        index, pose = _truth(log)
        for scans in cut(count, robots):
            name = f"r{len(members) + 1}"
            members.append(Member(name, log, scans, str(log), index, pose))
    return members


def _truth(log: Path) -> tuple[IntArray, FloatArray]:
    """Return the poses in a log; none where all are the same, which is how none are written."""
    index, pose = read_reference_poses(log)
    known = slice(None) if len(pose) and np.ptp(pose, axis=0).any() else slice(0)
    return index[known], pose[known]
