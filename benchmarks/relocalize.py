"""Relocalisation: a single scan of a later lap, looked for in the whole map of an earlier part."""

import argparse
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from benchmarks.localize import DISTANCE, TURN, Mapped
from benchmarks.logs import Log, find_logs, load_scans, load_truth
from benchmarks.runs import map_remembered
from benchmarks.tables import OUTPUT, format_table, write_json
from mapweave.mapping.localization.known_map import KnownMap
from mapweave.mapping.localization.scan_finder import ScanFinder
from mapweave.mapping.tracking.observation import ObservationParameters, observe

SHARES = {"fr079": 0.6, "intel": 0.5, "csail": 0.6}  # of each log, that is mapped
HEAD = ["log", "scans", "found", "wrong", "mean ms", "worst ms"]


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of the scans of a log: how many were found, rightly or not, and how fast.

    Attributes
    ----------
    mean_ms, worst_ms
        Processor time of a scan.
    wrong
        Their numbers.
    """

    log: str
    scans: int
    found: int
    wrong: list[int]
    mean_ms: float
    worst_ms: float


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which logs, how many scans, and where the figures go."""
    parser.add_argument("--logs", nargs="+", default=tuple(SHARES), metavar="NAME")
    parser.add_argument("--scans", type=int, default=200, help="of a log (%(default)s)")
    parser.add_argument("--output", type=Path, default=OUTPUT / "relocalize.json")


def run(options: argparse.Namespace) -> None:
    """Look for scans of each log, print the table, write the figures."""
    outcomes = [look_for(log, options.scans) for log in find_logs(options.logs)]
    print(format_table(HEAD, [_row(each) for each in outcomes]))
    write_json(options.output, [asdict(each) for each in outcomes])


def look_for(log: Log, count: int) -> Outcome:
    """Look for so many scans of the later part of a log, drawn where the first part has been."""
    scans = load_scans(log)
    truth = load_truth(log, np.array([scan.stamp for scan in scans]))
    share = SHARES.get(log.name, 0.5)
    first = int(share * len(scans))
    known = map_remembered(f"{log.name} first {share:.0%}", log.path, scans[:first], "r1")
    mapped, finder = Mapped(known, truth), ScanFinder(KnownMap.of(known))
    seen_before = [k for k in range(first, len(scans)) if mapped.faces(truth[k])]
    drawn = np.random.default_rng(0).choice(
        seen_before, min(count, len(seen_before)), replace=False
    )
    seconds, found, wrong = [], 0, []
    finder.find(observe(scans[first], ObservationParameters()))  # what is made once is made
    for k in sorted(drawn.tolist()):
        start = time.process_time()
        place = finder.find(observe(scans[k], ObservationParameters()))
        seconds.append(time.process_time() - start)
        if place is None:
            continue
        found += 1
        distance, turn = mapped.error(place.component, place.pose, truth[k])
        if distance > DISTANCE or turn > TURN:
            wrong.append(k)
    times = 1000 * np.array(seconds)
    return Outcome(log.name, len(drawn), found, wrong, float(times.mean()), float(times.max()))


def _row(each: Outcome) -> list[str]:
    right = 100 * (each.found - len(each.wrong)) / each.scans
    times = f"{each.mean_ms:.1f}", f"{each.worst_ms:.1f}"
    return [each.log, f"{each.scans}", f"{right:.1f} %", f"{len(each.wrong)}", *times]
