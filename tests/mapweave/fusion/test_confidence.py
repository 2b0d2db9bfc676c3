"""Confidence is a probability that grows with what speaks for an alignment."""

import numpy as np
import pytest

from mapweave.fusion.confidence import ConfidenceParameters, confidence, features, share
from mapweave.fusion.decision import DecisionParameters
from mapweave.matching.verification import Verdict

P = ConfidenceParameters()


def verdict(common: float, contradicted: float = 0.0, held: float = 10.0) -> Verdict:
    overlap = common / max(common + contradicted, 1e-9)
    return Verdict(common, contradicted, overlap, 0.03, held, 1.0)


def test_it_is_a_probability_even_for_nonsense() -> None:
    for best in (verdict(0), verdict(1e6, held=1e6), verdict(0, 1e6), verdict(5, held=-1.0)):
        assert 0 <= confidence(best, None, P) <= 1


def test_without_a_rival_it_is_the_logistic_function_of_the_features() -> None:
    best = verdict(30, 2)
    slopes = [P.score, P.held, P.overlap, P.lead, P.rarity]
    odds = P.intercept + features(best, None, 25.0) @ slopes
    assert confidence(best, None, P, 25.0) == pytest.approx(1 / (1 + np.exp(-odds)), rel=1e-12)


@pytest.mark.parametrize(
    ("less", "more"),
    [
        (verdict(10), verdict(20)),
        (verdict(20, 4), verdict(20, 1)),
        (verdict(20, held=2), verdict(20, held=8)),
    ],
    ids=["metres in common", "share in common", "what holds"],
)
def test_it_grows_with_what_speaks_for_the_alignment(less: Verdict, more: Verdict) -> None:
    rival = verdict(5)
    assert confidence(more, rival, P) > confidence(less, rival, P)


def test_it_grows_with_how_rare_a_shape_is_as_far_as_that_tells() -> None:
    said = [confidence(verdict(10), None, P, bits) for bits in (0.0, 20.0, 60.0, 90.0)]
    assert said[0] < said[1] < said[2] == said[3]


def test_a_strong_rival_lowers_it_and_a_hopeless_one_counts_as_none() -> None:
    best = verdict(20)
    assert confidence(best, verdict(18), P) < confidence(best, verdict(4), P)
    assert confidence(best, verdict(1, 9), P) == confidence(best, None, P)


def test_a_hypothesis_more_contradicted_than_matched_is_improbable_however_it_is_held() -> None:
    assert features(verdict(3, 9), None, 0.0)[0] == 0
    assert confidence(verdict(300, 900, held=100.0), None, P) < 0.5


@pytest.mark.parametrize("common", [8.0, 60.0, 1e5])
def test_a_rival_as_good_is_as_probable_however_much_speaks_for_both(common: float) -> None:
    best = verdict(common, held=common / 3)
    assert share(best, best, P) == 0.5
    assert confidence(best, best, P) <= 0.5
    assert confidence(verdict(1e5, held=1e5), verdict(1e5, held=1e5), P) == pytest.approx(0.5, 1e-3)


def test_the_odds_between_two_depend_on_the_ratio_of_their_scores() -> None:
    for size in (5.0, 50.0, 500.0):
        part = share(verdict(size), verdict(0.9 * size), P)
        assert part / (1 - part) == pytest.approx(0.9**-P.rivalry)


def test_a_rival_that_leaves_an_alignment_accepted_costs_it_little() -> None:
    most = DecisionParameters().max_rival
    assert share(verdict(20), verdict(20 * most), P) > 0.99
    assert share(verdict(20), None, P) == share(verdict(20), verdict(1, 9), P) == 1
