"""What is told soon ends the search: a coarse look, then parallel walls, then shapes."""

import numpy as np
import pytest

from mapweave.fusion.align import FusionParameters, align_maps, compare, prepare
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap
from mapweave.matching.hypotheses import HypothesisParameters, PreparedMap, propose_all
from mapweave.reasons import ReasonKind
from tests.mapweave.buildings import BUILDING, OTHER_BUILDING, line_map, part

LEFT = part(BUILDING, 0, 18)


@pytest.fixture
def looked(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Note each time that shapes are looked for."""
    asked: list[bool] = []

    def noted(
        first: PreparedMap, second: PreparedMap, shifted: FloatArray, p: HypothesisParameters
    ) -> FloatArray:
        asked.append(True)
        return propose_all(first, second, shifted, p)

    monkeypatch.setattr("mapweave.fusion.align.propose_all", noted)
    return asked


def test_shapes_are_not_looked_for_where_parallel_walls_convince(looked: list[bool]) -> None:
    pose = np.array([3.0, -2.0, 1.0])
    there = part(BUILDING, 8, 30).moved(se2.inverse(pose))
    found = align_maps(("a/0", LEFT), ("b/0", there))
    assert found.decision == "accepted" and looked == []
    np.testing.assert_allclose(found.transform, pose, atol=0.05)


def test_shapes_are_looked_for_where_a_coarse_look_leaves_it_open(looked: list[bool]) -> None:
    corridor = line_map(np.array([[0.0, 0, 12, 0], [12, 2, 0, 2]]))
    found = align_maps(("a/0", corridor), ("b/0", corridor))
    assert found.cause.kind is ReasonKind.PARALLEL and looked == [True]


@pytest.mark.parametrize("other", [part(OTHER_BUILDING, 0, 20), part(OTHER_BUILDING, 6, 30)])
def test_maps_without_a_place_that_counts_are_refused_at_a_coarse_look(
    other: LineMap, looked: list[bool]
) -> None:
    found = align_maps(("a/0", LEFT), ("b/0", other))
    assert found.decision == "refused" and looked == []
    assert (found.evidence.score or 0) < FusionParameters().decision.min_common
    assert found.runner_up is not None


@pytest.mark.parametrize("other", [part(OTHER_BUILDING, 0, 20), part(OTHER_BUILDING, 6, 30)])
def test_what_a_coarse_look_refuses_a_close_one_does_as_well(
    other: LineMap, looked: list[bool]
) -> None:
    p = FusionParameters()
    shapes = prepare(LEFT, p), prepare(other, p)
    found = compare("a/0", shapes[0], "b/0", shapes[1], p, closely=True)
    assert found.decision == "refused" and looked == [True]
