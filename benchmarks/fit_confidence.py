"""Confidence: fits its models on the pairs of `fusion`, and reports on buildings held out.

The model answers for the best hypothesis of a pair, so each pair counts once: its best hypothesis,
accepted or not, and whether that was right within 0.5 m and 5° where both looked. How much maps are
bent beyond is fitted to how far off the joins are as wholes. Maps that are bent by more than 0.5 m
in themselves teach nothing; they are reported on all the same.
"""

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from benchmarks.fusion import ROWS
from benchmarks.logistic import (
    Bin,
    Logistic,
    brier_score,
    calibration_error,
    fit_logistic,
    reliability,
)
from benchmarks.reach_fit import fit_reach
from benchmarks.tables import OUTPUT, format_table, write_json
from mapweave.fusion.align import FusionParameters
from mapweave.fusion.confidence import ConfidenceParameters, features, share
from mapweave.fusion.extrapolation import ExtrapolationParameters
from mapweave.geometry.arrays import BoolArray, FloatArray
from mapweave.matching.verification import Verdict

MAX_BEND = 0.5  # [m] rms of the maps that the model is fitted to
NAMES = ("score", "held", "overlap", "lead", "rarity")  # of the slopes, as in `features`


@dataclass(frozen=True, slots=True, eq=False)
class Examples:
    """The best hypotheses of n pairs.

    Attributes
    ----------
    features
        (n, k) what the model looks at.
    share
        (n,) of the probability, left by the rival.
    reach
        (n,) how far the maps go on beyond what they share [m].
    distance
        (n,) how far off it is at the median over the map [m].
    right
        (n,)
    accepted
        (n,)
    placed
        (n,) whether it was accepted, within one building.
    bend
        (n,) of the worse map of the two [m].
    buildings
        The two of each pair.
    """

    features: FloatArray
    share: FloatArray
    reach: FloatArray
    distance: FloatArray
    right: BoolArray
    accepted: BoolArray
    placed: BoolArray
    bend: FloatArray
    buildings: list[tuple[str, str]]

    @property
    def sound(self) -> BoolArray:
        """(n,) whether neither map is too bent."""
        return self.bend <= MAX_BEND

    def touches(self, building: str) -> BoolArray:
        """Tell which pairs involve `building`."""
        return np.array([building in pair for pair in self.buildings], dtype=np.bool_)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say where the rows are and where the plot goes."""
    parser.add_argument("--rows", type=Path, default=ROWS, help="of `fusion` (%(default)s)")
    parser.add_argument(
        "--output", type=Path, default=OUTPUT / "confidence.png", help="plot (%(default)s)"
    )


def run(options: argparse.Namespace) -> None:
    """Report on held-out buildings, then fit on all and print what to paste."""
    examples = read_examples(options.rows)
    held_out = predict_held_out(examples)
    present = _said(examples, _present_model())
    for name, said in (("present coefficients", present), ("fitted, held out", held_out)):
        print(tell(name, said, examples))
    bins = reliability(held_out, examples.right)
    options.output.parent.mkdir(parents=True, exist_ok=True)
    _draw(bins).savefig(options.output)
    fitted = _fit(examples, examples.sound)
    coefficients = dict(zip(["intercept", *NAMES], [fitted.intercept, *fitted.slopes], strict=True))
    bent = _fit_reach(examples, examples.placed)
    coefficients |= {"exact": bent.exact, "bend": bent.bend}
    write_json(options.output.with_suffix(".json"), coefficients)
    print("Fitted to all pairs, for ConfidenceParameters and ReachParameters:")
    for name, value in coefficients.items():
        print(f"    {name}: {value:.3g}")
    print(_tell_bends(examples))
    print(f"Reliability is drawn as {options.output}")


def read_examples(file: Path) -> Examples:
    """Read the rows that `fusion` wrote; pairs without any hypothesis teach nothing."""
    rows = [row for row in json.loads(file.read_text()) if row["evidence"]]
    verdicts = [_verdicts(row) for row in rows]
    return Examples(
        np.array([features(*pair, _rarity(row)) for pair, row in zip(verdicts, rows, strict=True)]),
        np.array([share(*pair, ConfidenceParameters()) for pair in verdicts]),
        np.array([_number(row["evidence"].get("reach")) for row in rows]),
        np.array([_number(row["whole"]) for row in rows]),
        np.array([row["right"] for row in rows], dtype=np.bool_),
        np.array([row["decision"] == "accepted" for row in rows], dtype=np.bool_),
        np.array([_is_placed(row) for row in rows], dtype=np.bool_),
        np.array([max(row["bends"]) for row in rows]),
        [(row["buildings"][0], row["buildings"][1]) for row in rows],
    )


def _rarity(row: dict[str, Any]) -> float:
    """[bits] 0 where it was not asked for: what is refused."""
    return float(row["evidence"].get("rarity") or 0.0)


def _number(value: float | None) -> float:
    """Infinite where there is none: nothing is shared, or buildings differ."""
    return np.inf if value is None else value


def _is_placed(row: dict[str, Any]) -> bool:
    return "place" in row["evidence"] and row["buildings"][0] == row["buildings"][1]


def _verdicts(row: dict[str, Any]) -> tuple[Verdict, Verdict | None]:
    rival = row["runner_up"]
    return _verdict(row["evidence"]), None if rival is None else _verdict(rival)


def _verdict(numbers: dict[str, float]) -> Verdict:
    names = ("common", "contradicted", "overlap", "residual", "held")
    weight = FusionParameters().verification.contradiction_weight
    return Verdict(**{name: numbers[name] for name in names}, contradiction_weight=weight)


def predict_held_out(examples: Examples) -> FloatArray:
    """Return (n,) what models say that never saw the pair's buildings.

    A pair across buildings is predicted by the model that saw neither of them.
    """
    said = np.empty(len(examples.right))
    for pair in sorted(set(examples.buildings)):
        asked = np.array([each == pair for each in examples.buildings])
        seen = ~(examples.touches(pair[0]) | examples.touches(pair[1]))
        model = _fit(examples, seen & examples.sound)
        said[asked] = _said(examples, model)[asked]
    return said


def _fit(examples: Examples, chosen: BoolArray) -> Logistic:
    return fit_logistic(examples.features[chosen], examples.right[chosen])


def _fit_reach(examples: Examples, chosen: BoolArray) -> ExtrapolationParameters:
    joins = chosen & examples.placed & np.isfinite(examples.distance)
    if not joins.any():
        return ExtrapolationParameters()
    exact, bend = fit_reach(examples.reach[joins], examples.distance[joins])
    return ExtrapolationParameters(exact=exact, bend=bend)


def _said(examples: Examples, model: Logistic) -> FloatArray:
    """Return the (n,) confidences."""
    return np.asarray(model.predict(examples.features) * examples.share)


def _tell_bends(examples: Examples) -> str:
    """Return how much the maps of each building are bent, as text."""
    rows = []
    for building in sorted({pair[0] for pair in examples.buildings}):
        inside = np.array([pair == (building, building) for pair in examples.buildings])
        joins = inside & examples.placed
        if joins.any():
            bent = _fit_reach(examples, inside)
            rows.append([building, str(joins.sum()), f"{bent.exact:.3f}", f"{bent.bend:.4f}"])
    return format_table(["building", "joins", "exact [m]", "bend"], rows)


def _present_model() -> Logistic:
    p = ConfidenceParameters()
    return Logistic(p.intercept, np.array([getattr(p, name) for name in NAMES]))


def tell(name: str, said: FloatArray, examples: Examples) -> str:
    """Return scores and the reliability table as text."""
    bins = reliability(said, examples.right)
    rows = [[f"{b.said:.3f}", f"{b.came:.3f}", str(b.count)] for b in bins]
    within = np.array([a == b for a, b in examples.buildings])
    groups = {
        "all pairs": np.full(len(said), True),
        "maps not bent": examples.sound,
        "of one building": examples.sound & within,
        "accepted": examples.sound & examples.accepted,
    }
    lines = [f"{name}:"]
    lines += [f"  {_tell_scores(group, said[k], examples.right[k])}" for group, k in groups.items()]
    lines.append(f"  {_tell_limit(said[examples.sound], examples.right[examples.sound])}")
    return "\n".join([*lines, format_table(["said", "came", "pairs"], rows), ""])


def _tell_limit(said: FloatArray, right: BoolArray) -> str:
    most = float(np.max(said[~right], initial=0.0))
    return (
        f"no wrong hypothesis between sound maps gets more than {most:.2f};"
        f" {np.mean(said[right] > most):.0%} of the right ones do"
    )


def _tell_scores(group: str, said: FloatArray, right: BoolArray) -> str:
    if len(said) == 0:
        return f"{group}: none"
    error = calibration_error(reliability(said, right))
    return (
        f"{group}: {len(said)}, {right.mean():.0%} right, Brier score"
        f" {brier_score(said, right):.4f}, expected calibration error {error:.3f}"
    )


def _draw(bins: Sequence[Bin]) -> Figure:
    figure = Figure(figsize=(4.2, 4.2), dpi=150, facecolor="white", layout="constrained")
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], color="#b4bcc6", linewidth=1)
    axes.scatter(
        [b.said for b in bins], [b.came for b in bins], s=[8 * b.count**0.5 + 8 for b in bins]
    )
    for b in bins:
        axes.annotate(str(b.count), (b.said, b.came), (6, -10), textcoords="offset points")
    axes.set(xlabel="confidence said", ylabel="share right", aspect="equal")
    axes.set_title("Held-out buildings; numbers are pairs", fontsize=9)
    return figure
