"""Logistic regression with a prior, and how well calibrated probabilities are."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from mapweave.geometry.arrays import BoolArray, FloatArray

RIDGE = 0.1  # weight of half a slope² against one pair's loss; features are standardised
MISTAKEN = 0.01  # share of outcomes
BINS = 10


@dataclass(frozen=True, slots=True, eq=False)
class Logistic:
    """log odds = intercept + slopes · features."""

    intercept: float
    slopes: FloatArray

    def predict(self, features: FloatArray) -> FloatArray:
        """Return the (n,) probabilities of (n, k) `features`."""
        odds = self.intercept + features @ self.slopes
        return np.asarray(1 / (1 + np.exp(-odds)))


def fit_logistic(features: FloatArray, right: BoolArray) -> Logistic:
    """Fit to (n, k) `features`, none of which speaks against an alignment, and (n,) `right`.

    Slopes are shrunk (ridge) and never negative: more evidence must not lower the confidence.
    The targets are Platt's: with n pairs of a kind seen, n + 1 of n + 2 are to be expected, so
    that nothing ever becomes certain (Platt 1999, Probabilistic Outputs for SVMs, eq. 7). A few
    outcomes are taken to be mistaken, as the poses are that decide what was right: one of them
    costs little, however sure the model is, and does not bend it.
    """
    mean, spread = features.mean(axis=0), np.maximum(features.std(axis=0), 1e-9)
    scaled = (features - mean) / spread
    target = MISTAKEN + (1 - 2 * MISTAKEN) * _smoothed(right)

    def loss(weights: FloatArray) -> tuple[float, FloatArray]:
        chance = 1 / (1 + np.exp(-(weights[0] + scaled @ weights[1:])))
        told = MISTAKEN + (1 - 2 * MISTAKEN) * chance
        value = -np.sum(target * np.log(told) + (1 - target) * np.log(1 - told))
        value += RIDGE / 2 * weights[1:] @ weights[1:]
        inner = (1 - 2 * MISTAKEN) * chance * (1 - chance)
        error = (told - target) / (told * (1 - told)) * inner
        slope = scaled.T @ error + RIDGE * weights[1:]
        return float(value), np.concatenate([[error.sum()], slope])

    bounds = [(None, None)] + [(0.0, None)] * features.shape[1]
    weights = minimize(
        loss, np.zeros(features.shape[1] + 1), jac=True, method="L-BFGS-B", bounds=bounds
    ).x
    slopes = weights[1:] / spread
    return Logistic(float(weights[0] - slopes @ mean), slopes)


def _smoothed(right: BoolArray) -> FloatArray:
    yes = int(right.sum())
    no = len(right) - yes
    return np.where(right, (yes + 1) / (yes + 2), 1 / (no + 2))


def brier_score(probability: FloatArray, right: BoolArray) -> float:
    """Return the mean squared difference: 0 is perfect, 0.25 is always saying one half."""
    return float(np.mean((probability - right) ** 2))


@dataclass(frozen=True, slots=True)
class Bin:
    """Pairs of like confidence: how many, what was said, how many of them were right."""

    count: int
    said: float
    came: float


def reliability(probability: FloatArray, right: BoolArray) -> list[Bin]:
    """Return the bins, a tenth wide, that hold any pair."""
    index = np.minimum((probability * BINS).astype(np.int64), BINS - 1)
    return [
        Bin(int(np.sum(index == k)), probability[index == k].mean(), right[index == k].mean())
        for k in np.unique(index)
    ]


def calibration_error(bins: list[Bin]) -> float:
    """Return the expected calibration error: |said - came|, weighted by count."""
    total = sum(each.count for each in bins)
    return sum(each.count * abs(each.said - each.came) for each in bins) / total
