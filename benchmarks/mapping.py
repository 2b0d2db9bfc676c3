"""One robot: every log mapped without odometry, one table."""

import argparse
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from benchmarks.calibration import within_two_sigma
from benchmarks.compactness import Compactness, compactness
from benchmarks.coverage import explained_share, returns_at
from benchmarks.logs import Log, find_logs, load_scans, load_truth
from benchmarks.runs import Run, map_scans
from benchmarks.tables import OUTPUT, format_table, write_json
from benchmarks.truth import (
    Path2D,
    RelationError,
    false_meetings,
    paths,
    position_error,
    relation_error,
    steps_right,
)
from mapweave.geometry.arrays import FloatArray
from mapweave.io.map_files import write_map
from mapweave.maps import JointMap, RobotMap, component_name
from mapweave.pictures.picture import draw_joint, draw_map
from mapweave.scan.scan import Scan
from mapweave.team.joint_map import build_joint_map

COMPARISON = """\
For comparison, mean relation errors of others, on all relations and with their odometry
(Kümmerle et al. 2009; Hess et al. 2016), and of the log's own corrected poses on the joined ones:
  fr079      Cartographer 0.045 m 0.54°, graph mapping 0.056 m, scan matching 0.258 m; own 0.051 m
  intel-lab  Cartographer 0.023 m 0.45°, graph mapping 0.031 m, scan matching 0.220 m; own 0.043 m
  killian    graph mapping 0.050 m, scan matching 1.651 m; own 0.039 m"""
HEAD = ["log", "scans", "placed", "largest", "comp.", "steps right", "ATE m", "explained"]
HEAD += ["segments", "file kB", "ms/scan", "real time"]
COMPACT_HEAD = ["log", "segments", "metres", "drawn twice", "slivers", "ends that meet"]
TRUST_HEAD = ["log", "false meetings", "within 2 sigma: along", "across", "turn"]
RELATION_HEAD = ["log", "joined", "used", "mean m", "sd m", "mean °", "sd °"]


@dataclass(frozen=True, slots=True)
class Figures:
    """What one log came to.

    Attributes
    ----------
    placed, largest
        Scans in some component, and in the largest.
    steps, steps_right
        Steps within one component whose truth is known, and those right.
    position_error
        [m] rms of the largest component, moved rigidly.
    explained
        Share of the returns under 12 m of the largest component within 10 cm of its lines.
    compactness
        Of the largest component, merged.
    size
        [bytes] of the whole MAP.json.
    scan_time
        [s] per scan, on a machine that may have been busy.
    duration
        [s] of the recording.
    false_meetings
        Pairs of stretches of the largest component that the map shows at one place, and that are
        at two: wrong closures.
    within_two_sigma
        Shares of the steps that err by less than what was told of their poses: in the direction
        held least, across it, and in heading.
    """

    log: str
    scans: int
    placed: int
    largest: int
    components: int
    steps: int
    steps_right: int
    position_error: float
    explained: float
    compactness: Compactness
    size: int
    scan_time: float
    duration: float
    false_meetings: int
    within_two_sigma: tuple[float, ...]
    relations: RelationError | None


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which logs, and where results go."""
    parser.add_argument("--logs", nargs="+", metavar="NAME", help="which logs (default all)")
    parser.add_argument(
        "--odometry",
        choices=("none", "prior", "wrong"),
        default="none",
        help="none, the log's own (corrected poses, in most logs), or a random walk (%(default)s)",
    )
    parser.add_argument("--output", type=Path, default=OUTPUT / "map", help="folder (%(default)s)")


def run(options: argparse.Namespace) -> None:
    """Map the logs, print the tables, write the maps, their pictures and the figures."""
    figures = []
    for log in find_logs(options.logs):
        figures.append(_measure(log, options.odometry, options.output))
        write_json(options.output / "figures.json", [asdict(f) for f in figures])
    print(tell(figures))
    print(f"Pictures, maps and figures.json are in {options.output}")


def _measure(log: Log, odometry: str, folder: Path) -> Figures:
    scans = load_scans(log, odometry)
    made = map_scans(log.name, scans)
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"{log.name}.json"
    write_map(file, made.robot_map)
    draw_map(made.robot_map, folder / f"{log.name}.png", title=f"{log.name}, odometry: {odometry}")
    merged = merge(made.robot_map)
    draw_joint(
        merged, folder / f"{log.name}-merged.png", {"r1": made.robot_map}, f"{log.name}, merged"
    )
    return _figures(log, scans, made, merged, file.stat().st_size)


def _figures(log: Log, scans: Sequence[Scan], made: Run, merged: JointMap, size: int) -> Figures:
    stamps = np.array([scan.stamp for scan in scans])
    truth = load_truth(log, stamps)
    found = paths(made.robot_map)
    lines = segments_of(merged, found[0].component)
    right = steps_right(found, truth)
    return Figures(
        log=log.name,
        scans=len(scans),
        placed=sum(len(path.index) for path in found),
        largest=len(found[0].index),
        components=len(found),
        steps=len(right),
        steps_right=int(right.sum()),
        position_error=position_error(found[0], truth),
        explained=_explained(found[0], scans, lines),
        compactness=compactness(lines),
        size=size,
        scan_time=made.seconds / len(scans),
        duration=float(np.ptp(stamps)),
        false_meetings=false_meetings(found[0], truth),
        within_two_sigma=tuple(within_two_sigma(made.robot_map, truth).tolist()),
        relations=relation_error(log.relations, stamps, found) if log.relations else None,
    )


def merge(robot_map: RobotMap) -> JointMap:
    """Return `robot_map` as the team would keep it: each component merged into one line map."""
    names = {c: component_name(robot_map.robot, c) for c in robot_map.components}
    return build_joint_map({names[c]: robot_map.lines(c) for c in names}, [], version=1)


def segments_of(merged: JointMap, component: int) -> FloatArray:
    """Return the (n, 4) segments [m] of a component of the one robot in `merged`, its frame."""
    return next(
        each.map.segments
        for each in merged.components
        if any(name.endswith(f"/{component}") for name in each.robots)
    )


def _explained(path: Path2D, scans: Sequence[Scan], segments: FloatArray) -> float:
    points = returns_at([scans[k] for k in path.index], path.pose)
    return explained_share(points, segments)


def tell(figures: Sequence[Figures]) -> str:
    """Return the tables as text."""
    related = [_relation_row(f.log, f.relations) for f in figures if f.relations]
    parts = [format_table(HEAD, [_row(f) for f in figures])]
    parts += ["\nThe merged lines:", format_table(COMPACT_HEAD, [_compact_row(f) for f in figures])]
    parts += ["\nPlaces taken for one another, and how well determined poses were said to be:"]
    parts += [format_table(TRUST_HEAD, [_trust_row(f) for f in figures])]
    if related:
        parts += ["\nGround-truth relations that join the log by timestamp:"]
        parts += [format_table(RELATION_HEAD, related), COMPARISON]
    return "\n".join(parts)


def _row(f: Figures) -> list[str]:
    return [
        f.log,
        str(f.scans),
        f"{f.placed / f.scans:.1%}",
        f"{f.largest / f.scans:.1%}",
        str(f.components),
        f"{f.steps_right / max(f.steps, 1):.2%} of {f.steps}",
        f"{f.position_error:.3f}",
        f"{f.explained:.1%}",
        str(f.compactness.segments),
        f"{f.size / 1000:.0f}",
        f"{1000 * f.scan_time:.1f}",
        f"{f.duration / (f.scan_time * f.scans):.0f}x",
    ]


def _compact_row(f: Figures) -> list[str]:
    c = f.compactness
    counts = [str(c.segments), f"{c.length:.0f}", f"{c.doubled:.1%}", str(c.slivers)]
    return [f.log, *counts, f"{c.meeting:.1%}"]


def _trust_row(f: Figures) -> list[str]:
    return [f.log, str(f.false_meetings), *(f"{share:.1%}" for share in f.within_two_sigma)]


def _relation_row(log: str, error: RelationError) -> list[str]:
    return [
        log,
        str(error.joined),
        str(error.used),
        f"{error.translation:.3f}",
        f"{error.translation_sd:.3f}",
        f"{np.degrees(error.rotation):.2f}",
        f"{np.degrees(error.rotation_sd):.2f}",
    ]
