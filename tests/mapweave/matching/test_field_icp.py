"""Hypotheses aligned all at once, by look-up, end on the walls that they were near to."""

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.maps import LineMap
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters
from mapweave.matching.field_icp import FieldIcpParameters, align_on_raster
from tests.mapweave.buildings import BUILDING, line_map, part, random_pose

P = FieldIcpParameters()
MIDDLE = np.array([13.0, 1.0])


def raster(lines: LineMap) -> DistanceField:
    return DistanceField.of(lines, DistanceFieldParameters())


@pytest.mark.parametrize("seed", range(4))
def test_starts_near_the_truth_end_there(seed: int) -> None:
    rng = np.random.default_rng(seed)
    true = random_pose(rng)
    other = part(BUILDING, 8, 30).moved(se2.inverse(true))
    off = rng.uniform([-0.3, -0.3, -0.03], [0.3, 0.3, 0.03], (40, 3))
    about = np.array([*MIDDLE, 0.0])
    starts = se2.compose(se2.compose(about, off), se2.compose(se2.inverse(about), true))
    found = align_on_raster(raster(part(BUILDING, 0, 18)), raster(other), starts, P)
    inside = se2.transform_points(se2.inverse(true), MIDDLE)
    apart = [np.hypot(*(se2.transform_points(t, inside) - MIDDLE)) for t in found]
    assert np.median(apart) < 0.05
    assert np.quantile(apart, 0.9) < 0.15
    assert np.quantile(np.abs(se2.wrap(found[:, 2] - true[2])), 0.9) < np.radians(1)


def test_what_no_wall_holds_stays_where_it_was() -> None:
    """Along a straight corridor nothing pulls; across it the walls do."""
    walls = raster(line_map(np.array([[0.0, 0, 30, 0], [30, 2, 0, 2]])))
    start = np.array([[3.0, 0.2, 0.01]])
    x, y, turn = align_on_raster(walls, walls, start, P)[0]
    assert abs(x - 3) < 0.1
    assert abs(y) < 0.06
    assert abs(turn) < 0.005


def test_a_start_without_any_wall_near_stays() -> None:
    room = raster(part(BUILDING, 0, 18))
    start = np.array([[500.0, 500.0, 1.0]])
    np.testing.assert_allclose(align_on_raster(room, room, start, P), start, atol=1e-9)
