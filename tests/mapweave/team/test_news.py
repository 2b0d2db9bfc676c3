"""What is worth telling of a pair that was told before."""

from dataclasses import replace

import numpy as np
import pytest

from mapweave.evidence import Evidence
from mapweave.maps import Alignment
from mapweave.reasons import Reason, ReasonKind
from mapweave.team.news import is_news

TOLD = Alignment(
    "a/0",
    "b/0",
    np.array([1.0, 2.0, 0.5]),
    "accepted",
    0.95,
    Reason(ReasonKind.CONVINCING, {"common": 20.0, "contradicted": 0.0}),
    Evidence(common=20.0),
)


def moved(alignment: Alignment, x: float, turn: float) -> Alignment:
    return replace(alignment, transform=alignment.transform + np.array([x, 0.0, turn]))


@pytest.mark.parametrize(
    "found",
    [
        replace(TOLD, decision="ambiguous"),
        moved(TOLD, 0.04, 0.0),
        moved(TOLD, 0.0, 0.01),
        replace(TOLD, confidence=0.98),
        replace(TOLD, evidence=Evidence(common=81.0)),
        replace(TOLD, other="b/1"),
    ],
)
def test_a_decision_or_a_join_that_changed_is_news(found: Alignment) -> None:
    assert is_news([found], [TOLD])
    assert is_news([TOLD], [found]) or found.evidence != TOLD.evidence


def test_what_comparing_again_changes_is_no_news() -> None:
    again = replace(moved(TOLD, 0.02, 0.004), confidence=0.96, evidence=Evidence(common=79.0))
    assert not is_news([again], [TOLD])


def test_of_what_was_not_joined_only_the_decision_is_news() -> None:
    refused = replace(TOLD, decision="refused")
    assert not is_news([moved(refused, 5.0, 1.0)], [refused])
    assert is_news([], [refused])
