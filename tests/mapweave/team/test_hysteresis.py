"""Robots that met stay joined while their maps grow; what speaks against the place parts them."""

import numpy as np
import pytest

from mapweave.evidence import Evidence
from mapweave.maps import Alignment, Decision
from mapweave.reasons import Reason, ReasonKind
from mapweave.team.hysteresis import joins, keep_joined

PLACE = Evidence(place=0.97, reach=40.0)


def found(decision: Decision, evidence: Evidence) -> Alignment:
    return Alignment("a/0", "b/0", np.zeros(3), decision, 0.6, Reason.words("so"), evidence)


JOINED, FAR = found("accepted", Evidence(place=0.99, reach=3.0)), found("ambiguous", PLACE)


def test_a_place_that_is_proven_joins_with_the_confidence_that_is_left() -> None:
    (kept,) = keep_joined([FAR])
    assert kept.decision == "accepted"
    assert kept.confidence == FAR.confidence
    assert kept.cause == Reason(ReasonKind.MET_BEFORE, found=FAR.cause)
    assert kept.reason == "the robots met before; so"


@pytest.mark.parametrize(
    "other", [JOINED, found("ambiguous", Evidence(reach=40.0)), found("refused", PLACE)]
)
def test_all_else_stays_as_it_was_found(other: Alignment) -> None:
    assert keep_joined([other]) == (other,)


def test_what_joins_robots_is_an_accepted_alignment() -> None:
    assert joins([FAR, JOINED])
    assert not joins([FAR, found("refused", Evidence())])
    assert not joins([])


def test_a_reason_stays_short_enough_to_be_sent() -> None:
    long = Alignment("a/0", "b/0", np.zeros(3), "ambiguous", 0.6, Reason.words("x" * 500), PLACE)
    assert len(keep_joined([long])[0].reason) == 500
