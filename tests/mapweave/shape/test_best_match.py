"""A part is found within a polyline, wherever it begins (paper, VIII, H2 and VIII-C)."""

from math import pi

import numpy as np
import pytest
from numpy.typing import ArrayLike

from mapweave.errors import ArgumentError
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.shape.partial_match import best_match
from mapweave.shape.stretch import stretch_of
from mapweave.shape.tangent_space import NoShapeError, similarity

SEEDS = range(8)
CORNER = np.array([[0.0, 0, 1, 0], [1, 0, 1, 1]])  # a left turn of 90° between two metres
ELBOW = np.array([[0.0, 0, 3, 0], [3, 0, 3, 3]])  # the same turn with legs of 3 m


def wandering(seed: int, n: int) -> FloatArray:
    """Return a generalized polyline of `n` segments, with gaps."""
    rng = np.random.default_rng(seed)
    direction = np.cumsum(rng.uniform(-0.9 * pi, 0.9 * pi, n))
    step = rng.uniform(0.3, 2, n)[:, None] * np.column_stack([np.cos(direction), np.sin(direction)])
    start = np.cumsum(step + rng.normal(0, 0.2, (n, 2)), axis=0)
    return np.hstack([start, start + step])


def pair(seed: int) -> tuple[FloatArray, FloatArray]:
    """Return a part and a longer polyline that have nothing to do with each other."""
    return wandering(seed, 3), wandering(seed + 100, 12)


def reversed_(polyline: FloatArray) -> FloatArray:
    """Return the polyline walked from its end to its start."""
    return polyline[::-1][:, [2, 3, 0, 1]]


def length(polyline: FloatArray) -> float:
    return float(np.hypot(*(polyline[:, 2:] - polyline[:, :2]).T).sum())


def test_a_corner_is_found_in_the_middle_of_longer_walls() -> None:
    """By hand: the turn comes after 3 m, a metre of the part before it, so it begins at 2 m."""
    found = best_match(CORNER, ELBOW)
    assert (found.similarity, found.rotation, found.start) == pytest.approx((0, 0, 2), abs=1e-12)
    stretch = stretch_of(ELBOW, found.start, found.end)
    np.testing.assert_allclose(stretch, [[2, 0, 3, 0], [3, 0, 3, 1]], atol=1e-12)


def test_of_a_flatter_corner_the_part_is_off_by_half_the_difference_on_either_leg() -> None:
    """By hand: 90° against 60° in phase leaves ±15° after the best rotation, (π/12)² in all.

    Out of phase by a share of arc length, that share differs by 60° or 90° more.
    """
    x, y = 3 + 3 * np.cos(pi / 3), 3 * np.sin(pi / 3)
    flatter = np.array([[0.0, 0, 3, 0], [3, 0, x, y]])
    found = best_match(CORNER, flatter)
    assert (found.similarity, found.start) == pytest.approx(((pi / 12) ** 2, 2))
    assert found.rotation == pytest.approx(-pi / 12)  # from a mean of 45° to one of 30°


def test_on_a_straight_wall_all_offsets_are_alike_and_the_first_is_taken() -> None:
    """By hand: what is left of a right angle is its own complexity, (π/4)²."""
    found = best_match(CORNER, np.array([[4.0, 1, 9, 1]]))
    assert (found.similarity, found.start) == pytest.approx(((pi / 4) ** 2, 0))


@pytest.mark.parametrize("seed", SEEDS)
def test_no_offset_of_a_fine_grid_is_better(seed: int) -> None:
    """The offsets where breakpoints meet suffice: a brute-force slide finds nothing below them."""
    part, polyline = pair(seed)
    found = best_match(part, polyline)
    begins = np.linspace(0, length(polyline) - length(part), 400)
    grid = [similarity(part, stretch_of(polyline, b, b + length(part)))[0] for b in begins]
    assert found.similarity <= min(grid) + 1e-9
    assert min(grid) == pytest.approx(found.similarity, abs=0.15)  # and the grid comes near it


@pytest.mark.parametrize("seed", SEEDS)
def test_what_is_found_is_as_similar_as_it_says_and_as_long_as_the_part(seed: int) -> None:
    part, polyline = pair(seed)
    found = best_match(part, polyline)
    stretch = stretch_of(polyline, found.start, found.end)
    s, theta = similarity(part, stretch)
    assert found.similarity == pytest.approx(s, abs=1e-9)
    assert float(se2.wrap(found.rotation - theta)) == pytest.approx(0, abs=1e-9)
    assert length(stretch) == pytest.approx(length(part))


@pytest.mark.parametrize("seed", SEEDS)
def test_a_part_cut_out_and_moved_is_found_where_it_was(seed: int) -> None:
    polyline = wandering(seed, 12)
    rng = np.random.default_rng(seed)
    begin = rng.uniform(0.5, length(polyline) - 4.5)
    pose = rng.uniform(-pi, pi, 3)
    found = best_match(
        se2.transform_segments(pose, stretch_of(polyline, begin, begin + 4)), polyline
    )
    assert (found.similarity, found.start) == pytest.approx((0, begin), abs=1e-6)
    assert float(se2.wrap(found.rotation + pose[2])) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_rigid_motions_change_the_rotation_alone(seed: int) -> None:
    part, polyline = pair(seed)
    a, b = np.random.default_rng(seed).uniform(-pi, pi, (2, 3))
    still = best_match(part, polyline)
    moved = best_match(se2.transform_segments(a, part), se2.transform_segments(b, polyline))
    assert (moved.similarity, moved.start) == pytest.approx((still.similarity, still.start))
    turned = se2.wrap(moved.rotation - (still.rotation + b[2] - a[2]))
    assert float(turned) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_walked_the_other_way_the_same_stretch_is_found(seed: int) -> None:
    part, polyline = pair(seed)
    there, back = best_match(part, polyline), best_match(reversed_(part), reversed_(polyline))
    assert back.similarity == pytest.approx(there.similarity)
    assert back.start == pytest.approx(length(polyline) - length(part) - there.start)
    assert back.end == pytest.approx(length(polyline) - there.start)


@pytest.mark.parametrize("seed", SEEDS)
def test_scaling_both_scales_where_the_part_begins_alone(seed: int) -> None:
    part, polyline = pair(seed)
    still, scaled = best_match(part, polyline), best_match(3.7 * part, 3.7 * polyline)
    assert (scaled.similarity, scaled.start) == pytest.approx((still.similarity, 3.7 * still.start))


def test_a_part_as_long_as_the_polyline_is_compared_as_a_whole() -> None:
    found = best_match(CORNER, reversed_(CORNER))
    assert (found.similarity, found.start) == pytest.approx(
        ((pi / 2) ** 2, 0)
    )  # a right turn, seen so
    assert found.end == pytest.approx(2)


def test_a_stretch_leaves_gaps_and_segments_without_length_out() -> None:
    """By hand: 2 m, nothing, a gap, 2 m; from 1 m to 3 m are the last of one and the first."""
    polyline = np.array([[0.0, 0, 2, 0], [2, 0, 2, 0], [5, 5, 5, 7]])
    np.testing.assert_allclose(stretch_of(polyline, 1, 3), [[1, 0, 2, 0], [5, 5, 5, 6]])


def test_a_part_longer_than_the_polyline_is_refused_with_both_lengths() -> None:
    with pytest.raises(ArgumentError, match=r"^part: expected at most .* 2 m, got 6 m"):
        best_match(ELBOW, CORNER)


def test_a_part_without_length_has_no_shape() -> None:
    with pytest.raises(NoShapeError):
        best_match(np.array([[1.0, 1, 1, 1]]), CORNER)


def test_of_equal_stretches_the_first_is_taken_and_vertices_are_polylines() -> None:
    stairs = [[0, 0], [1, 0], [1, 1], [2, 1], [2, 2], [3, 2], [3, 3]]
    assert best_match(stairs[:3], stairs).start == pytest.approx(0)


@pytest.mark.parametrize("wrong", [[[0, 0, 1]], [[0, 0, 1, np.nan]], [0, 0, 1, 1], "wall"])
def test_what_is_no_polyline_is_refused_by_the_name_of_the_argument(wrong: ArrayLike) -> None:
    with pytest.raises(ArgumentError, match=r"^part: expected"):
        best_match(wrong, ELBOW)
    with pytest.raises(ArgumentError, match=r"^polyline: expected"):
        best_match(CORNER, wrong)
