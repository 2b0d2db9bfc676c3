"""Logs cut into consecutive stretches, each mapped as if by a robot of its own."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from benchmarks.coverage import metres_in_common, returns_at, wall_cells
from benchmarks.logs import Log, load_scans, load_truth
from benchmarks.runs import map_remembered
from benchmarks.truth import paths, position_error, true_frame
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import RobotMap, component_name
from mapweave.scan.scan import Scan


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A component of a stretch's map.

    Attributes
    ----------
    frame
        (3,) of the component in the log's corrected frame, fitted to all its scans; NaN where
        the truth of none is known.
    bend
        [m] rms that its scans are off in that frame: what an alignment cannot mend.
    ends
        (2n, 2) of its segments, component's frame [m].
    seen, true
        (m, 3) poses of its scans in its frame and in the log's corrected one; NaN where unknown.
    """

    frame: FloatArray
    bend: float
    ends: FloatArray
    seen: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    true: FloatArray = field(default_factory=lambda: np.empty((0, 3)))


@dataclass(frozen=True, eq=False)
class Stretch:
    """Consecutive scans of a log and the map made of them without odometry.

    Attributes
    ----------
    name
        Such as ``intel 2/6``.
    log
        Whose scans they are.
    robot_map
        Its robot id is unlike any other stretch's.
    cells
        (m, 2) of wall at the corrected poses [m].
    parts
        By component name.
    """

    name: str
    log: Log
    robot_map: RobotMap
    cells: FloatArray
    parts: dict[str, Part]

    @cached_property
    def segments(self) -> int:
        """How many segments its map has."""
        return sum(len(part.ends) for part in self.parts.values()) // 2


def map_stretches(log: Log, count: int) -> list[Stretch]:
    """Cut `log` into `count` consecutive stretches and map each."""
    scans = load_scans(log)
    truth = load_truth(log, np.array([scan.stamp for scan in scans]))
    bounds = [round(len(scans) * k / count) for k in range(count + 1)]
    return [
        _map_stretch(f"{log.name} {k + 1}/{count}", log, scans[bounds[k] : bounds[k + 1]], truth)
        for k in range(count)
    ]


def _map_stretch(name: str, log: Log, scans: Sequence[Scan], truth: FloatArray) -> Stretch:
    robot = name.replace(" ", "-").replace("/", "of")
    robot_map = map_remembered(name, log.path, scans, robot)
    known = [scan for scan in scans if np.isfinite(truth[scan.index, 0])]
    cells = wall_cells(returns_at(known, truth[[scan.index for scan in known]]))
    return Stretch(name, log, robot_map, cells, _parts(robot_map, truth))


def _parts(robot_map: RobotMap, truth: FloatArray) -> dict[str, Part]:
    parts = {}
    for path in paths(robot_map):
        frame = true_frame(path, truth)
        ends = robot_map.lines(path.component).segments.reshape(-1, 2)
        name = component_name(robot_map.robot, path.component)
        error = position_error(path, truth)
        parts[name] = Part(frame, error, ends, path.pose, truth[path.index])
    return parts


def common(first: Stretch, second: Stretch) -> float:
    """Return the metres of wall [m] two stretches share; none in different buildings."""
    if first.log.building != second.log.building:
        return 0.0
    return metres_in_common(first.cells, second.cells)


def alignment_error(reference: Part, other: Part, transform: FloatArray) -> tuple[float, float]:
    """Return how far off `transform` (3,) is: at the median over `other`'s map [m], and [rad].

    NaN where the truth of either is unknown.
    """
    true = se2.between(reference.frame, other.frame)
    apart = se2.transform_points(transform, other.ends) - se2.transform_points(true, other.ends)
    distance = float(np.median(np.hypot(apart[:, 0], apart[:, 1]))) if len(apart) else 0.0
    return distance, float(np.abs(se2.wrap(transform[2] - true[2])))
