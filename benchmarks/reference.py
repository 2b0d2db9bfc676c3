"""The paper's loop as printed, and what shape carries: pairs of stretches of real logs.

First the literal loop (H1, H2, V1, V2): how often its first proposal is right, how often one of its
first 50 is, and what V2 confirms. Then mapweave's own fusion with what proposes by shape switched
off, stage by stage: how many pairs are joined all the same.
"""

import argparse
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import get_args

from benchmarks.logs import find_logs
from benchmarks.mapping import merge
from benchmarks.pairs import Outcome, choose_pairs, compare, is_right
from benchmarks.stretches import Part, Stretch, alignment_error, common, map_stretches
from benchmarks.tables import format_table
from mapweave.commands.progress import track
from mapweave.fusion.align import FusionParameters
from mapweave.fusion.decision import DecisionParameters
from mapweave.fusion.reference import Proposal, ReferenceParameters, proposals
from mapweave.geometry import se2
from mapweave.maps import LineMap
from mapweave.matching.hypotheses import HypothesisParameters
from mapweave.matching.verification import VerificationParameters
from mapweave.shape.corners import CornerParameters

TRIES = 50
OBJECTS = {  # what the loop selects in H1: its parameter `part_segments`
    "whole polylines": None,
    "20 consecutive segments": 20,
    "10 consecutive segments": 10,
    "5 consecutive segments": 5,
}
OUTCOMES: tuple[Outcome, ...] = get_args(Outcome)
Twins = Sequence[tuple[Stretch, Stretch]]


@dataclass(frozen=True, slots=True)
class Rounds:
    """What the loop came to for one pair of maps.

    Attributes
    ----------
    right
        Of each of its first 50 proposals, whether it is right.
    confirmed
        Whether the first one that V2 confirms is right; None where it confirms none.
    """

    right: tuple[bool, ...]
    confirmed: bool | None


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which logs, how they are cut, and which pairs count."""
    parser.add_argument(
        "--logs", nargs="+", default=["seattle"], metavar="NAME", help="which logs (seattle)"
    )
    parser.add_argument(
        "--stretches", type=int, nargs="+", default=[4], metavar="N", help="a log is cut into (4)"
    )
    parser.add_argument(
        "--common", type=float, default=15.0, metavar="M", help="[m] of wall in common (15)"
    )


def run(options: argparse.Namespace) -> None:
    """Run the loop and the fusion on all pairs, and print a table of each."""
    pairs: list[tuple[Stretch, Stretch]] = []
    for count in options.stretches:
        stretches = [s for log in find_logs(options.logs) for s in map_stretches(log, count)]
        within = choose_pairs(stretches, most_across=0, seed=0)
        pairs += [(a, b) for a, b in within if common(a, b) >= options.common]
    print(f"{len(pairs)} pairs of stretches with {options.common:g} m of wall and more in common\n")
    print(f"The paper's loop as printed, {TRIES} tries at most\n{tell_loop(pairs)}\n")
    print(f"mapweave's fusion, shapes switched off\n{tell_without_shapes(pairs)}")


def tell_loop(pairs: Twins) -> str:
    """Return a table: for each kind of object of H1 how often the loop is right."""
    head = ["object P_i", "pairs", "first right", f"within {TRIES}", "confirmed right", "wrong"]
    rows = []
    merged = {s.name: _largest(s) for pair in pairs for s in pair}
    for name, count in OBJECTS.items():
        p = ReferenceParameters(part_segments=count)
        found = [_loop(merged[a.name], merged[b.name], p) for a, b in track(pairs, name)]
        rows.append([name, str(len(pairs)), *map(str, count_rounds(found))])
    return format_table(head, rows)


def count_rounds(found: Iterable[Rounds]) -> tuple[int, int, int, int]:
    """Return how many pairs have the first, and any, proposal right, and confirmed right, wrong."""
    rounds = list(found)
    return (
        sum(each.right[:1] == (True,) for each in rounds),
        sum(any(each.right) for each in rounds),
        sum(each.confirmed is True for each in rounds),
        sum(each.confirmed is False for each in rounds),
    )


def _loop(
    reference: tuple[Part, LineMap], other: tuple[Part, LineMap], p: ReferenceParameters
) -> Rounds:
    tried = list(islice(proposals(reference[1], other[1], p), TRIES))
    confirmed = next((each for each in tried if each.confirmed), None)
    return Rounds(
        tuple(_is_right(reference[0], other[0], each) for each in tried),
        None if confirmed is None else _is_right(reference[0], other[0], confirmed),
    )


def _is_right(reference: Part, other: Part, proposal: Proposal) -> bool:
    return is_right(*alignment_error(reference, other, proposal.transform))


def _largest(stretch: Stretch) -> tuple[Part, LineMap]:
    """Return the component with the most scans: merged, as the paper fuses simplified maps."""
    name, part = next(iter(stretch.parts.items()))
    joined = next(c for c in merge(stretch.robot_map).components if name in c.robots)
    return part, joined.map.moved(se2.inverse(joined.robots[name]))


def tell_without_shapes(pairs: Twins) -> str:
    """Return a table: the outcomes as it is, and without one stage after the other."""
    rows = []
    for name, p in stages().items():
        outcomes = [compare(a, b, p).outcome for a, b in track(pairs, name)]
        rows.append([name, str(len(pairs)), *(str(outcomes.count(one)) for one in OUTCOMES)])
    return format_table(["proposals", "pairs", *OUTCOMES], rows)


def stages() -> dict[str, FusionParameters]:
    """Return the fusion as it is and without one thing or another, by name.

    Without windows none is salient enough; without corners no wall is long enough for one. What is
    left are parallel walls: the direction histograms, and correlation at the turns they suggest.
    The last row leaves out what the paper does not have: walls where the other map saw through.
    """
    usual = HypothesisParameters()
    no_windows = usual.windows.model_copy(update={"min_complexity": 1.0})
    no_corners = CornerParameters(min_length=1e6)
    return {
        "as it is": FusionParameters(),
        "no windows of polylines": FusionParameters(
            hypotheses=HypothesisParameters(windows=no_windows)
        ),
        "neither windows nor corners": FusionParameters(
            hypotheses=HypothesisParameters(windows=no_windows, corners=no_corners)
        ),
        "no complexity asked for (V2)": FusionParameters(
            decision=DecisionParameters(min_complexity=0.0)
        ),
        "free space counts nothing (V2)": FusionParameters(
            verification=VerificationParameters(contradiction_weight=1e-9),
            decision=DecisionParameters(min_overlap=1e-9),
        ),
    }
