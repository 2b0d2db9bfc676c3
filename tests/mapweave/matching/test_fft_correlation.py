"""Correlation scores every shift of one map over another, and the best ones are the true ones."""

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters
from mapweave.matching.fft_correlation import FftCorrelationParameters, Marks, correlate
from tests.mapweave.buildings import BUILDING, line_map, part, random_pose, rectangle, walls_of

P = FftCorrelationParameters()
WEIGHT = 5.0


def marks_of(lines: LineMap) -> Marks:
    return Marks.of(DistanceField.of(lines, DistanceFieldParameters()), 0.25, P.clearance)


def shifts(reference: LineMap, other: LineMap, turn: float, count: int) -> FloatArray:
    """Return where the best shifts put the origin of `other`, turned by `turn` [rad]."""
    parameters = FftCorrelationParameters(shifts=count)
    found, _ = correlate(marks_of(reference), marks_of(other), np.array([turn]), WEIGHT, parameters)
    np.testing.assert_array_equal(found[:, 2], turn)
    return found[:, :2]


@pytest.mark.parametrize("seed", range(6))
def test_the_true_shift_of_two_halves_of_a_building_is_among_the_best(seed: int) -> None:
    rng = np.random.default_rng(seed)
    true = random_pose(rng, 40)
    other = part(BUILDING, 10, 30).moved(se2.inverse(true))
    found = shifts(part(BUILDING, 0, 17), other, true[2], 5)
    assert np.hypot(*(found - true[:2]).T).min() < P.cell


def test_shifts_are_right_where_maps_hardly_overlap() -> None:
    """To both sides: the correlation is circular, its shifts are not."""
    corner = line_map(np.array([[0.0, 0, 6, 0], [6, 0, 6, 6]]))
    for shift in ([-40.0, 30.0, 0], [40.0, -30.0, 0]):
        far = line_map(np.array([[-40.0, 30, -39, 30], [40.0, -30, 41, -30]]))
        both = line_map(np.vstack([far.segments, corner.moved(np.array(shift)).segments]))
        found = shifts(both, corner, 0.0, 1)
        assert np.hypot(*(found[0] - shift[:2])) < P.cell


def test_walls_that_face_away_from_each_other_do_not_match() -> None:
    """A square seen from inside lies on itself; its outside fits only where it is not."""
    room = walls_of(rectangle(0, 0, 6, 6))
    assert np.hypot(*shifts(line_map(room), line_map(room), 0.0, 1)[0]) < P.cell
    turned_out = line_map(room[:, [2, 3, 0, 1]])
    assert np.hypot(*shifts(line_map(room), turned_out, 0.0, 1)[0]) > 3


def test_walls_do_not_match_where_the_other_saw_through() -> None:
    """Of two equal walls, the one with nothing seen before it is where a cupboard may stand."""
    wall = np.array([[0.0, 0, 6, 0]])
    cupboard = np.array([[1.0, 2, 3, 2]])
    far = np.array([[40.0, 8, 41, 8]])
    same = se2.transform_segments(np.array([20.0, 0, 0]), wall)
    hall = line_map(np.vstack([wall, same, far]), (rectangle(20.2, 0.2, 25.8, 6),))
    room = line_map(np.vstack([wall, cupboard]))
    assert np.hypot(*shifts(hall, room, 0.0, 1)[0]) < 2 * P.cell


def test_without_a_likely_turn_there_is_no_proposal() -> None:
    marks = marks_of(part(BUILDING, 0, 17))
    assert correlate(marks, marks, np.empty(0), WEIGHT, P)[0].shape == (0, 3)


def test_a_larger_map_gets_coarser_cells() -> None:
    """And the true shift is found all the same."""
    few = FftCorrelationParameters(max_size=60, shifts=5)
    whole, half = marks_of(part(BUILDING, 0, 30)), marks_of(part(BUILDING, 10, 30))
    found, _ = correlate(whole, half, np.zeros(1), WEIGHT, few)
    assert np.hypot(*found[:, :2].T).min() < 1.0


def test_maps_of_fewer_cells_than_shifts_are_asked_for_get_as_many_as_there_are() -> None:
    """As where the sensor is covered, and all there is lies within a few centimetres."""
    stub = marks_of(line_map(np.array([[0.0, 0, 0.2, 0], [0.2, 0, 0.2, 0.2]])))
    found, _ = correlate(stub, stub, np.zeros(1), WEIGHT, P)
    assert 0 < len(found) < P.shifts
    assert np.hypot(*found[:, :2].T).min() < P.cell
