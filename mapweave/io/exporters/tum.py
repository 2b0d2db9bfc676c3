"""Paths in the format of the TUM benchmarks, which tools that compare trajectories read.

A line a scan: ``stamp x y z qx qy qz qw`` [s, m, quaternion], the sensor's pose. A file has one
frame: of several components it is the one of the most wall, and a comment names those left out.
Scans without a stamp are left out.
"""

from pathlib import Path

import numpy as np

from mapweave.atomic import replace_file
from mapweave.errors import FileError
from mapweave.maps import JointMap, RobotMap
from mapweave.pictures.scene import ScenePath, largest, robot_scenes

SUFFIX = ".tum"


def write(some_map: RobotMap | JointMap, path: Path) -> None:
    """Write the path of a robot's map to `path`, whole or not at all.

    Raises
    ------
    FileError
        If it is a joint map, no scan has a stamp, or it cannot be written.
    """
    if isinstance(some_map, JointMap):
        raise FileError(path, "a joint map holds no paths; expected a robot's map")
    scenes = robot_scenes(some_map)
    paths = {
        scene.name: [line for part in scene.paths for line in _lines(part)] for scene in scenes
    }
    driven = [scene for scene in scenes if paths[scene.name]]
    # Of a robot that only follows in a stored map, the largest may be one where it never was.
    scene = largest(driven) or max(driven, key=lambda each: len(paths[each.name]), default=None)
    if scene is None:
        raise FileError(path, "no scan of the map has a stamp; expected some")
    left_out = ", ".join(other.name for other in scenes if other is not scene)
    head = [f"# component {scene.name}: stamp x y z qx qy qz qw"]
    if left_out:
        head.append(f"# left out, in frames of their own: {left_out}")
    with replace_file(path) as temporary:
        temporary.write_text("\n".join([*head, *paths[scene.name]]) + "\n", encoding="utf-8")


def _lines(part: ScenePath) -> list[str]:
    half = part.pose[:, 2] / 2
    rows = np.column_stack([part.pose[:, :2], np.sin(half), np.cos(half)])
    return [
        f"{stamp:.9f} {x:.6f} {y:.6f} 0 0 0 {qz:.9f} {qw:.9f}"
        for stamp, (x, y, qz, qw) in zip(part.stamp.tolist(), rows.tolist(), strict=True)
        if np.isfinite(stamp)
    ]
