"""Shapes: how often a submap's right place is among the first that the index of shapes proposes.

Submaps of stretches are looked up among those of all other stretches of their log, and of other
buildings, some of them made up where recordings are too few. Nothing else is asked: no correlation.
"""

import argparse
import time
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, islice
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from benchmarks.logs import find_logs, load_scans, load_truth
from benchmarks.pairs import is_right
from benchmarks.scale.made_up import robots_of
from benchmarks.stretches import map_stretches
from benchmarks.tables import OUTPUT, format_table, write_json
from benchmarks.truth import Path2D, true_frame
from mapweave.fusion.align import FusionParameters
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Submap
from mapweave.matching.coarse_places import CoarseMap, coarse_places
from mapweave.matching.place_index import Place, PlaceIndex, PlaceShape
from mapweave.scan.points import points_on_lines

SHARED = 10.0  # [m] in common with a submap of another stretch, for one that is to be found
GROUPS = (10.0, 15.0, 20.0, 30.0)  # [m] in common, at least
FIRST = 5  # places that are looked at
SPACING, NEAR = 0.15, 0.25  # [m] of points on walls; within which they are in common
FOUND = 0.95  # of the submaps, among the first
QUERY = ((1000, 2.0), (10_000, 4.0))  # submaps in the index, at most; [ms] of a query
CORRELATED = 100  # pairs of submaps, for how long correlation takes
ROBOTS = 4  # in a building that is made up
Key = tuple[str, int, int]  # building, stretch, number among all


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """A submap of a stretch, ready to be looked up.

    Attributes
    ----------
    key
        Its building, the stretch that it is of, and its number.
    frame
        (3,) of it in the log's corrected frame; NaN where that is not known.
    walls
        (m, 2) points along its walls in that frame, 0.15 m apart [m].
    middle
        (2,) of its walls, its own frame [m].
    submap
        It.
    """

    log: str
    key: Key
    frame: FloatArray
    walls: FloatArray
    middle: FloatArray
    shape: PlaceShape
    submap: Submap


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which logs, how they are cut, and how many submaps there are."""
    parser.add_argument("--logs", nargs="+", metavar="NAME", help="which logs (default all)")
    parser.add_argument(
        "--stretches", type=int, nargs="+", default=[6], metavar="N", help="a log is cut into (6)"
    )
    parser.add_argument(
        "--submaps", type=int, default=1000, metavar="N", help="in the index (1000)"
    )
    parser.add_argument("--output", type=Path, default=OUTPUT / "shape.json", help="%(default)s")


def run(options: argparse.Namespace) -> None:
    """Look every submap up, print how many were found; exit with 1 where a figure falls short."""
    logs, rows = find_logs(options.logs), list[dict[str, object]]()
    index: PlaceIndex[Key] = PlaceIndex()
    samples = [
        sample
        for log in logs
        for count in options.stretches
        for sample in samples_of(log.name, log.building, count, index)
    ]
    fillers = _fillers(options.submaps - len(samples), index)
    for log in logs:
        for count in options.stretches:
            rows += _look_up(log.name, count, samples, fillers, options.submaps)
    write_json(options.output, rows)
    print(tell(rows))
    lines, short = against_bars(rows, options.submaps)
    print("\n".join([*lines, without_words(rows, correlation_time(logs[0].name, options))]))
    if short:
        raise SystemExit(1)


def against_bars(rows: Sequence[dict[str, object]], submaps: int) -> tuple[list[str], bool]:
    """Return the figures beside what is to be reached, and whether one falls short."""
    found = sum(row["rank"] is not None for row in rows) / len(rows)
    took = float(np.median([float(str(row["milliseconds"])) for row in rows]))
    most = next((ms for size, ms in QUERY if submaps <= size), QUERY[-1][1])
    missed = found < FOUND, took > most
    told = ["short" if miss else "reached" for miss in missed]
    return [
        f"among the first {FIRST}: {found:.1%}, to reach {FOUND:.0%}: {told[0]}",
        f"a query, median: {took:.1f} ms, to reach {most:g} ms: {told[1]}",
    ], any(missed)


def correlation_time(name: str, options: argparse.Namespace) -> float:
    """[ms] of processor time that looking for one submap in another takes without words."""
    p = FusionParameters()
    asked = p.hypotheses.coarse, p.verification
    submaps = [
        s
        for m in map_stretches(find_logs([name])[0], options.stretches[0])
        for s in m.robot_map.submaps
    ]
    shapes = [CoarseMap.of(s.map, *asked) for s in submaps if len(s.map.segments) > 2]
    took = []
    for one, other in islice(combinations(shapes, 2), CORRELATED):
        start = time.process_time()
        coarse_places(one, other, *asked)
        took.append(time.process_time() - start)
    return 1000 * float(np.median(took))


def without_words(rows: Sequence[dict[str, object]], milliseconds: float) -> str:
    """Return what would be found at most without words, at the cost of looking words up.

    Submaps are drawn, as many as can be looked at in that time, and what is looked at is found if
    it is there.
    """
    shares = []
    for row in rows:
        took, right, among = (float(str(row[k])) for k in ("milliseconds", "right", "submaps"))
        looked_at = max(took / milliseconds, 1.0)
        shares.append(1 - (1 - min(looked_at / among, 1.0)) ** right)
    return (
        f"without words, by correlation of submaps drawn at that cost ({milliseconds:.1f} ms each):"
        f" {np.mean(shares):.1%} at most"
    )


def _fillers(count: int, index: PlaceIndex[Key]) -> list[tuple[Key, PlaceShape]]:
    """Return submaps of buildings made up, `count` at least."""
    found: list[tuple[Key, PlaceShape]] = []
    seed = 0
    while len(found) < count:
        for k, robot_map in enumerate(robots_of(seed, ROBOTS)[0]):
            for submap in robot_map.submaps:
                key = f"made up {seed}", k, submap.id
                found.append((key, index.prepare(submap.map)))
        seed += 1
    return found


def samples_of(name: str, building: str, count: int, index: PlaceIndex[Key]) -> list[Sample]:
    """Map a log in stretches; return all submaps with enough wall to have a shape."""
    log = find_logs([name])[0]
    truth = load_truth(log, np.array([scan.stamp for scan in load_scans(log)]))
    submaps = [
        (k, submap)
        for k, stretch in enumerate(map_stretches(log, count))
        for submap in stretch.robot_map.submaps
        if len(submap.map.segments) > 2
    ]
    return [
        _sample(f"{name}/{count}", (building, k, n), submap, truth, index)
        for n, (k, submap) in enumerate(submaps)
    ]


def _sample(
    log: str, key: Key, submap: Submap, truth: FloatArray, index: PlaceIndex[Key]
) -> Sample:
    path = Path2D(0, submap.trajectory.scan_index, submap.trajectory.pose)
    frame = true_frame(path, truth)
    walls = se2.transform_points(frame, points_on_lines(submap.map, SPACING)[0].points)
    middle = submap.map.segments.reshape(-1, 2).mean(axis=0)
    return Sample(log, key, frame, walls, middle, index.prepare(submap.map), submap)


def _look_up(
    name: str,
    count: int,
    samples: Sequence[Sample],
    fillers: Sequence[tuple[Key, PlaceShape]],
    size: int,
) -> list[dict[str, object]]:
    """Return a row for each submap of one log in so many stretches that is to be found."""
    own = [s for s in samples if s.log == f"{name}/{count}"]
    others = [s for s in samples if s.key[0] != own[0].key[0]]
    drawn = np.random.default_rng(1).permutation(len(others))[: max(size - len(own), 0)]
    index: PlaceIndex[Key] = PlaceIndex()
    known: dict[Key, Sample] = {}
    for number, sample in enumerate([*own, *(others[k] for k in drawn)]):
        known[sample.key[0], sample.key[1], number] = sample
        index.add((sample.key[0], sample.key[1], number), sample.shape, sample.key[:2])
    for key, shape in fillers[: max(size - len(index), 0)]:
        index.add(key, shape, key[:2])
    rows = []
    for sample in own:
        shared = shared_with(sample, own)
        if shared.max(initial=0.0) >= SHARED:
            rows.append(_row(sample, shared, index, known))
    return rows


def shared_with(sample: Sample, own: Sequence[Sample]) -> FloatArray:
    """(n,) [m] of wall in common with each submap of another stretch."""
    if not np.isfinite(sample.frame[0]):
        return np.empty(0)
    others = [s for s in own if s.key[1] != sample.key[1] and np.isfinite(s.frame[0])]
    return np.array([_shared(sample.walls, s.walls) for s in others])


def _shared(first: FloatArray, second: FloatArray) -> float:
    """[m] of wall in common, the mean of both ways."""
    apart = [
        KDTree(b).query(a, distance_upper_bound=NEAR)[0]
        for a, b in ((first, second), (second, first))
    ]
    return float(SPACING * sum(np.isfinite(distance).sum() for distance in apart) / 2)


def _row(
    sample: Sample, shared: FloatArray, index: PlaceIndex[Key], known: dict[Key, Sample]
) -> dict[str, object]:
    """Look a submap up in all but those of its own stretch."""
    building, stretch, _ = sample.key
    start = time.process_time()
    found = index.query(sample.shape, FIRST, but=(building, stretch))
    took = time.process_time() - start
    right = [_is_right(sample, place, known) for place in found]
    rank = right.index(True) if True in right else None
    return {
        "log": sample.log,
        "shared": float(shared.max()),
        "right": int((shared >= SHARED).sum()),
        "rank": rank,
        "milliseconds": 1000 * took,
        "submaps": len(index),
    }


def _is_right(sample: Sample, place: Place[Key], known: dict[Key, Sample]) -> bool:
    """Tell whether a place is right within 0.5 m at the middle of the submap, and 5°."""
    there = known.get(place.key)  # none of what is made up
    if there is None or place.key[0] != sample.key[0] or not np.isfinite(there.frame[0]):
        return False
    true = se2.between(there.frame, sample.frame)
    apart = se2.transform_points(place.transform, sample.middle) - se2.transform_points(
        true, sample.middle
    )
    return is_right(float(np.hypot(*apart)), float(np.abs(se2.wrap(place.transform[2] - true[2]))))


def tell(rows: Sequence[dict[str, object]]) -> str:
    """Return the table by log, and by the wall in common."""
    groups: dict[str, list[dict[str, object]]] = defaultdict(list)
    for row in rows:
        shared = float(str(row["shared"]))
        groups[str(row["log"])].append(row)
        groups[f"{max(g for g in GROUPS if g <= shared):g} m and more in common"].append(row)
        groups["all"].append(row)
    head = ["submaps", "to be found", "first", f"first {FIRST}", "in the index", "ms, median"]
    return format_table(head, [_tell_group(name, groups[name]) for name in sorted(groups)])


def _tell_group(name: str, rows: Sequence[dict[str, object]]) -> list[str]:
    ranks = [row["rank"] for row in rows]
    share = [sum(r in range(most) for r in ranks) / len(rows) for most in (1, FIRST)]
    among = max(int(str(row["submaps"])) for row in rows)
    took = float(np.median([float(str(row["milliseconds"])) for row in rows]))
    return [name, str(len(rows)), *(f"{s:.1%}" for s in share), str(among), f"{took:.1f}"]
