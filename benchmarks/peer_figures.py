"""The side-by-side table: recall by wall in common, wrong joins, time, each at three thresholds."""

import math
from collections.abc import Sequence

import numpy as np

from benchmarks.peer_trials import Trial
from benchmarks.tables import format_table

GROUPS = (50.0, 30.0, 15.0, 0.0)  # [m] in common, at least; those of the issue
JOINABLE = 15.0  # [m] in common from which on a pair that is not joined counts as missed
HEAD = ["", "50 m and more", "30 to 50 m", "15 to 30 m", "under 15 m"]
HEAD += ["wrong, one building", "wrong, across", "ms a pair"]


def joined(trials: Sequence[Trial], threshold: float) -> list[Trial]:
    """Return the trials that are accepted from `threshold` on."""
    return [trial for trial in trials if trial.score is not None and trial.score >= threshold]


def safe_threshold(trials: Sequence[Trial]) -> float:
    """Return the one that joins the most pairs rightly and none wrongly; infinite if none does."""
    wrong = [t.score for t in trials if t.score is not None and not t.right]
    above = [
        t.score for t in trials if t.score is not None and t.score > max(wrong, default=-math.inf)
    ]
    return min(above, default=math.inf)


def balanced_threshold(trials: Sequence[Trial]) -> float:
    """Return the one of the best F1 over the pairs of 15 m in common and more, and wrong joins."""
    scores = sorted({t.score for t in trials if t.score is not None}, reverse=True)
    return max(scores, key=lambda score: f1(trials, score), default=math.inf)


def f1(trials: Sequence[Trial], threshold: float) -> float:
    """Return 2 right / (joined + joinable): of pairs with less in common only wrong joins count."""
    accepted = joined(trials, threshold)
    right = sum(trial.right and trial.common >= JOINABLE for trial in accepted)
    wrong = sum(not trial.right for trial in accepted)
    joinable = sum(trial.common >= JOINABLE for trial in trials)
    return 2 * right / max(right + wrong + joinable, 1)


def tell(own: Sequence[Trial], peers: Sequence[tuple[float, Sequence[Trial]]]) -> str:
    """Return the table: mapweave's trials, if any, and each peer's with its own threshold."""
    rows = [row("mapweave, its own decision", own, 0.0)] if own else []
    for threshold, trials in peers:
        rows += _rows(threshold, trials) if trials else []
    return "\n".join([format_table(HEAD, rows), NOTE])


def _rows(threshold: float, trials: Sequence[Trial]) -> list[list[str]]:
    """Return a peer's rows: at its default threshold and at its two best."""
    safe, balanced = safe_threshold(trials), balanced_threshold(trials)
    at = f"from {safe:.3g}" if math.isfinite(safe) else "at no threshold"
    name = trials[0].peer
    return [
        row(f"{name}, default from {threshold:g}", trials, threshold),
        row(f"{name}, none wrong {at}", trials, safe),
        row(f"{name}, best F1 from {balanced:.3g}", trials, balanced),
    ]


NOTE = f"""\
Joined right of pairs with so much wall truly in common; wrong joins of pairs. Thresholds: the
peer's default; the one that joins the most pairs rightly and none wrongly on these very pairs; the
one of the best F1 on them (missed: pairs of {JOINABLE:g} m in common and more). No user has the
last two. Peers get grids and points from the corrected poses, mapweave maps of its own."""


def row(name: str, trials: Sequence[Trial], threshold: float) -> list[str]:
    """Return a row of the table: what `trials` come to from `threshold` on."""
    accepted = {id(trial) for trial in joined(trials, threshold)}
    cells, most = [name], math.inf
    inside = [trial for trial in trials if not trial.crosses]
    across = [trial for trial in trials if trial.crosses]
    for least in GROUPS:
        group = [trial for trial in inside if least <= trial.common < most]
        cells.append(_share(sum(id(t) in accepted and t.right for t in group), len(group)))
        most = least
    for group in (inside, across):
        wrong = sum(id(trial) in accepted and not trial.right for trial in group)
        cells.append(f"{wrong} of {len(group)}")
    return [*cells, f"{1000 * np.median([trial.seconds for trial in trials]):.0f}"]


def _share(count: int, whole: int) -> str:
    return f"{count} of {whole} ({count / whole:.0%})" if whole else "-"
