"""Confidence: the probability that an alignment is right within 0.5 m and 5°.

A logistic model of a few numbers of the evidence, fitted offline by
``tests/benchmarks/fit_confidence.py``.
"""

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave.arrays import FloatArray
from mapweave.verification import Verdict


class ConfidenceParameters(BaseModel):
    """Coefficients of the logistic model, one for each of `features`."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    intercept: float = Field(-20.9, description="log odds where all features are 0")
    common: float = Field(1.34, description="for ln(1 + metres in common)")
    overlap: float = Field(15.9, description="for the share in common")
    held: float = Field(0.559, description="for ln(1 + metres that hold the weakest direction)")
    margin: float = Field(1.18, description="for 1 - rival's score / score, in [0, 1]")


def features(best: Verdict, rival: Verdict | None) -> FloatArray:
    """Return (4,) what the model looks at: common, overlap, held, margin."""
    rivalry = 0.0 if rival is None else rival.score / max(best.score, 1e-9)
    return np.array(
        [
            np.log1p(max(best.common, 0.0)),
            best.overlap,
            np.log1p(max(best.held, 0.0)),
            1.0 - min(max(rivalry, 0.0), 1.0) if best.score > 0 else 0.0,
        ]
    )


def confidence(best: Verdict, rival: Verdict | None, parameters: ConfidenceParameters) -> float:
    """Return the probability that the best hypothesis is right, in (0, 1)."""
    p = parameters
    slopes = np.array([p.common, p.overlap, p.held, p.margin])
    return float(1 / (1 + np.exp(-(p.intercept + slopes @ features(best, rival)))))
