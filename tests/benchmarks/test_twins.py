"""Generated buildings: what exists twice is not joined, and what lies between the two is."""

import numpy as np
import pytest

from benchmarks.twins import SCENES, SURE, _right
from mapweave.fusion.align import align
from mapweave.reasons import ReasonKind


@pytest.mark.parametrize("visits", [1, 3])
@pytest.mark.parametrize("seed", range(3))
def test_equal_wings_are_of_one_kind_and_not_joined(seed: int, visits: int) -> None:
    scene = SCENES["twin wings"](np.random.default_rng(seed), visits)
    (found,) = align(scene.first, scene.second)
    assert found.decision == "ambiguous"
    assert found.cause.kind is ReasonKind.ONE_KIND
    assert found.confidence < SURE


@pytest.mark.parametrize("seed", [7, 15, 41, 64, 78, 81, 98, 102, 173, 175])
def test_mirrored_wings_are_not_joined_however_alike_they_are(seed: int) -> None:
    scene = SCENES["mirrored wings"](np.random.default_rng(seed), 1)
    (found,) = align(scene.first, scene.second)
    assert found.decision != "accepted"
    assert found.confidence < SURE


@pytest.mark.parametrize("seed", range(4))
def test_maps_are_joined_by_what_lies_between_twin_rooms_though_these_fit_as_well(
    seed: int,
) -> None:
    scene = SCENES["twin rooms, all between them known"](np.random.default_rng(seed), 1)
    (found,) = align(scene.first, scene.second)
    assert found.decision == "accepted"
    assert _right(found, scene)
