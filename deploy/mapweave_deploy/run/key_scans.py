"""How large a choice of a robot's scans is, compressed: what maps have to be smaller than."""

import zlib
from collections.abc import Iterator

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.maps import RobotMap
from mapweave.scan.scan import Scan
from mapweave_deploy.run.evaluation import component_path
from mapweave_deploy.run.occupancy import scans_of
from mapweave_deploy.run.team_plan import Member

APART = 0.5  # [m] or
TURNED = 0.5  # [rad] after which a scan shows something new


def key_scan_bytes(member: Member, robot_map: RobotMap) -> int:
    """Return the bytes of the scans that were taken half a metre or half a radian apart.

    Each as differences between neighbouring beams in whole millimetres, deflated on its own: what
    anybody could send instead of maps.
    """
    scans = scans_of(member, robot_map)
    return sum(
        len(compressed(scans[int(number)]))
        for component in robot_map.components
        for number in chosen(*component_path(robot_map, component))
    )


def path_length(robot_map: RobotMap) -> float:
    """Return how far a robot drove by its own map [m]."""
    paths = (component_path(robot_map, component)[1] for component in robot_map.components)
    return float(sum(np.hypot(*np.diff(path[:, :2], axis=0).T).sum() for path in paths))


def chosen(index: IntArray, poses: FloatArray) -> Iterator[int]:
    """Yield which of the scans `index` (m,), taken at `poses` (m, 3) [m, m, rad], are key scans."""
    last = None
    for number, pose in zip(index, poses, strict=True):
        if last is not None:
            step = se2.between(last, pose)
            if np.hypot(step[0], step[1]) < APART and abs(step[2]) < TURNED:
                continue
        last = pose
        yield int(number)


def compressed(scan: Scan) -> bytes:
    """Return the ranges of a scan, in differences of millimetres, deflated."""
    known = np.isfinite(scan.ranges)
    millimetres = np.rint(np.where(known, scan.ranges, 0.0) * 1000).astype(np.int64)
    steps = np.diff(millimetres, prepend=0)
    short = np.all(np.abs(steps) < 2**15)
    return zlib.compress(steps.astype("<i2" if short else "<i4").tobytes(), 9)
