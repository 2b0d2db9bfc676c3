"""The model fitted to decisions is the one they were drawn from, and never certain."""

import numpy as np
import pytest

from benchmarks.logistic import (
    Logistic,
    brier_score,
    calibration_error,
    fit_logistic,
    reliability,
)


def test_fitting_finds_the_model_that_outcomes_were_drawn_from() -> None:
    rng = np.random.default_rng(1)
    true = Logistic(-1.0, np.array([2.0, 0.5]))
    features = rng.normal(size=(20_000, 2))
    right = rng.random(20_000) < true.predict(features)
    fitted = fit_logistic(features, right)
    assert fitted.intercept == pytest.approx(true.intercept, abs=0.1)
    np.testing.assert_allclose(fitted.slopes, true.slopes, atol=0.1)
    assert calibration_error(reliability(fitted.predict(features), right)) < 0.02


def test_outcomes_that_separate_perfectly_leave_a_doubt() -> None:
    features = np.linspace(-1, 1, 40)[:, None]
    said = fit_logistic(features, features[:, 0] > 0).predict(features)
    assert said.max() < 0.999
    assert said.min() > 0.001


def test_a_mistaken_outcome_hardly_changes_the_model() -> None:
    """The poses that decide what is right are off by degrees at some places."""
    features = np.linspace(-3, 3, 400)[:, None]
    right = np.random.default_rng(3).random(400) < Logistic(0.0, np.array([4.0])).predict(features)
    mistaken = right.copy()
    mistaken[-1] = False
    said, asked = (fit_logistic(features, each).predict(features) for each in (right, mistaken))
    assert np.abs(said - asked).max() < 0.03


def test_evidence_never_lowers_the_confidence() -> None:
    rng = np.random.default_rng(2)
    features = rng.normal(size=(200, 2))
    right = rng.random(200) < Logistic(0.0, np.array([1.0, -2.0])).predict(features)
    assert (fit_logistic(features, right).slopes >= 0).all()


def test_scores_of_saying_nine_tenths_when_half_is_right() -> None:
    said, right = np.full(10, 0.9), np.arange(10) < 5
    assert brier_score(said, right) == pytest.approx((0.01 + 0.81) / 2)
    assert calibration_error(reliability(said, right)) == pytest.approx(0.4)
