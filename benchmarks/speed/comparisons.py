"""What comparing two maps costs, beside AKAZE on the same pairs; and what merging lines costs."""

import importlib
from collections import defaultdict
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from benchmarks.logs import Log, find_logs
from benchmarks.pairs import choose_pairs
from benchmarks.peer_features import feature_peers
from benchmarks.peer_types import Peer, View
from benchmarks.peer_views import view_stretches
from benchmarks.speed.rows import Report, timed
from benchmarks.speed.scans import EXTRA
from benchmarks.stretches import Stretch, map_stretches
from mapweave.fusion.align import align, align_maps
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.lines.merging import evolve
from mapweave.lines.polylines import group_polylines
from mapweave.maps import LineMap
from mapweave_deploy.sim.office import office

LEAST, MOST = 100, 150  # segments of the larger map: as the fusion benchmark groups them
ACROSS = 40  # pairs of two buildings, at the most
NOISE = 0.02  # [m]
OFFICE = 31.0, 21.0  # [m] from one simulated office to the next
SIZES = (50, 150, 500, 1500, 5000)
COMPARED = (150, 500, 1500, 5000)
Pairs = Sequence[tuple[Stretch, Stretch]]


def measure_pairs(report: Report, logs: Sequence[str], counts: Sequence[int]) -> None:
    """Compare the maps of stretches of logs as robots do, and have AKAZE match the same pairs.

    Parameters
    ----------
    counts
        Into how many stretches the logs are cut, one cut after the other.
    """
    found = find_logs(logs)
    pairs = [pair for count in counts for pair in _middling_pairs(found, count)]
    times = defaultdict[str, list[float]](list)
    for a, b in pairs:
        alignments, seconds = timed(partial(align, a.robot_map, b.robot_map))
        joined = any(each.decision == "accepted" for each in alignments)
        times["joined" if joined else "refused"].append(seconds / len(alignments))
    for outcome, bound in (("joined", 15), ("refused", 3)):
        if outcome in times:
            row = report.time(
                f"comparison, {outcome}", f"{LEAST} to {MOST} segments", times[outcome]
            )
            report.reach(f"comparison, {outcome}", row.median, bound, "ms")
        else:
            report.leave_out(f"comparison, {outcome}", "no pair of these logs ends so")
    _measure_akaze(report, pairs, counts)


def _middling_pairs(logs: Sequence[Log], count: int) -> Pairs:
    """Return the pairs of maps of which the larger has so many segments as figures are given for.

    Those within a log come first, then some across buildings.
    """
    stretches = [s for log in logs for s in map_stretches(log, count)]
    every = choose_pairs(stretches, len(stretches) ** 2, seed=1)
    pairs = [(a, b) for a, b in every if LEAST <= max(a.segments, b.segments) < MOST]
    within = sum(a.log == b.log for a, b in pairs)
    return pairs[: within + ACROSS]


def _measure_akaze(report: Report, pairs: Pairs, counts: Sequence[int]) -> None:
    try:
        cv2 = importlib.import_module("cv2")
    except ImportError as error:
        report.leave_out("AKAZE (map_merge)", f"{error}; {EXTRA}")
        return
    cv2.setNumThreads(1)
    akaze = feature_peers(cv2)[0]
    logs = {s.log.name: s.log for pair in pairs for s in pair}
    names = {s.name for pair in pairs for s in pair}
    cuts = [(log, count) for log in logs.values() for count in counts]
    views = {v.name: v for cut in cuts for v in view_stretches(*cut) if v.name in names}
    times = [timed(partial(_match, akaze, views[a.name], views[b.name]))[1] for a, b in pairs]
    if times:
        report.time("comparison, AKAZE as in map_merge", "the same pairs", times)


def _match(peer: Peer, first: View, second: View) -> None:
    peer.match(peer.prepare(first), peer.prepare(second))


def measure_segments(report: Report) -> None:
    """Merge lines that are all of one wall, of a long one, and of many; compare large maps."""
    kinds: dict[str, Callable[[int], FloatArray]] = {
        "one wall of 10 m": lambda n: wall(n, 10.0),
        "one wall of 100 m": lambda n: wall(n, 100.0),
        "20 sightings a wall": many_walls,
    }
    for kind, made in kinds.items():
        medians = []
        for size in SIZES:
            lines = made(size)
            times = _repeated(partial(evolve, lines))
            medians.append(report.time("lines merged", f"{size}, {kind}", times).median)
        report.grow(f"merging, {kind}", "segments", SIZES, medians)
    _measure_large_maps(report)


def _measure_large_maps(report: Report) -> None:
    """Compare simulated maps with themselves, seen again."""
    medians = []
    for size in COMPARED:
        first = buildings(size)
        second = _seen_again(first)
        work = partial(align_maps, ("a/0", first), ("b/0", second))
        of = f"{size} segments, {work().decision}"
        medians.append(report.time("comparison, simulated", of, _repeated(work)).median)
    grown = report.grow("comparison", "segments", COMPARED, medians)
    report.reach("comparison grows with segments: exponent", grown.exponent, 1.2)


def _repeated(work: Callable[[], object], most: float = 1.0) -> list[float]:
    """Return the times of `work` [s], repeated for `most` seconds, 15 times at the most."""
    times = [timed(work)[1]]
    while len(times) < 15 and sum(times) < most:
        times.append(timed(work)[1])
    return times


def wall(count: int, length: float) -> FloatArray:
    """Return (count, 4) sightings [m], with noise, of pieces of one wall of `length` [m]."""
    rng = np.random.default_rng(count)
    ends = np.sort(rng.uniform(0.0, length, (count, 2)), axis=1)
    level = np.zeros(count)
    along = np.column_stack([ends[:, 0], level, ends[:, 1] + 0.3, level])
    noisy = along + rng.normal(0.0, NOISE, along.shape)
    return se2.transform_segments(np.array([5.0, 5.0, 0.7]), noisy)


def many_walls(count: int) -> FloatArray:
    """Return (count, 4) sightings [m], with noise, of walls of 3 m, 20 of each."""
    rng = np.random.default_rng(count)
    walls = -(-count // 20)
    middle = rng.uniform(0.0, 3.0 * np.sqrt(walls), (walls, 2))
    turn = rng.choice(4, walls) * np.pi / 2
    half = 1.5 * np.column_stack([np.cos(turn), np.sin(turn)])
    seen = np.repeat(np.hstack([middle - half, middle + half]), 20, axis=0)[:count]
    return np.asarray(seen + rng.normal(0.0, NOISE, seen.shape))


def buildings(count: int) -> LineMap:
    """Return a map of `count` segments: furnished offices, no two alike, in a square."""
    walls: list[FloatArray] = []
    while sum(map(len, walls)) < count:
        k = len(walls)
        side = int(np.sqrt(k))
        column, row = (
            (side, k - side**2) if k - side**2 <= side else ((side + 1) ** 2 - k - 1, side)
        )
        place = np.array([column * OFFICE[0], row * OFFICE[1], 0.0])
        walls.append(se2.transform_segments(place, office(k + 1).walls))
    return _line_map(np.concatenate(walls)[:count])


def _line_map(segments: FloatArray) -> LineMap:
    order, polyline = group_polylines(segments, 0.5)
    return LineMap(segments[order], polyline, np.full(len(order), 10))


def _seen_again(line_map: LineMap) -> LineMap:
    """Return the same walls with noise in another frame."""
    rng = np.random.default_rng(len(line_map.segments))
    noisy = line_map.segments + rng.normal(0.0, NOISE, line_map.segments.shape)
    return _line_map(se2.transform_segments(np.array([3.0, -2.0, 1.0]), noisy))
