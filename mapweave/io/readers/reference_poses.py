"""The poses that came with a log: the yardstick of benchmarks, never an input to mapping."""

from pathlib import Path

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.io.readers.beams import DamagedLineError
from mapweave.io.readers.lines import Line
from mapweave.io.readers.log import check_is_file, read_lines
from mapweave.io.readers.parser import LogParser
from mapweave.io.readers.records import LaserRecord

_VERTEX_KINDS = (b"VERTEX2 ", b"VERTEX_SE2 ")
_UNKNOWN: FloatArray = np.full(3, np.nan)


def read_reference_poses(path: str | Path) -> tuple[IntArray, FloatArray]:
    """Return where the laser was at the scans of a log, as the log itself has it.

    In a graph (TORO, g2o) a vertex is the optimised pose of the robot, and the scan that follows
    it was taken there: the laser sits on the vertex as it sat on the robot when the scan was
    recorded. Elsewhere it is the laser pose of the scan's own line.

    Returns
    -------
    indices
        (m,) scan indices as `read_scans` counts them, ascending; scans without a finite pose
        are missing.
    poses
        (m, 3) of the laser [m, m, rad], in the log's frame.

    Raises
    ------
    FileError
        If the file cannot be read.
    """
    source = Path(path)
    check_is_file(source)
    poses = _laser_poses(source)
    usable = [index for index, pose in enumerate(poses) if np.isfinite(pose).all()]
    rows = [poses[index] for index in usable]
    return np.array(usable, dtype=np.int64), np.array(rows, dtype=np.float64).reshape(-1, 3)


def _laser_poses(path: Path) -> list[FloatArray]:
    """Return the pose of every whole scan; NaN for one in a graph that follows no vertex."""
    poses: list[FloatArray] = []
    parser, is_graph, vertex = LogParser(), False, _UNKNOWN
    for line in read_lines(path):
        if line.text.startswith(_VERTEX_KINDS):
            is_graph, vertex = True, _vertex_pose(line)
            continue
        record = _whole_record(parser, line)
        if record is None:
            continue
        poses.append(_laser_on(vertex, record) if is_graph else record.laser_pose)
        vertex = _UNKNOWN
    return poses


def _vertex_pose(line: Line) -> FloatArray:
    words = line.text.split()
    try:
        return np.array([float(word) for word in words[2:]]) if len(words) == 5 else _UNKNOWN
    except ValueError:
        return _UNKNOWN


def _whole_record(parser: LogParser, line: Line) -> LaserRecord | None:
    try:
        return parser.parse(line)
    except DamagedLineError:
        return None  # It takes no index; whoever reads the scans is warned of it.


def _laser_on(vertex: FloatArray, record: LaserRecord) -> FloatArray:
    mounting = se2.between(record.robot_pose, record.laser_pose)
    return se2.compose(vertex, mounting)
