"""What convinces ends the search: parallel walls come first, shapes where these do not do."""

import numpy as np
import pytest

from mapweave.fusion.align import align_maps
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap
from mapweave.matching.hypotheses import HypothesisParameters, PreparedMap, propose_all
from tests.mapweave.buildings import BUILDING, OTHER_BUILDING, part

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


@pytest.mark.parametrize("other", [part(OTHER_BUILDING, 0, 20), part(OTHER_BUILDING, 6, 30)])
def test_shapes_are_looked_for_before_maps_are_refused(other: LineMap, looked: list[bool]) -> None:
    found = align_maps(("a/0", LEFT), ("b/0", other))
    assert found.decision != "accepted" and looked == [True]
