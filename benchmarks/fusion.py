"""Fusion: every pair of stretches of a log, and pairs across buildings: recall and wrong joins.

The peers get the same pairs, side by side.
"""

import argparse
import math
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import get_args

import numpy as np

from benchmarks import peers
from benchmarks.ablation import WITHOUT, aligning_without, parameters_without
from benchmarks.logs import find_logs
from benchmarks.pairs import Match, Outcome, Pair, choose_pairs, compare
from benchmarks.stretches import Stretch, map_stretches
from benchmarks.tables import OUTPUT, format_table, write_json
from mapweave.commands.progress import track
from mapweave.evidence import RunnerUp

ROWS = OUTPUT / "fusion.json"
BENT = 0.3  # [m] rms from which on a map is named as bent
GROUPS = (50.0, 30.0, 15.0, 5.0, 0.0)  # [m] in common, at least
SIZES = (0, 100, 150, 300, 500)  # segments of the larger map, at least
OUTCOMES: tuple[Outcome, ...] = get_args(Outcome)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which logs, how they are cut, and where the rows go."""
    parser.add_argument("--logs", nargs="+", metavar="NAME", help="which logs (default all)")
    parser.add_argument(
        "--stretches", type=int, nargs="+", default=[6], metavar="N", help="a log is cut into (6)"
    )
    parser.add_argument(
        "--across", type=int, default=200, metavar="N", help="pairs across buildings at most (200)"
    )
    parser.add_argument("--seed", type=int, default=1, help="draws those pairs (1)")
    parser.add_argument(
        "--no-peers", dest="peers", action="store_false", help="mapweave alone, nothing beside it"
    )
    parser.add_argument(
        "--without",
        choices=WITHOUT,
        help="leave out shape words (the places that they propose, and how rare shapes are),"
        " correlation (so that words alone propose), or that what is dissimilar where maps are"
        " aligned counts against them",
    )
    parser.add_argument("--output", type=Path, default=ROWS, help="rows as JSON (%(default)s)")


def run(options: argparse.Namespace) -> None:
    """Compare all pairs, print the tables and every wrong join, write the rows."""
    pairs: list[Pair] = []
    logs, parameters = find_logs(options.logs), parameters_without(options.without)
    aligning = aligning_without(options.without)
    for count in options.stretches:
        stretches = [stretch for log in logs for stretch in map_stretches(log, count)]
        print(_tell_maps(stretches, count))
        chosen = choose_pairs(stretches, options.across, options.seed)
        pairs += [compare(a, b, parameters, aligning) for a, b in track(chosen, "comparing")]
        write_json(options.output, [row for pair in pairs for row in outcome_rows(pair)])
    print(tell(pairs))
    print(f"All comparisons are in {options.output}")
    if options.peers:
        rows = options.output.with_stem(f"{options.output.stem}-peers")
        print(peers.tell_beside(pairs, logs, options.stretches, rows))


def _tell_maps(stretches: Sequence[Stretch], count: int) -> str:
    parts = [(s.name, part.bend) for s in stretches for part in s.parts.values()]
    broken = [f"{s.name} ({len(s.parts)})" for s in stretches if len(s.parts) > 1]
    bent = [f"{name} ({bend:.2f} m)" for name, bend in parts if bend > BENT]
    return "\n".join(
        [
            f"{len(stretches)} stretches, {count} a log",
            f"  of more than one component: {', '.join(broken) or 'none'}",
            f"  maps bent by more than {BENT:g} m rms: {', '.join(bent) or 'none'}",
        ]
    )


def tell(pairs: Sequence[Pair]) -> str:
    """Return the table, the wrong joins with their evidence, and the time."""
    head = ["wall in common", "pairs", *OUTCOMES, "recall"]
    lines = [format_table(head, [_group_row(name, group) for name, group in _grouped(pairs)])]
    wrong = [pair for pair in pairs if pair.outcome == "joined wrong"]
    lines.append(f"Wrong joins: {len(wrong)}")
    lines += [f"  {_tell_match(pair, m)}" for pair in wrong for m in pair.matches if _is_wrong(m)]
    lines.append(_tell_time(pairs))
    return "\n".join(lines)


def _grouped(pairs: Sequence[Pair]) -> list[tuple[str, list[Pair]]]:
    inside = [pair for pair in pairs if not pair.crosses]
    groups, most = [], math.inf
    for least in GROUPS:
        name = f"{least:g} m and more" if most == math.inf else f"{least:g} to {most:g} m"
        groups.append((name, [pair for pair in inside if least <= pair.common < most]))
        most = least
    return [*groups, ("other building", [pair for pair in pairs if pair.crosses])]


def _group_row(name: str, group: Sequence[Pair]) -> list[str]:
    counts = [sum(pair.outcome == outcome for pair in group) for outcome in OUTCOMES]
    recall = f"{counts[0] / len(group):.0%}" if group and not group[0].crosses else "-"
    return [name, str(len(group)), *map(str, counts), recall]


def _is_wrong(match: Match) -> bool:
    return match.alignment.decision == "accepted" and not match.right


def _tell_match(pair: Pair, match: Match) -> str:
    a = match.alignment
    bends = " and ".join(f"{bend:.2f} m" for bend in match.bends)
    numbers = ", ".join(f"{name} {value:.2f}" for name, value in a.evidence.by_name().items())
    off = "other building" if pair.crosses else f"{match.distance:.2f} m {_degrees(match)} off"
    return (
        f"{a.reference} - {a.other}: {off}, {pair.common:.0f} m truly in common, maps bent by"
        f" {bends}, confidence {a.confidence:.2f}: {a.reason} ({numbers})"
    )


def _degrees(match: Match) -> str:
    return f"{np.degrees(match.turn):.1f}°"


def _tell_time(pairs: Sequence[Pair]) -> str:
    """Return how long comparing two components took, by the size of the larger map."""
    rows = []
    for least, most in zip(SIZES, [*SIZES[1:], math.inf], strict=True):
        group = [pair for pair in pairs if least <= max(pair.segments) < most]
        for joined in (True, False):
            part = [pair for pair in group if pair.outcome.startswith("joined") == joined]
            if part:
                rows.append(_time_row(f"{least} and more", "joined" if joined else "not", part))
    head = ["segments", "maps are", "pairs", "median ms", "95 % ms"]
    return "Comparing two components, their preparation included:\n" + format_table(head, rows)


def _time_row(size: str, joined: str, pairs: Sequence[Pair]) -> list[str]:
    each = [1000 * pair.seconds / len(pair.matches) for pair in pairs]
    median, most = np.percentile(each, [50, 95])
    return [size, joined, str(len(pairs)), f"{median:.0f}", f"{most:.0f}"]


def outcome_rows(pair: Pair) -> list[dict[str, object]]:
    """Return a row for each match: the pair, the alignment, how far off it is."""
    names = (field.name for field in fields(pair) if field.name != "matches")
    whole = {name: getattr(pair, name) for name in names}
    return [{**whole, **_match_row(match)} for match in pair.matches]


def _match_row(match: Match) -> dict[str, object]:
    a = match.alignment
    return {
        "reference": a.reference,
        "other": a.other,
        "decision": a.decision,
        "confidence": a.confidence,
        "reason": a.reason,
        "evidence": a.evidence.by_name(),
        "runner_up": _rival(a.runner_up),
        "transform": a.transform.tolist(),
        "distance": match.distance if math.isfinite(match.distance) else None,
        "turn": match.turn,
        "whole": match.whole if math.isfinite(match.whole) else None,
        "right": match.right,
        "bends": match.bends,
    }


def _rival(runner_up: RunnerUp | None) -> dict[str, object] | None:
    if runner_up is None:
        return None
    return {"transform": runner_up.transform.tolist(), **runner_up.by_name()}
