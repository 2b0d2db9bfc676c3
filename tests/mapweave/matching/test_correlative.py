"""The exhaustive search has the true pose among its maxima, wherever in the window it is."""

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.matching.correlative import CorrelativeParameters, LikelihoodField, search
from mapweave.scan.points import points_on_lines
from tests.mapweave.buildings import BUILDING, cast, line_map, walls_of

P = CorrelativeParameters()
WALLS = walls_of(BUILDING)
KNOWN = points_on_lines(line_map(WALLS), 0.1)[0].points


@pytest.mark.parametrize("seed", range(6))
def test_the_true_pose_is_among_the_candidates(seed: int) -> None:
    rng = np.random.default_rng(seed)
    true = np.array([13 + rng.uniform(-1, 1), 1 + rng.uniform(-0.7, 0.7), rng.uniform(-3, 3)])
    points = cast(WALLS, true, noise=rng).points
    centre = true + rng.uniform(-0.9, 0.9, 3)
    raster = LikelihoodField.of(KNOWN, centre[:2], P)
    found = search(points, raster, centre, 1.15, P)
    off = se2.between(true, found)
    near = (np.hypot(*off[:, :2].T) < 0.25) & (np.abs(off[:, 2]) < 0.1)
    assert near.any()


def test_without_any_idea_of_the_heading_all_turns_are_searched(rng: Generator) -> None:
    true = np.array([13.0, 1.0, 2.9])
    points = cast(WALLS, true, noise=rng).points
    centre = np.array([13.3, 0.8, 0.0])
    found = search(points, LikelihoodField.of(KNOWN, centre[:2], P), centre, np.pi, P)
    off = se2.between(true, found[0])
    assert np.hypot(off[0], off[1]) < 0.25 and abs(off[2]) < 0.1


def test_all_candidates_lie_in_the_window_and_differ(rng: Generator) -> None:
    points = cast(WALLS, [13, 1, 0], noise=rng).points
    centre = np.array([13.0, 1.0, 0.0])
    found = search(points, LikelihoodField.of(KNOWN, centre[:2], P), centre, 0.5, P)
    assert len(found) == P.candidates
    assert (np.abs(found - centre) <= [P.reach + 1e-9, P.reach + 1e-9, 0.5]).all()
    for k, pose in enumerate(found):
        apart = np.abs(found[:k] - pose)
        far = (apart[:, :2] > 2.5 * P.step).any(axis=1) | (apart[:, 2] > 3.5 * P.turn_step)
        assert far.all()


def test_nearness_is_one_on_a_surface_and_falls_with_distance_as_a_bell() -> None:
    raster = LikelihoodField.of(np.array([[0.05, 0.05]]), np.zeros(2), P)
    middle = round(P.half_width / P.cell)
    assert raster.value[middle, middle] == 1
    for cells in (1, 2, 5):
        expected = np.exp(-((cells * P.cell) ** 2) / (2 * P.nearness**2))
        assert raster.value[middle + cells, middle] == pytest.approx(expected, rel=1e-5)


def test_outside_the_raster_nothing_is_near() -> None:
    raster = LikelihoodField.of(np.array([[0.0, 0.0]]), np.zeros(2), P)
    assert (raster.value[-1] == 0).all() and (raster.value[:, -1] == 0).all()


def test_a_wider_window_hands_on_as_many_more_maxima_as_it_is_larger() -> None:
    """A look-alike to an area: six of them would crowd out the true pose."""
    p = CorrelativeParameters()
    assert p.candidates_in(p.reach / 2) == p.candidates_in(p.reach) == p.candidates
    assert p.candidates_in(2 * p.reach) == 4 * p.candidates
    assert p.candidates_in(100 * p.reach) == p.most_candidates
