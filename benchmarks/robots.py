"""Robots as they are: sparse scans, clutter, people, own bodies, open places; what must hold."""

import argparse
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import chain, pairwise
from pathlib import Path

import numpy as np

from benchmarks.coverage import metres_in_common, returns_at, wall_cells
from benchmarks.robot_cases import Case, crowds, recordings, simulated, worlds
from benchmarks.speed.rows import Figure
from benchmarks.tables import OUTPUT, format_table, write_json
from benchmarks.truth import Path2D, paths, position_error, steps_right, true_frame
from mapweave.commands.progress import track
from mapweave.geometry import se2
from mapweave.geometry.arrays import BoolArray, FloatArray
from mapweave.mapping.mapper import Mapper
from mapweave.mapping.tracking.pose_covariance import turn_uncertainty
from mapweave.maps import RobotMap

OFF, TURNED = 1.0, np.radians(10.0)  # [m], [rad] off which a scan is wrong
RIGHT, RIGHT_TURN = 0.25, np.radians(5.0)  # [m], [rad] within which it is right
OPEN, OPEN_TURN = 0.25, np.radians(5.0)  # [m], [rad] of uncertainty that says so
ALONG = np.radians(15.0)  # of an open direction, within which errors lie along it
COMMON = 2.0  # [m] of wall that both scans of a step see, for it to count
# Shares of the scans in the largest component, and of the steps that are right.
SHARES = {
    "fhw": (0.99, 0.98),
    "every 2": (0.99, 0.99),
    "every 3": (0.97, 0.97),
    "every 4": (0.90, 0.90),
}
HEAD = ["group", "case", "figure", "measured", "to reach", "ratio", ""]


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a case.

    Attributes
    ----------
    largest
        Share of the scans in the largest component.
    steps_right
        Share of the steps between scans that see a wall in common.
    position_error
        [m] rms of the largest component, moved rigidly.
    silent
        Scans that are off and do not say so.
    worded
        Share of the right scans that say that they may be off.
    worst
        Processor time of the longest scan, against the median.
    """

    group: str
    name: str
    scans: int
    components: int
    largest: float
    steps_right: float
    position_error: float
    silent: int
    worded: float
    mean_ms: float
    worst: float


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which cases, how long, and where the figures go."""
    parser.add_argument("--only", nargs="+", metavar="GROUP", help="such as people (default all)")
    parser.add_argument(
        "--seconds", type=float, default=600.0, help="of a drive among people (%(default)s)"
    )
    parser.add_argument("--seeds", type=int, default=15, help="of each world (%(default)s)")
    parser.add_argument(
        "--report-only", action="store_true", help="exit status 0, whatever is reached"
    )
    parser.add_argument("--output", type=Path, default=OUTPUT / "robots.json", help="(%(default)s)")


def run(options: argparse.Namespace) -> None:
    """Map every case, print one table, write its figures.

    Raises
    ------
    SystemExit
        With status 1 if a figure falls short, unless only a report was asked for.
    """
    outcomes = []
    simulations = simulated(options.seconds), crowds(options.seeds), worlds(options.seeds)
    for case in chain(recordings(), *simulations):
        if not options.only or case.group in options.only:
            outcomes.append(measure(case))
            write_json(options.output, [asdict(each) for each in outcomes])
    judged = [(each, figure) for each in outcomes for figure in figures(each)]
    print(format_table(HEAD, [_row(*each) for each in judged]))
    if not options.report_only and not all(figure.is_met for _, figure in judged):
        raise SystemExit(1)


def measure(case: Case) -> Outcome:
    """Map a case with defaults, and compare it with what is known of it."""
    mapper, seconds, lost = Mapper("r1"), [], []
    for scan in track(case.scans, f"{case.group}: {case.name}", len(case.scans)):
        start = time.process_time()
        lost.append(mapper.add(scan).lost)
        seconds.append(time.process_time() - start)
    made = mapper.finish()
    found = paths(made)
    judged = [_judge(path, made, case.truth) for path in found]
    right = steps_right(found, case.truth, _steps_that_count(case))
    silent, worded, all_right = (sum(each) for each in zip(*judged, strict=True))
    return Outcome(
        case.group,
        case.name,
        len(case.scans),
        len(found),
        len(found[0].index) / len(case.scans),
        float(right.mean()) if len(right) else np.nan,
        position_error(found[0], case.truth),
        silent,
        (worded + sum(lost)) / max(all_right, 1),
        1000 * float(np.mean(seconds)),
        float(np.max(seconds) / np.median(seconds)),
    )


def _judge(path: Path2D, made: RobotMap, truth: FloatArray) -> tuple[int, int, int]:
    """Return how many scans of a component are off unsaid, right but said not to be, and right."""
    said = _uncertainty(path, made)
    open_way, open_turn = said[:, 0] >= OPEN, said[:, 2] >= OPEN_TURN
    frame = true_frame(_sure(path, ~(open_way | open_turn)), truth)
    error = se2.between(truth[path.index], se2.compose(frame, path.pose))
    away, turned = np.hypot(error[:, 0], error[:, 1]), np.abs(se2.wrap(error[:, 2]))
    aside = np.abs(np.sin(np.arctan2(error[:, 1], error[:, 0]) - said[:, 3]))
    # Where the heading is open the error lies on arcs: chords of them are off by the turn at most.
    chord = np.minimum(ALONG + np.where(open_turn, turned, 0.0), np.pi / 2)
    told = open_way & ((aside <= np.sin(chord)) | (said[:, 1] >= OPEN))
    off_way = (away > OFF) & ~told
    off_turn = (turned > TURNED) & ~open_turn
    right = (away <= RIGHT) & (turned <= RIGHT_TURN)
    worded = right & (open_way | open_turn)
    return int((off_way | off_turn).sum()), int(worded.sum()), int(right.sum())


def _sure(path: Path2D, sure: BoolArray) -> Path2D:
    """Return the `sure` (m,) scans of a component, which say where its frame is; all if none is."""
    kept = sure if sure.any() else ~sure
    return Path2D(path.component, path.index[kept], path.pose[kept])


def _uncertainty(path: Path2D, made: RobotMap) -> FloatArray:
    """Return (m, 4) what the map says of the poses of `path`; directions in the sensor's frame."""
    own = [submap for submap in made.submaps if submap.component == path.component]
    index = np.concatenate([submap.trajectory.scan_index for submap in own])
    said = [
        turn_uncertainty(np.asarray(submap.trajectory.uncertainty), submap.pose[2])
        for submap in own
    ]
    ordered: FloatArray = np.concatenate(said)[np.argsort(index)]
    ordered[:, 3] -= path.pose[:, 2]
    return ordered


def _steps_that_count(case: Case) -> BoolArray:
    """(n,) whether a scan and the next one see enough wall in common, by the truth."""
    counts = np.zeros(len(case.scans), dtype=np.bool_)
    if not np.isfinite(case.truth).any():
        return counts
    cells = [
        wall_cells(returns_at([scan], pose[None]))
        for scan, pose in zip(case.scans, case.truth, strict=True)
    ]
    counts[:-1] = [metres_in_common(*two) >= COMMON for two in pairwise(cells)]
    return counts


def figures(outcome: Outcome) -> Iterator[Figure]:
    """Yield what an outcome is to reach."""
    o, group = outcome, outcome.group
    largest, right = SHARES.get(group, (1.0, None))
    if group == "open":
        pass  # where nothing tells how far it went, it may be lost, or say so
    elif group == "fhw":
        yield Figure("components", o.components, 3)
        yield Figure("largest", 100 * o.largest, 100 * largest, "%", at_least=True)
        yield Figure("rms", o.position_error, 0.25, "m")
        yield Figure("worst scan / median", o.worst, 10)
    elif group in SHARES:
        yield Figure("largest", 100 * o.largest, 100 * largest, "%", at_least=True)
    elif group not in ("crowd", "world"):
        yield Figure("components", o.components, 1)
    if right is not None:
        yield Figure("steps right", 100 * o.steps_right, 100 * right, "%", at_least=True)
    if group in ("people", "body"):
        yield Figure("rms", o.position_error, 0.05, "m")
    if not group.startswith("exp"):
        yield Figure("silent errors", o.silent, 0)
    if group not in ("exp1", "exp2", "open"):  # which say so all the time, and rightly
        yield Figure("right, said open or lost", 100 * o.worded, 3, "%")


def _row(outcome: Outcome, figure: Figure) -> list[str]:
    sign, unit = ("≥" if figure.at_least else "≤"), f" {figure.unit}" if figure.unit else ""
    ratio = f"{figure.reached / figure.bound:.2f}" if figure.bound else "-"
    said = "reached" if figure.is_met else "SHORT"
    measured, bound = f"{figure.reached:.3g}{unit}", f"{sign} {figure.bound:g}{unit}"
    return [outcome.group, outcome.name, figure.what, measured, bound, ratio, said]
