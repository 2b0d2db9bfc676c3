"""Localisation: robots set down in a known map, and how far they drive until they know where.

The first part of a log is mapped. From later scans, drawn where the first part has been, a robot is
set down and driven on: it finds itself within 5 m, or not; at the right place, or at a wrong one.
"""

import argparse
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from benchmarks.logs import Log, find_logs, load_scans, load_truth
from benchmarks.runs import map_remembered
from benchmarks.tables import OUTPUT, format_table, write_json
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.localization.known_map import KnownMap
from mapweave.mapping.localization.localizer import Localizer
from mapweave.mapping.localization.place_finder import PlaceFinder, PlaceFinderParameters
from mapweave.maps import RobotMap
from mapweave.scan.scan import Scan

STARTS = {"fr079": (0.6, 8), "intel-lab": (0.5, 8), "csail-thinned": (0.6, 4)}
"""Of each log: the share that is mapped, and how many robots are set down."""

WITHIN = 5.0  # [m] driven, in which a robot is to find itself
FOLLOWED = 15.0  # [m] it is followed for
DISTANCE, TURN = 0.5, np.radians(5.0)  # [m], [rad] off which a place is wrong
BEEN, FACED = 1.5, 1.2  # [m], [rad] about a mapped scan: there the map is known
HEAD = ["log", "starts", "found", "within 5 m", "wrong", "median m driven", "worst m driven"]
HEAD += ["median m off", "worst m off"]


@dataclass(frozen=True, slots=True)
class Start:
    """What became of a robot that was set down.

    Attributes
    ----------
    scan
        The first it takes.
    found_after
        [m] driven, by the corrected poses, when it first said where it was; None if it never did.
    wrong
        How many of its scans were placed wrongly.
    placed
        How many of its scans were placed.
    median, worst
        [m] off where the scans were; NaN if none was placed.
    """

    log: str
    scan: int
    found_after: float | None
    wrong: int
    placed: int
    median: float
    worst: float


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which logs, and where the figures go."""
    parser.add_argument(
        "--logs", nargs="+", default=tuple(STARTS), metavar="NAME", help=" ".join(STARTS)
    )
    parser.add_argument("--output", type=Path, default=OUTPUT / "localize", help="folder")


def run(options: argparse.Namespace) -> None:
    """Set robots down in each log, print the table, write the starts."""
    rows: list[list[str]] = []
    starts: list[Start] = []
    for log in find_logs(options.logs):
        found = _set_down(log, *STARTS[log.name])
        rows.append(_row(log.name, found))
        starts += found
    rows.append(_row("all", starts))
    print(format_table(HEAD, rows))
    write_json(options.output / "starts.json", [asdict(start) for start in starts])


def _set_down(log: Log, share: float, count: int) -> list[Start]:
    scans = load_scans(log)
    truth = load_truth(log, np.array([scan.stamp for scan in scans]))
    first = int(share * len(scans))
    known = map_remembered(f"{log.name} first {share:.0%}", log.path, scans[:first], "r1")
    mapped = Mapped(known, truth)
    stored = KnownMap.of(known)
    finder = PlaceFinder(stored, PlaceFinderParameters())
    inside = [k for k in range(first, len(scans)) if mapped.has(truth, k)]
    drawn = np.random.default_rng(0).choice(inside, count, replace=False)
    found = []
    for start in sorted(drawn.tolist()):
        found.append(_follow(log.name, scans, truth, start, stored, finder, mapped))
        print(found[-1])
    return found


class Mapped:
    """Where mapped scans are in the known map, and where they were."""

    def __init__(self, known: RobotMap, truth: FloatArray) -> None:
        poses = {
            int(index): (s.component, se2.compose(s.pose, pose))
            for s in known.submaps
            for index, pose in zip(s.trajectory.scan_index, s.trajectory.pose, strict=True)
            if np.isfinite(truth[index, 0])
        }
        self._poses, self._index = poses, np.array(list(poses))
        self._truth = truth[self._index]

    def has(self, truth: FloatArray, start: int) -> bool:
        """Whether the first part was where the robot is set down, and drives over 5 m."""
        if not self.faces(truth[start]):
            return False
        path = truth[start:][np.isfinite(truth[start:, 0])]
        driven = _driven(path)
        ahead = path[driven <= WITHIN]
        apart = np.hypot(*(self._truth[:, None, :2] - ahead[None, :, :2]).transpose(2, 0, 1))
        return bool(driven[-1] > FOLLOWED and (apart.min(axis=0) < BEEN).all())

    def faces(self, pose: FloatArray) -> bool:
        """Whether the first part was about a true `pose` (3,), and looked about the same way."""
        near = np.hypot(*(self._truth[:, :2] - pose[:2]).T) < BEEN
        return bool((np.abs(se2.wrap(self._truth[near, 2] - pose[2])) < FACED).any())

    def error(self, component: int, pose: FloatArray, true: FloatArray) -> tuple[float, float]:
        """Return how far a pose in the known map is off [m], [rad], by the nearest mapped scans.

        Maps are bent: where scans nearby were mapped is what a robot can know.
        """
        nearest = np.argsort(np.hypot(*(self._truth[:, :2] - true[:2]).T))[:5]
        errors = []
        for k in nearest:
            of, mapped = self._poses[int(self._index[k])]
            if of == component:
                expected = se2.compose(mapped, se2.between(self._truth[k], true))
                x, y, turn = se2.between(expected, pose).tolist()
                errors.append((float(np.hypot(x, y)), abs(turn)))
        return min(errors, default=(np.inf, np.inf))


def _follow(
    name: str,
    scans: Sequence[Scan],
    truth: FloatArray,
    start: int,
    known: KnownMap,
    finder: PlaceFinder,
    mapped: Mapped,
) -> Start:
    localizer = Localizer(known, searcher=finder)
    driven, found_after = 0.0, None
    errors: list[tuple[float, float]] = []
    last = truth[start]
    for scan in scans[start:]:
        placement, true = localizer.add(scan), truth[scan.index]
        if not np.isfinite(true[0]):
            continue
        driven, last = driven + float(np.hypot(*(true - last)[:2])), true
        if placement.pose is not None:
            found_after = driven if found_after is None else found_after
            errors.append(mapped.error(placement.component, placement.pose, true))
        if driven > FOLLOWED:
            break
    off = [distance for distance, _ in errors]
    wrong = int(sum(distance > DISTANCE or turn > TURN for distance, turn in errors))
    median, worst = (np.median(off), np.max(off)) if off else (np.nan, np.nan)
    return Start(name, start, found_after, wrong, len(off), float(median), float(worst))


def _driven(path: FloatArray) -> FloatArray:
    """(n,) [m] along (n, 3) poses."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path[:, :2], axis=0).T))])


def _row(name: str, starts: Sequence[Start]) -> list[str]:
    after = [start.found_after for start in starts if start.found_after is not None]
    off = [start.median for start in starts if start.placed]
    worst = max((start.worst for start in starts if start.placed), default=np.nan)
    return [
        name,
        f"{len(starts)}",
        f"{len(after)}",
        f"{sum(each <= WITHIN for each in after)}",
        f"{sum(start.wrong > 0 for start in starts)}",
        f"{np.median(after):.1f}" if after else "-",
        f"{max(after, default=np.nan):.1f}",
        f"{np.median(off):.2f}" if off else "-",
        f"{worst:.2f}",
    ]
