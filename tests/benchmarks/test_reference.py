"""What the reference benchmark counts, and that what it switches off is off."""

import numpy as np

from benchmarks.reference import Rounds, count_rounds, stages
from mapweave.fusion.align import FusionParameters, align_maps
from mapweave.geometry import se2
from mapweave.matching.hypotheses import HypothesisParameters, PreparedMap
from mapweave.shape.corners import propose
from mapweave.shape.windows import match_all
from tests.mapweave.buildings import BUILDING, part

FIRST, SECOND = part(BUILDING, 0, 20), part(BUILDING, 8, 31)


def proposed(p: FusionParameters) -> tuple[int, int]:
    """Return how many transforms windows propose, and how many corners do."""
    a, b = (PreparedMap(m, p.hypotheses, p.raster, p.verification) for m in (FIRST, SECOND))
    hypotheses: HypothesisParameters = p.hypotheses
    windows = match_all(a.windows, b.windows, hypotheses.windows)
    return len(windows), len(propose(a.corners, b.corners, hypotheses.corners))


def test_rounds_are_counted_by_the_first_any_and_the_first_confirmed() -> None:
    rounds = [
        Rounds((True, False), confirmed=True),
        Rounds((False, True), confirmed=False),
        Rounds((False, False), confirmed=None),
        Rounds((), confirmed=None),
    ]
    assert count_rounds(rounds) == (1, 2, 1, 1)


def test_what_is_switched_off_proposes_nothing() -> None:
    windows, corners = proposed(stages()["as it is"])
    assert min(windows, corners) > 0
    assert proposed(stages()["no windows of polylines"]) == (0, corners)
    assert proposed(stages()["neither windows nor corners"]) == (0, 0)


def test_maps_are_joined_without_any_proposal_by_shape() -> None:
    """What the documents say: parallel walls propose the right transform on their own."""
    pose = np.array([3.0, -2.0, 2.0])
    found = align_maps(
        ("a/0", FIRST),
        ("b/0", SECOND.moved(se2.inverse(pose))),
        stages()["neither windows nor corners"],
    )
    assert found.decision == "accepted"
    np.testing.assert_allclose(found.transform, pose, atol=0.05)
