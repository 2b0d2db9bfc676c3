"""The decision about an alignment, with its reason.

The best hypothesis must explain much wall, contradict little free space, be held in every
direction, share a shape or be held well by straight walls, and leave the best *different*
hypothesis far behind. Each condition that fails is the reason given. What is rare enough to be told
among all places of all maps needs less of that: its wall ends hold it, and are a shape.
"""

from dataclasses import dataclass

import numpy as np
from pydantic import Field

from mapweave.evidence import Evidence, RunnerUp
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Decision
from mapweave.matching.verification import Verdict
from mapweave.parameters import StageParameters, derived
from mapweave.reasons import Reason, ReasonKind


class DecisionParameters(StageParameters):
    """What an alignment must show to be accepted.

    The limits were set on stretches of the Intel, CSAIL and Seattle logs.
    """

    min_common: float = Field(6.0, gt=0, description="[m] of wall in common")
    min_overlap: float = Field(
        0.95,
        gt=0,
        le=1,
        description="of the wall that both looked at, the share in common: at least 0.976 for right"
        " transforms of stretches of the Intel, CSAIL and Seattle logs; 0.91 for a wrong one in the"
        " look-alike corridors of Killian Court",
    )
    min_held: float = Field(
        2.5, gt=0, description="[m] of common wall across the weakest direction"
    )
    min_rarity: float = Field(
        60.0,
        ge=0,
        description="[bits] of what is rare: half a million places where a map may lie in another"
        " of 40 m, 19 bits; a million pairs of maps, 20; and 20 more, as ends hang together. Of"
        " 2800 pairs of stretches across buildings the rarest that is wrong and not refused has 49",
    )
    rarity_lead: float = Field(
        20.0, ge=0, description="[bits] of what is rare before its rival: a million to one"
    )
    rare_held: float = Field(
        1.5, gt=0, description="[m] across the weakest direction of what is rare"
    )
    min_complexity: float = Field(
        0.05, ge=0, description="[rad²] sc(P) of a shared polyline (V2): not just straight walls"
    )
    plain_held: float = Field(
        4.0,
        gt=0,
        description="[m] held from which straight walls do: those across each other are a shape as"
        " well, though doors and gaps keep them apart",
    )
    min_confidence: float = derived(
        lambda c: c.mapping.min_confidence, gt=0, lt=1, description="of an accepted alignment"
    )
    max_rival: float = Field(
        0.5, gt=0, lt=1, description="score of the best different hypothesis, as a share"
    )
    max_weak_rival: float = Field(
        0.8,
        gt=0,
        lt=1,
        description="the same of a rival that would itself be contradicted",
    )
    min_lead: float = Field(
        6.5,
        ge=0,
        description="[m] of score before the best different hypothesis, each metre counted once:"
        " on stretches of six recordings in 3 to 8 a limit of 4.5 m to 8 m joins no other pair"
        " wrongly; at 6.5 m one more rightly than at 8 m",
    )


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """An aligned hypothesis with its verdict.

    Attributes
    ----------
    transform
        (3,) from the other map to the reference [m, m, rad].
    place
        (2,) where it takes the middle of the other map's wall [m]: what tells hypotheses apart,
        because it depends on no frame.
    verdict
        What both maps say of it.
    complexity
        [rad²] of what is shared (V2); None where it was not asked for: what is refused anyway.
    rarity
        [bits] of it (H1), likewise.
    """

    transform: FloatArray
    place: FloatArray
    verdict: Verdict
    complexity: float | None = None
    rarity: float | None = None


def decide(
    best: Hypothesis,
    rival: Hypothesis | None,
    sure: float,
    p: DecisionParameters,
    outside: float | None = None,
) -> tuple[Decision, Reason]:
    """Return the decision and its reason; `sure` is the confidence.

    Where all that is shared lies within one room, `outside` is what little does not [m].
    """
    v = best.verdict
    match = {"common": v.common, "contradicted": v.contradicted}
    if v.common < p.min_common:
        return "refused", Reason(ReasonKind.LITTLE_COMMON, {"common": v.common})
    if v.overlap < p.min_overlap:
        return "refused", Reason(ReasonKind.CONTRADICTED, match)
    rare = _is_rare(best, rival, p)
    if v.held < (p.rare_held if rare else p.min_held):
        return "ambiguous", Reason(ReasonKind.PARALLEL, match)
    plain = (best.complexity or 0.0) < p.min_complexity and v.held < p.plain_held
    if plain and not rare:
        return "ambiguous", Reason(ReasonKind.STRAIGHT, match)
    weak = rival is not None and rival.verdict.overlap < p.min_overlap
    most = p.max_weak_rival if weak else p.max_rival
    if rival is not None and rival.verdict.score > most * v.score:
        return "ambiguous", Reason(ReasonKind.RIVAL, {**match, **_against(best, rival)})
    # Of a rival that shares next to nothing there is nothing to tell.
    next_best = {} if rival is None or rival.verdict.common < 1 else _against(best, rival)
    lead = v.score - (max(rival.verdict.score, 0.0) if rival else 0.0)
    if outside is not None:
        numbers = {**match, "outside": outside, "confidence": sure}
        return "ambiguous", Reason(ReasonKind.ONE_ROOM, numbers)
    if sure < p.min_confidence or (lead < p.min_lead and not rare):
        return "ambiguous", Reason(ReasonKind.UNSURE, {**match, **next_best, "confidence": sure})
    return "accepted", Reason(ReasonKind.CONVINCING, {**match, **next_best})


def _is_rare(best: Hypothesis, rival: Hypothesis | None, p: DecisionParameters) -> bool:
    """Whether what is shared is rare enough to tell the place, and much rarer than by the rival."""
    least = p.rarity_lead + (rival.rarity or 0.0 if rival else 0.0)
    return (best.rarity or 0.0) >= max(p.min_rarity, least)


def _against(best: Hypothesis, rival: Hypothesis) -> dict[str, float]:
    """How the rival differs, and what speaks for and against it."""
    distance, turn = _difference(best, rival)
    verdict = rival.verdict
    return {
        "distance": distance,
        "turn": turn,
        "rival_common": verdict.common,
        "rival_contradicted": verdict.contradicted,
    }


def _difference(best: Hypothesis, rival: Hypothesis) -> tuple[float, float]:
    """How far apart two hypotheses put the other map [m], and how differently turned [rad]."""
    x, y = rival.place - best.place
    turn = se2.wrap(rival.transform[2] - best.transform[2])
    return float(np.hypot(x, y)), float(abs(turn))


def evidence(hypothesis: Hypothesis) -> Evidence:
    """Return the numbers that speak for and against `hypothesis`, with the score."""
    v = hypothesis.verdict
    return Evidence(
        float(v.common),
        float(v.contradicted),
        float(v.overlap),
        float(v.residual),
        float(v.held),
        hypothesis.complexity,
        hypothesis.rarity,
        v.score,
    )


def runner_up(best: Hypothesis, rival: Hypothesis) -> RunnerUp:
    """Return the rival, how it differs, and its evidence."""
    distance, turn = _difference(best, rival)
    return RunnerUp(rival.transform, distance, turn, evidence(rival))
