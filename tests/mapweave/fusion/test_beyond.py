"""Beyond a place a wall may be off by what maps are bent: only what is deeper contradicts."""

import numpy as np
import pytest

from mapweave.fusion.beyond import LIKELY, contradicted_beyond
from mapweave.fusion.extrapolation import ExtrapolationParameters
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters
from mapweave.matching.verification import VerificationParameters
from tests.mapweave.buildings import line_map, random_pose, rectangle, walls_of

V, P = VerificationParameters(), ExtrapolationParameters()
HALL = line_map(walls_of(rectangle(0, 0, 60, 6)), (rectangle(0, 0, 60, 6),))
HERE = np.array([[0.0, 0.0], [0.0, 3.0]])  # where both looked: the hall's left end


def field(lines: LineMap) -> DistanceField:
    return DistanceField.of(lines, DistanceFieldParameters())


def wall_at(x: float, y: float) -> LineMap:
    """Return 4 m of wall along the hall, facing its middle, `y` [m] inside of it."""
    return line_map(np.array([[x, y, x + 4, y]]))


def against(lines: LineMap, frame: FloatArray = se2.IDENTITY) -> float:
    there = lines.moved(se2.inverse(frame))
    shared = se2.transform_points(se2.inverse(frame), HERE)
    return contradicted_beyond(field(HALL), field(there), frame, shared, V, P)


@pytest.mark.parametrize(("x", "y", "contradicts"), [
    (2.0, 0.5, True),  # near the place, half a metre in
    (50.0, 0.5, False),  # maps are bent by as much
    (50.0, 2.5, True),  # but not by that
])  # fmt: skip
def test_a_wall_contradicts_that_lies_deeper_than_maps_are_bent(
    x: float, y: float, *, contradicts: bool
) -> None:
    bent = LIKELY * P.bend * x
    assert (y > V.clearance + bent) == contradicts
    assert against(wall_at(x, y)) == pytest.approx(4.0 if contradicts else 0.0, abs=0.3)


def test_what_contradicts_depends_on_no_frame(rng: np.random.Generator) -> None:
    for _ in range(3):
        assert against(wall_at(50.0, 2.5), random_pose(rng)) == pytest.approx(4.0, abs=0.3)


def test_both_maps_are_asked() -> None:
    nothing = np.zeros(3)
    one, other = field(HALL), field(wall_at(50.0, 2.5))
    forth = contradicted_beyond(one, other, nothing, HERE, V, P)
    assert contradicted_beyond(other, one, nothing, HERE, V, P) == pytest.approx(forth)


def test_without_a_place_in_common_all_contradicts() -> None:
    nowhere = np.empty((0, 2))
    assert contradicted_beyond(field(HALL), field(HALL), np.zeros(3), nowhere, V, P) == np.inf
