"""What stands free and is short may have been moved; what hangs together with a wall was not."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapweave.geometry.arrays import BoolArray, FloatArray
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters
from mapweave.matching.free_standing import free_standing
from mapweave.matching.verification import VerificationParameters, verify
from tests.mapweave.buildings import line_map, rectangle, walls_of

ROOM = rectangle(0, 0, 8, 6)
FREE = (rectangle(0.15, 0.15, 7.85, 5.85),)
GAP, SIDE = 0.3, 1.1
QUARTER = VerificationParameters(moved_weight=0.25)
STILL = np.zeros(3)


def things(walls: FloatArray) -> BoolArray:
    """Tell of each wall of a map whether all of it may have been moved."""
    raster = DistanceField.of(line_map(walls), DistanceFieldParameters())
    moved = free_standing(raster, GAP, SIDE)
    return np.array([moved[raster.segment == k].all() for k in range(len(walls))])


def crate(x: float, y: float, width: float = 0.8, depth: float = 0.6) -> FloatArray:
    """Return the (4, 4) walls of a crate whose lower left corner is there, seen from outside."""
    return walls_of(rectangle(x, y, x + width, y + depth)[::-1])


@given(
    turn=st.floats(-3.2, 3.2), shift=st.tuples(st.floats(-20, 20), st.floats(-20, 20)).map(np.array)
)
def test_a_crate_in_a_room_may_have_been_moved_and_its_walls_were_not(
    turn: float, shift: FloatArray
) -> None:
    """However the map lies."""
    c, s = np.cos(turn), np.sin(turn)
    walls = np.vstack([walls_of(ROOM), crate(3, 2)]).reshape(-1, 2) @ np.array([[c, s], [-s, c]])
    assert things((walls + shift).reshape(-1, 4)).tolist() == [False] * 4 + [True] * 4


@pytest.mark.parametrize(
    ("thing", "why"),
    [
        (crate(0.1, 2), "it stands at a wall"),
        (crate(3, 2, 1.6, 0.6), "it is long"),
        (np.vstack([crate(3, 2), crate(3.9, 2)]), "two that touch are one that is long"),
        (np.array([[4.0, 1.5, 4.0, 4.5]]), "it is a partition"),
    ],
)
def test_what_is_no_thing_of_its_own_was_not_moved(thing: FloatArray, why: str) -> None:
    assert not things(np.vstack([walls_of(ROOM), thing])).any(), why


def test_a_crate_that_is_missed_weighs_less_than_a_wall_that_is_gone() -> None:
    empty = DistanceField.of(line_map(walls_of(ROOM), FREE), DistanceFieldParameters())
    found = []
    for thing in (crate(3, 2), np.array([[4.0, 1.6, 4.0, 4.4]])):  # 2.8 m of wall each
        other = line_map(np.vstack([walls_of(ROOM), thing]))
        raster = DistanceField.of(other, DistanceFieldParameters())
        found.append(verify(empty, raster, STILL, QUARTER).contradicted)
    assert found == pytest.approx([0.25 * 2.8, 2.8], rel=0.1)
