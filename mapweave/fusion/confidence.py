"""Confidence: the probability that an alignment is right where both maps looked.

A logistic model of a few numbers of the evidence, how rare the shapes are that both maps have among
them, fitted offline by ``benchmarks/fit_confidence.py``, says how probably the evidence comes from
one place seen twice. Where a different transform has evidence of its own, that probability is
shared between the two: in a building that half a turn maps onto itself, each is right half of the
time. What maps may be bent by elsewhere is a matter of their reach (`reach`).
"""

from collections.abc import Sequence

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry.arrays import FloatArray
from mapweave.matching.verification import Verdict

LEAST_OVERLAP = 0.8  # less tells no more
MOST_RARITY = 60.0  # [bits] more tells no more: a million million million places
MEAN_RARITY = 30.0  # [bits] of what a place may have that was only looked at in cells


class ConfidenceParameters(BaseModel):
    """Coefficients of the logistic model, one for each of `features`, and the rival's share."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    intercept: float = Field(-14.4, description="log odds where all features are 0")
    score: float = Field(0.60, description="for ln(1 + metres in common less those contradicted)")
    held: float = Field(1.01, description="for ln(1 + metres that hold the weakest direction)")
    overlap: float = Field(8.23, description="for the share in common, 0.8 counting 0 and 1 as 1")
    lead: float = Field(1.28, description="for ln(1 + metres of score before the rival)")
    rarity: float = Field(0.81, description="for each ten bits, as far as they count")
    rivalry: float = Field(
        12.0,
        gt=0,
        description="power of score / rival's score that gives the odds between the two: at nine"
        " tenths of the score a rival is a quarter as probable; most likely on the same pairs,"
        " few of which tell",
    )


def features(best: Verdict, rival: Verdict | None, rarity: float) -> FloatArray:
    """Return (5,) what the model looks at: score, held, share in common, lead, tens of bits."""
    score, ahead = max(best.score, 0.0), max(rival.score, 0.0) if rival else 0.0
    metres = np.log1p([score, max(best.held, 0.0), max(score - ahead, 0.0)])
    overlap = np.clip((best.overlap - LEAST_OVERLAP) / (1 - LEAST_OVERLAP), 0.0, 1.0)
    return np.array([metres[0], metres[1], overlap, metres[2], min(rarity, MOST_RARITY) / 10])


def share(best: Verdict, rival: Verdict | None, parameters: ConfidenceParameters) -> float:
    """Return the part, in [1/2, 1], that the best hypothesis has in what it shares with its rival.

    Their odds are a power of the ratio of their scores: what two maps are bent against each other
    costs a part of the score, whatever its size.
    """
    return float(1 / (1 + _rivalry(best, rival) ** parameters.rivalry))


def confidence(
    best: Verdict, rival: Verdict | None, parameters: ConfidenceParameters, rarity: float = 0.0
) -> float:
    """Return the probability that the best hypothesis has the right place, in (0, 1).

    Parameters
    ----------
    rarity
        [bits] of what both maps have there (`shape.rarity`); what is refused is not asked for it.
    """
    p = parameters
    slopes = np.array([p.score, p.held, p.overlap, p.lead, p.rarity])
    either = 1 / (1 + np.exp(-(p.intercept + slopes @ features(best, rival, rarity))))
    return float(either * share(best, rival, p))


def may_be(scores: Sequence[float], weight: float, parameters: ConfidenceParameters) -> float:
    """Return the confidence that the first of `scores` [m] would have, were it held evenly.

    And as rare as is usual. Its rival is the second, if there are two.

    Parameters
    ----------
    weight
        Metres in common that a metre contradicted outweighs.
    """
    best, rival = (
        Verdict(score, 0.0, 1.0, 0.0, score / 2, weight) for score in (*scores, 0.0, 0.0)[:2]
    )
    return confidence(best, rival, parameters, MEAN_RARITY)


def _rivalry(best: Verdict, rival: Verdict | None) -> float:
    """Score of the rival as a share of the best one's, in [0, 1]; 0 where there is none."""
    if rival is None:
        return 0.0
    return min(max(rival.score / max(best.score, 1e-9), 0.0), 1.0)
