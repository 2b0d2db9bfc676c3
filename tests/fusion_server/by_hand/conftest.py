"""What a person types, at a real server with robots made by hand."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from tests.fusion_server.conftest import L_ROOM, MAPWEAVE, PATIENCE, Network
from tests.people import Operator

SCANS = 5  # of a submap


@pytest.fixture
def anna(network: Network) -> Operator:
    """Return an operator called anna."""
    return Operator(network.team, network.endpoint, "anna")


def walk(
    robot: str,
    start: tuple[float, float, float],
    *,
    version: int = 1,
    second: tuple[float, float, float] = (0.0, 0.0, 0.0),
    boot: str = "first",
) -> RobotMap:
    """Return the map of a robot that saw the L-shaped room from `start` in it, in two submaps.

    The `second` of these is moved by so much in the component's frame, as where a loop is closed.
    """
    frames = [np.zeros(3), np.array([2.0, 0.5, 0.2])]
    poses = [frames[0], se2.compose(second, frames[1])]
    submaps = []
    for k, (frame, pose) in enumerate(zip(frames, poses, strict=True)):
        seen_from = se2.compose(start, frame)
        path = np.column_stack([0.2 * np.arange(SCANS), np.zeros(SCANS), np.zeros(SCANS)])
        index = SCANS * k + np.arange(SCANS)
        trajectory = Trajectory(index, index.astype(np.float64), path)
        submaps.append(Submap(k, 0, pose, _room_from(seen_from), trajectory))
    return RobotMap(robot, boot, version, tuple(submaps))


def _room_from(pose: FloatArray) -> LineMap:
    corners = se2.transform_points(se2.inverse(pose), L_ROOM)
    walls = np.hstack([corners, np.roll(corners, -1, axis=0)])
    count = len(walls)
    inside = se2.transform_points(se2.inverse(pose), L_ROOM * 0.96 + 0.1)
    return LineMap(walls, np.zeros(count, dtype=int), np.full(count, 20), (inside,))


def exported(joint_file: Path, suffix: str) -> Path:
    """Return the file that ``mapweave export`` makes."""
    target = joint_file.with_suffix(suffix)
    subprocess.run([MAPWEAVE, "export", joint_file, target], check=True, timeout=PATIENCE)
    return target
