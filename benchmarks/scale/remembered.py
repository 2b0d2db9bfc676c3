"""What two maps were found to be to each other, kept: a run that was stopped goes on."""

import hashlib
import pickle
import time
from dataclasses import dataclass

import numpy as np

from benchmarks.killian import CACHE
from benchmarks.runs import COMPARING, sources
from mapweave.fusion.align import FusionParameters, align
from mapweave.maps import Alignment, RobotMap


@dataclass(frozen=True, slots=True)
class Compared:
    """What came of comparing two maps, and the processor time that it took [s]."""

    alignments: list[Alignment]
    seconds: float


def compare_remembered(one: RobotMap, other: RobotMap, p: FusionParameters) -> Compared:
    """Compare two maps as robots do, unless the same sources compared the same maps before.

    Kept in the user's own cache, which nobody else writes.
    """
    digest = sources(COMPARING) + fingerprint(one) + fingerprint(other) + repr(p).encode()
    name = hashlib.sha256(digest)
    file = CACHE / "compared" / f"{name.hexdigest()[:32]}.pickle"
    if file.is_file():
        return Compared(*pickle.loads(file.read_bytes()))
    start = time.process_time()
    found = align(one, other, p)
    compared = Compared(found, time.process_time() - start)
    file.parent.mkdir(parents=True, exist_ok=True)
    unfinished = file.with_suffix(".part")
    unfinished.write_bytes(pickle.dumps((found, compared.seconds)))
    unfinished.replace(file)
    return compared


def fingerprint(robot_map: RobotMap) -> bytes:
    """Name what of a map is compared: whose it is, its walls, its free space, where it drove."""
    digest = hashlib.sha256(robot_map.robot.encode())
    for submap in robot_map.submaps:
        lines, path = submap.map, submap.trajectory
        digest.update(f"{submap.id} {submap.component} {len(lines.free_space)}".encode())
        said = submap.pose, lines.segments, lines.polyline, lines.support, path.pose, path.stamp
        for values in (*said, *lines.free_space):
            digest.update(f"{values.shape}".encode() + np.ascontiguousarray(values).tobytes())
    return digest.digest()
