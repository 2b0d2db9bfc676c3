"""Across: stretches of all cuts against those of other buildings, none of which may be joined.

Pairs are drawn once; what was compared is kept, and a run goes on where the one before ended.
"""

import argparse
import json
from collections import Counter
from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.fusion import outcome_rows
from benchmarks.logistic import calibration_error, reliability
from benchmarks.logs import find_logs
from benchmarks.pairs import compare
from benchmarks.runs import COMPARING, MAPPING, sources
from benchmarks.stretches import Stretch, map_stretches
from benchmarks.tables import OUTPUT
from mapweave.commands.progress import track

CUTS = (3, 4, 5, 6, 7, 8)
SURE = 0.85


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which logs, how many pairs, and how many of them now."""
    parser.add_argument("--logs", nargs="+", metavar="NAME", help="which logs (default all)")
    parser.add_argument(
        "--stretches", type=int, nargs="+", default=CUTS, metavar="N", help="cuts of a log (3 to 8)"
    )
    parser.add_argument("--pairs", type=int, default=10_000, metavar="N", help="drawn (10000)")
    parser.add_argument("--at-most", type=int, metavar="N", help="compared now (all that are left)")
    parser.add_argument("--seed", type=int, default=1, help="draws them (1)")
    parser.add_argument("--output", type=Path, default=OUTPUT / "across.jsonl", help="%(default)s")


def run(options: argparse.Namespace) -> None:
    """Compare what is left, print what came of all; exit with 1 where anything was joined."""
    cuts = [map_stretches(log, n) for log in find_logs(options.logs) for n in options.stretches]
    stretches = [stretch for cut in cuts for stretch in cut]
    pairs = draw([s.log.building for s in stretches], options.pairs, options.seed)
    rows = _kept(options.output)
    known = {(row["first"], row["second"]) for row in rows}
    left = [(stretches[i], stretches[j]) for i, j in pairs]
    left = [pair for pair in left if (pair[0].name, pair[1].name) not in known]
    chosen = list(islice(left, options.at_most))
    options.output.parent.mkdir(parents=True, exist_ok=True)
    with options.output.open("a" if rows else "w") as file:
        for first, second in track(chosen, "comparing", len(chosen)):
            row = _compared(first, second)
            file.write(json.dumps(row) + "\n")
            file.flush()
            rows.append(row)
    print(tell(rows, len(pairs)))
    if any(is_joined(row) for row in rows):
        raise SystemExit(1)


def draw(buildings: Sequence[str], count: int, seed: int) -> list[tuple[int, int]]:
    """Return `count` pairs of places in `buildings` that differ, in random order, or all there are.

    Of stretches of one building no pair is drawn: what is joined there may be right.
    """
    names = np.array(buildings)
    i, j = np.nonzero(np.triu(names[:, None] != names[None, :]))
    drawn = np.random.default_rng(seed).permutation(len(i))[:count]
    return [(int(i[k]), int(j[k])) for k in drawn]


def _kept(file: Path) -> list[dict[str, Any]]:
    """Return what was compared before by the same sources."""
    if not file.is_file():
        return []
    rows = [json.loads(line) for line in file.read_text().splitlines()]
    return rows if all(row["sources"] == _sources() for row in rows) else []


def _sources() -> str:
    return sources(MAPPING, COMPARING).hex()


def _compared(first: Stretch, second: Stretch) -> dict[str, Any]:
    found = outcome_rows(compare(first, second))
    names = {"first": first.name, "second": second.name}
    return {**names, "sources": _sources(), "alignments": found}


def is_joined(row: dict[str, Any]) -> bool:
    """Tell whether anything of two buildings was joined."""
    return any(a["decision"] == "accepted" for a in row["alignments"])


def _weight(alignment: dict[str, Any]) -> tuple[bool, float]:
    return alignment["decision"] == "accepted", float(alignment["confidence"])


def tell(rows: Sequence[dict[str, Any]], of: int) -> str:
    """Return how many pairs were decided how, how far confidences are off, and what was joined."""
    best = [max(row["alignments"], key=_weight) for row in rows if row["alignments"]]
    counts = Counter(str(each["decision"]) for each in best)
    told = ", ".join(f"{count} {decision}" for decision, count in sorted(counts.items()))
    sure = sum(float(each["confidence"]) > SURE for each in best)
    lines = [f"{len(rows)} of {of} pairs across buildings: {told}; {sure} over {SURE:.0%}"]
    every = [a for row in rows for a in row["alignments"]]
    if every:
        said = np.array([float(a["confidence"]) for a in every])
        error = calibration_error(reliability(said, np.zeros(len(said), dtype=np.bool_)))
        lines.append(f"  {len(every)} pairs of components: calibration error {error:.3f}")
    joined = [a for a in every if a["decision"] == "accepted"]
    lines += [f"  joined: {a['reference']} - {a['other']}: {a['reason']}" for a in joined]
    return "\n".join(lines)
