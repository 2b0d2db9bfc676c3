"""Segments lie where most was seen about them, and end where that ends."""

import numpy as np
import shapely
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.lines.fitting import FittingParameters, cut, fit, follow, trim
from mapweave.lines.selection import SelectionParameters, explained, shadowed
from mapweave.lines.sightings import Nearness, Sightings
from tests.mapweave.buildings import random_pose

P = FittingParameters()
NOTHING = shapely.Polygon()  # was seen through


def seen(segments: list[list[float]], counts: list[int]) -> Sightings:
    return Sightings.of(np.array(segments, dtype=float), np.array(counts), 0.1)


def test_a_segment_goes_to_the_line_of_least_squares_of_what_was_seen(rng: Generator) -> None:
    wall = np.array([0.0, 0.0, 6.0, 1.0])
    sightings = np.tile(wall, (50, 1)) + rng.normal(0, 0.01, (50, 4))
    evidence = Sightings.of(sightings, np.ones(50, dtype=np.int64), 0.1)
    askew = wall[None] + [[0.0, 0.05, 0.0, -0.03]]
    assert np.abs(fit(askew, evidence, P) - wall).max() < 0.03


def test_a_segment_keeps_its_direction_and_moves_with_the_frame(rng: Generator) -> None:
    evidence = seen([[0, 0, 4, 0.1]], [3])
    fitted = fit(np.array([[1.0, 0.0, 3.0, 0.0]]), evidence, P)
    assert fitted[0, 2] > fitted[0, 0]
    motion = random_pose(rng)
    moved = Sightings(
        se2.transform_points(motion, evidence.points),
        evidence.directions @ se2.rotation(motion[2]).T,
        evidence.weights,
        evidence.spacing,
    )
    there = fit(se2.transform_segments(motion, np.array([[1.0, 0.0, 3.0, 0.0]])), moved, P)
    np.testing.assert_allclose(there, se2.transform_segments(motion, fitted), atol=1e-9)


def test_the_opposite_face_does_not_pull_at_a_segment() -> None:
    evidence = seen([[0, 0, 4, 0], [4, -0.06, 0, -0.06]], [3, 50])
    np.testing.assert_allclose(fit(np.array([[0.0, 0, 4, 0]]), evidence, P)[0, [1, 3]], 0.0)


def test_a_segment_without_evidence_stays_where_it_is() -> None:
    lonely = np.array([[9.0, 9, 10, 9]])
    np.testing.assert_array_equal(fit(lonely, seen([[0, 0, 1, 0]], [1]), P), lonely)


def test_a_wall_drawn_through_a_recess_is_cut_there() -> None:
    evidence = seen([[0, 0, 2, 0], [2, -0.15, 3, -0.15], [3, 0, 5, 0]], [5, 5, 5])
    parts = cut(np.array([[0.0, 0, 5, 0]]), evidence, NOTHING, P)
    np.testing.assert_allclose(parts, [[0, 0, 2, 0], [3, 0, 5, 0]], atol=0.11)


def test_a_wall_is_cut_at_a_door_but_not_at_a_lost_beam() -> None:
    door = seen([[0, 0, 2, 0], [2.8, 0, 5, 0]], [5, 5])
    beam = seen([[0, 0, 2, 0], [2.2, 0, 5, 0]], [5, 5])
    assert len(cut(np.array([[0.0, 0, 5, 0]]), door, NOTHING, P)) == 2
    assert len(cut(np.array([[0.0, 0, 5, 0]]), beam, NOTHING, P)) == 1


def test_a_door_that_was_seen_through_stays_open_though_a_grazing_scan_drew_a_wall_there() -> None:
    """From far along the wall no beam goes through the door; from near by many do."""
    evidence = seen([[0, 0, 2, 0], [3, 0, 5, 0], [0, 0, 5, 0]], [20, 20, 1])
    wall, through = np.array([[0.0, 0, 5, 0]]), shapely.box(2.05, -2, 2.95, 2)
    parts = cut(wall, evidence, through, P)
    np.testing.assert_allclose(parts, [[0, 0, 2, 0], [3, 0, 5, 0]], atol=0.21)
    np.testing.assert_allclose(cut(wall, evidence, NOTHING, P), wall)


def test_a_wall_that_was_seen_no_oftener_elsewhere_is_kept_where_another_saw_through() -> None:
    """Free space alone cuts no wall: beams pass beside a wall that is a little askew."""
    evidence = seen([[0, 0, 5, 0]], [3])
    wall = np.array([[0.0, 0, 5, 0]])
    np.testing.assert_allclose(cut(wall, evidence, shapely.box(1, -2, 2, 2), P), wall)


def test_the_place_where_a_wall_was_seen_more_often_is_kept_and_the_other_cut() -> None:
    evidence = seen([[0, 0, 5, 0], [0, 0.2, 5, 0.2]], [7, 3])
    parts = cut(np.array([[0.0, 0, 5, 0], [0.0, 0.2, 5, 0.2]]), evidence, NOTHING, P)
    np.testing.assert_allclose(parts, [[0, 0, 5, 0]], atol=1e-9)


def trimmed(segments: list[list[float]], evidence: Sightings) -> FloatArray:
    walls, p = np.array(segments, dtype=float), SelectionParameters()
    near = Nearness.of(walls, evidence.points, evidence.directions, p.shadow)
    explains = explained(near, p)
    return trim(walls, near, explains, explains | shadowed(near, p), evidence)


def test_a_later_segment_keeps_only_what_no_earlier_one_stands_for() -> None:
    evidence = seen([[0, 0, 5, 0]], [5])
    found = trimmed([[0, 0, 3, 0], [2, 0.03, 5, 0.03]], evidence)
    expected = np.array([[0, 0, 3, 0], [3.05, 0.03, 5, 0.03]])
    np.testing.assert_allclose(found, expected, atol=0.06)


def test_a_segment_with_nothing_of_its_own_has_no_length_left() -> None:
    found = trimmed([[0, 0, 5, 0], [1, 0.1, 4, 0.1]], seen([[0, 0, 5, 0]], [5]))
    np.testing.assert_allclose(found[1, :2], found[1, 2:])


def test_a_wall_hardly_off_a_main_direction_follows_it_and_an_oblique_one_does_not() -> None:
    walls = np.array([[0.0, 0.0, 4.0, 0.04], [4.0, 1.0, 0.0, 1.02], [0.0, 2.0, 4.0, 2.3]])
    found = follow(walls, np.array([0.0, np.pi / 2]), np.deg2rad(5.0), 0.03)
    np.testing.assert_allclose(found[:2, 1], found[:2, 3], atol=1e-12)
    assert np.abs(found[:2] - walls[:2]).max() < 0.03
    np.testing.assert_array_equal(found[2], walls[2])


def test_where_there_is_no_main_direction_every_wall_stays() -> None:
    walls = np.array([[0.0, 0.0, 4.0, 0.04]])
    np.testing.assert_array_equal(follow(walls, np.empty(0), 0.1, 0.03), walls)
