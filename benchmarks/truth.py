"""How far an estimated path is from the truth: steps, positions, relations."""

import gzip
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from mapweave.geometry import se2
from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.maps import RobotMap
from mapweave_deploy.run.evaluation import component_path

STEP_DISTANCE, STEP_TURN = 0.25, np.radians(5.0)  # [m], [rad] within which a step is right
MEETING, NO_MEETING = 1.0, 3.0  # [m] within which scans meet, and beyond which they do not
STRETCH, HOP = 5.0, 0.5  # [m] of path that count as one, and between the scans looked at
STAMP_TOLERANCE = 0.005  # [s] between the stamps of a relation and of its scans


@dataclass(frozen=True, slots=True, eq=False)
class Path2D:
    """The scans of one component.

    Attributes
    ----------
    component
        Its number.
    index
        (m,) scans of the log, ascending.
    pose
        (m, 3) where they were taken, component's frame [m, m, rad].
    """

    component: int
    index: IntArray
    pose: FloatArray


def paths(robot_map: RobotMap) -> list[Path2D]:
    """Return the path of each component, that with the most scans first."""
    found = []
    for component in robot_map.components:
        index, pose = component_path(robot_map, component)
        order = np.argsort(index)
        found.append(Path2D(component, index[order], pose[order]))
    return sorted(found, key=lambda path: -len(path.index))


def steps_right(
    found: list[Path2D], truth: FloatArray, counts: BoolArray | None = None
) -> BoolArray:
    """Tell for each step whether it is right within 0.25 m and 5°.

    A step leads from a scan to the next one in the log whose (n, 3) `truth` is known; it counts
    when both are placed in one component, and its first scan is one of those in `counts` (n,).
    """
    component = np.full(len(truth), -1)
    pose = np.full((len(truth), 3), np.nan)
    for path in found:
        component[path.index], pose[path.index] = path.component, path.pose
    known = np.flatnonzero(np.isfinite(truth[:, 0]))
    first, second = known[:-1], known[1:]
    together = (component[first] >= 0) & (component[first] == component[second])
    if counts is not None:
        together &= counts[first]
    first, second = first[together], second[together]
    distance, turn = _apart(
        se2.between(truth[first], truth[second]), se2.between(pose[first], pose[second])
    )
    right: BoolArray = (distance <= STEP_DISTANCE) & (turn <= STEP_TURN)
    return right


def true_frame(path: Path2D, truth: FloatArray) -> FloatArray:
    """Return (3,) where the component's frame is in that of `truth` (n, 3), as all scans say.

    NaN where the truth of none is known.
    """
    known = np.isfinite(truth[path.index, 0])
    if not known.any():
        return np.full(3, np.nan)
    return se2.fit(path.pose[known], truth[path.index[known]])


def position_error(path: Path2D, truth: FloatArray) -> float:
    """Return the rms [m] between the positions of `path`, moved rigidly, and `truth` (n, 3).

    NaN where the truth of none is known.
    """
    placed = se2.transform_points(true_frame(path, truth), path.pose[:, :2])
    squared = np.sum((placed - truth[path.index, :2]) ** 2, axis=1)
    known = squared[np.isfinite(squared)]
    return float(np.sqrt(known.mean())) if len(known) else np.nan


def false_meetings(path: Path2D, truth: FloatArray) -> int:
    """Return how many pairs of stretches the map shows at one place that are at two.

    What a wrong closure does, whichever it was. A stretch is 5 m of path; two meet where scans of
    both are within 1 m of each other in the map, and falsely if these are more than 3 m apart in
    the (n, 3) `truth`.
    """
    known = np.isfinite(truth[path.index, 0])
    if not known.any():
        return 0
    place, true = path.pose[known, :2], truth[path.index[known], :2]
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(true, axis=0).T))])
    _, kept = np.unique(way // HOP, return_index=True)  # a robot that stands meets itself a lot
    pairs = kept[KDTree(place[kept]).query_pairs(MEETING, output_type="ndarray")]
    apart = np.hypot(*(true[pairs[:, 0]] - true[pairs[:, 1]]).T)
    stretches = (way[pairs[apart > NO_MEETING]] // STRETCH).astype(np.int64)
    return len(np.unique(np.sort(stretches, axis=1), axis=0))


@dataclass(frozen=True, slots=True)
class RelationError:
    """Errors over the ground-truth relations of Kümmerle et al. 2009, their absolute means.

    Attributes
    ----------
    joined
        Relations whose two stamps are those of scans in the log.
    used
        Those of them whose two scans are in one component.
    translation, translation_sd
        Mean and standard deviation [m].
    rotation, rotation_sd
        Mean and standard deviation [rad].
    """

    joined: int
    used: int
    translation: float
    translation_sd: float
    rotation: float
    rotation_sd: float


def read_relations(file: Path) -> tuple[FloatArray, FloatArray]:
    """Return (k, 2) stamps [s] and (k, 3) poses of the second scan in the frame of the first."""
    with gzip.open(file, "rt") as lines:
        table = np.loadtxt(lines)
    return table[:, :2], table[:, [2, 3, 7]]


def relation_error(file: Path, stamps: FloatArray, found: list[Path2D]) -> RelationError:
    """Compare `found` with the relations in `file`; `stamps` (n,) [s] are those of the scans."""
    wanted, relation = read_relations(file)
    scan, joined = _scans_at(wanted, stamps)
    scan, relation = scan[joined], relation[joined]
    distance, turn = [np.empty(0)], [np.empty(0)]
    for path in found:
        inside = np.isin(scan, path.index).all(axis=1)
        first, second = path.pose[np.searchsorted(path.index, scan[inside])].transpose(1, 0, 2)
        apart, turned = _apart(relation[inside], se2.between(first, second))
        distance.append(apart)
        turn.append(turned)
    d, t = np.concatenate(distance), np.concatenate(turn)
    if len(d) == 0:
        return RelationError(len(scan), 0, np.nan, np.nan, np.nan, np.nan)
    return RelationError(
        len(scan), len(d), float(d.mean()), float(d.std()), float(t.mean()), float(t.std())
    )


def _scans_at(wanted: FloatArray, stamps: FloatArray) -> tuple[IntArray, BoolArray]:
    """Return (k, 2) the scan at each wanted stamp, and (k,) whether both are near enough."""
    apart, scan = KDTree(stamps[:, None]).query(wanted.reshape(-1, 1))
    near = np.asarray(apart).reshape(-1, 2).max(axis=1, initial=0.0) <= STAMP_TOLERANCE
    return np.asarray(scan, dtype=np.int64).reshape(-1, 2), near


def _apart(true: FloatArray, estimate: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (n,) distances [m] and turns [rad] of true⁻¹ ∘ estimate, both (n, 3)."""
    error = se2.between(true, estimate)
    return np.hypot(error[:, 0], error[:, 1]), np.abs(error[:, 2])
