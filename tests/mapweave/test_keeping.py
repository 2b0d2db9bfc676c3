"""Maps that were joined stay so while they grow; what speaks against the place parts them."""

import numpy as np
import pytest

from mapweave.keeping import keep_joined
from mapweave.maps import Alignment, Decision

PLACE = {"place": 0.97, "reach": 40.0}


def found(decision: Decision, evidence: dict[str, float], other: str = "b/0") -> Alignment:
    return Alignment("a/0", other, np.zeros(3), decision, 0.6, "so", evidence)


JOINED = found("accepted", {"reach": 3.0})
FAR = found("ambiguous", PLACE)


def test_a_join_stays_when_the_maps_have_grown_with_the_confidence_that_is_left() -> None:
    (kept,) = keep_joined([FAR], [JOINED])
    assert kept.decision == "accepted"
    assert kept.confidence == FAR.confidence
    assert kept.reason == "joined before; so"


def test_it_stays_as_often_as_they_grow() -> None:
    first = keep_joined([FAR], [JOINED])
    assert keep_joined([FAR], first)[0].decision == "accepted"


@pytest.mark.parametrize(
    ("now", "before"),
    [
        (FAR, []),
        (FAR, [FAR]),
        (FAR, [found("accepted", {}, "b/1")]),
        (found("ambiguous", {"reach": 40.0}), [JOINED]),
        (found("refused", PLACE), [JOINED]),
    ],
)
def test_nothing_else_is_joined(now: Alignment, before: list[Alignment]) -> None:
    assert keep_joined([now], before) == (now,)


def test_the_order_of_the_two_names_does_not_matter() -> None:
    turned = Alignment("b/0", "a/0", np.zeros(3), "accepted", 0.9, "so")
    assert keep_joined([FAR], [turned])[0].decision == "accepted"


def test_a_reason_stays_short_enough_to_be_sent() -> None:
    long = Alignment("a/0", "b/0", np.zeros(3), "ambiguous", 0.6, "x" * 500, PLACE)
    assert len(keep_joined([long], [JOINED])[0].reason) == 500
