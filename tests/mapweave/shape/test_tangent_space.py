"""Shape similarity and complexity by turn angles (paper, VIII-A, B)."""

from math import pi

import numpy as np
import pytest
from numpy.typing import ArrayLike

from mapweave.errors import ArgumentError
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.shape.tangent_space import (
    NoShapeError,
    complexities,
    complexity,
    similarity,
    tangent_space,
)

SEEDS = range(8)


def random_polyline(seed: int, n: int = 9) -> FloatArray:
    """Return a generalized polyline: segments in order, with gaps."""
    rng = np.random.default_rng(seed)
    direction = np.cumsum(rng.uniform(-0.9 * pi, 0.9 * pi, n))
    step = rng.uniform(0.2, 2, n)[:, None] * np.column_stack([np.cos(direction), np.sin(direction)])
    start = np.cumsum(step + rng.normal(0, 0.2, (n, 2)), axis=0)
    return np.hstack([start, start + step])


def regular_polygon(corners: int) -> FloatArray:
    vertices = np.exp(2j * pi * np.arange(corners + 1) / corners)
    points = np.column_stack([vertices.real, vertices.imag])
    return np.hstack([points[:-1], points[1:]])


def corner(first: float, second: float, turn: float) -> FloatArray:
    """Return two legs of the given lengths [m] with a turn [rad] between them."""
    end = first + second * np.exp(1j * turn)
    return np.array([[0, 0, first, 0], [first, 0, end.real, end.imag]])


@pytest.mark.parametrize("seed", SEEDS)
def test_rotation_that_the_formula_gives_is_the_best(seed: int) -> None:
    """Brute force over Θ and over finely sampled arc length finds no smaller integral."""
    c, d = random_polyline(seed), random_polyline(seed + 100, 6)
    arc = (np.arange(20_000) + 0.5) / 20_000
    difference = tangent_space(c).at(arc) - tangent_space(d).at(arc)
    theta = np.linspace(-30, 30, 2_401)
    integrals = np.mean(difference**2) + 2 * theta * np.mean(difference) + theta**2
    s, best = similarity(c, d)
    assert s == pytest.approx(integrals.min(), abs=1e-2)
    assert s <= integrals.min() + 1e-3 * abs(s)
    assert abs(float(se2.wrap(theta[integrals.argmin()] - best))) < 0.02


@pytest.mark.parametrize("seed", SEEDS)
def test_a_moved_and_scaled_copy_is_identical_and_its_rotation_recovered(seed: int) -> None:
    polyline = random_polyline(seed)
    pose = np.random.default_rng(seed).uniform(-pi, pi, 3)
    s, theta = similarity(polyline, 3.7 * se2.transform_segments(pose, polyline))
    assert s == pytest.approx(0, abs=1e-12)
    assert theta == pytest.approx(pose[2])


@pytest.mark.parametrize("seed", SEEDS)
def test_rigid_motion_of_either_changes_only_the_rotation(seed: int) -> None:
    c, d = random_polyline(seed), random_polyline(seed + 50)
    a, b = np.random.default_rng(seed).uniform(-pi, pi, (2, 3))
    s, theta = similarity(c, d)
    moved_s, moved = similarity(se2.transform_segments(a, c), se2.transform_segments(b, d))
    assert moved_s == pytest.approx(s)
    assert float(se2.wrap(moved - (theta + b[2] - a[2]))) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_similarity_is_symmetric_and_the_rotation_turns_back(seed: int) -> None:
    c, d = random_polyline(seed), random_polyline(seed + 50)
    there, back = similarity(c, d), similarity(d, c)
    assert there[0] == pytest.approx(back[0])
    assert float(se2.wrap(there[1] + back[1])) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_square_root_of_similarity_obeys_the_triangle_inequality(seed: int) -> None:
    """The root is a distance: of the functions T less their means, in L²."""
    c, d, e = (random_polyline(seed + offset) for offset in (0, 50, 100))
    cd, de, ce = (np.sqrt(similarity(*pair)[0]) for pair in ((c, d), (d, e), (c, e)))
    assert ce <= cd + de + 1e-9


@pytest.mark.parametrize("seed", SEEDS)
def test_splitting_segments_changes_nothing(seed: int) -> None:
    """T(P) is a function of arc length, not of the vertices it was stored with."""
    polyline = random_polyline(seed)
    middle = (polyline[:, :2] * 0.3) + (polyline[:, 2:] * 0.7)
    split = np.stack([np.hstack([polyline[:, :2], middle]), np.hstack([middle, polyline[:, 2:]])])
    s, theta = similarity(polyline, split.transpose(1, 0, 2).reshape(-1, 4))
    assert (s, theta) == pytest.approx((0, 0), abs=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_gaps_are_no_arc_length(seed: int) -> None:
    polyline = random_polyline(seed)
    shift = np.random.default_rng(seed).normal(0, 5, (len(polyline), 2))
    apart = polyline + np.hstack([shift, shift])
    assert similarity(polyline, apart)[0] == pytest.approx(0, abs=1e-12)
    assert tangent_space(apart).length == pytest.approx(tangent_space(polyline).length)


def test_segments_without_length_are_passed_over() -> None:
    bent = corner(1, 1, pi / 2)
    with_point = np.insert(bent, 1, [1, 0, 1, 0], axis=0)
    assert complexity(with_point) == pytest.approx(complexity(bent))


@pytest.mark.parametrize("direction", [0.0, 1.0, pi, -3.0])
def test_a_straight_line_has_no_complexity(direction: float) -> None:
    """Also when it is broken, with gaps, and when its directions wobble around ±π."""
    start = np.arange(5)[:, None] * [np.cos(direction), np.sin(direction)]
    line = np.hstack([start, start + 0.7 * np.array([np.cos(direction), np.sin(direction)])])
    assert complexity(line) == pytest.approx(0, abs=1e-12)


def test_wobble_around_the_negative_x_axis_is_small_complexity() -> None:
    """Directions of 179° and -179° differ by 2°, not by 358°."""
    wobble = np.radians(1)
    line = se2.transform_segments([0, 0, pi - wobble], corner(1, 1, 2 * wobble))
    assert complexity(line) == pytest.approx(wobble**2)


@pytest.mark.parametrize(("first", "second"), [(1.0, 1.0), (1.0, 3.0), (2.5, 0.5)])
@pytest.mark.parametrize("turn", [pi / 2, -pi / 2, pi / 6, -3.0])
def test_complexity_of_a_corner_has_a_closed_form(first: float, second: float, turn: float) -> None:
    """Two values apart by the turn, with shares p and 1-p, vary by p (1-p) turn²."""
    share = first / (first + second)
    expected = share * (1 - share) * turn**2
    assert complexity(corner(first, second, turn)) == pytest.approx(expected)


def test_right_angle_with_equal_legs_has_complexity_quarter_pi_squared() -> None:
    assert complexity(corner(1, 1, pi / 2)) == pytest.approx((pi / 4) ** 2)


@pytest.mark.parametrize("corners", [3, 4, 6, 100])
def test_complexity_of_a_closed_polygon_follows_all_the_way_round(corners: int) -> None:
    """Turning by 2π in n equal steps is a uniform distribution over n values."""
    expected = (2 * pi / corners) ** 2 * (corners**2 - 1) / 12
    assert complexity(regular_polygon(corners)) == pytest.approx(expected)


def test_left_and_right_corner_differ() -> None:
    """Mirror images are different shapes: ±π/4 each, after the best rotation."""
    left, right = corner(1, 1, pi / 2), corner(1, 1, -pi / 2)
    s, theta = similarity(left, right)
    assert s == pytest.approx((pi / 2) ** 2)
    assert theta == pytest.approx(-pi / 2)


@pytest.mark.parametrize("polyline", [np.empty((0, 4)), np.array([[1.0, 2, 1, 2]])])
def test_a_polyline_without_length_has_no_shape(polyline: FloatArray) -> None:
    with pytest.raises(NoShapeError, match="length above zero"):
        complexity(polyline)
    with pytest.raises(NoShapeError):
        similarity(corner(1, 1, 1), polyline)


def test_the_complexities_of_all_polylines_at_once_are_those_of_each() -> None:
    rng = np.random.default_rng(1)
    segments = rng.uniform(-3, 3, (40, 4))
    segments[7, 2:] = segments[7, :2]  # one without length
    polyline = np.sort(rng.integers(0, 9, 40))
    each = [complexity(segments[polyline == name]) for name in np.unique(polyline)]
    np.testing.assert_allclose(complexities(segments, polyline), each, atol=1e-12)


def test_a_polyline_without_length_among_others_is_not_complex() -> None:
    corner = np.array([[0.0, 0, 1, 0], [1, 0, 1, 1], [5, 5, 5, 5]])
    expected = [complexity(corner[:2]), 0]
    np.testing.assert_allclose(complexities(corner, np.array([0, 0, 4])), expected)
    assert complexities(np.empty((0, 4)), np.empty(0, dtype=np.int64)).shape == (0,)


def test_a_polyline_is_given_as_vertices_or_as_segments() -> None:
    vertices = [(0, 0), (2, 0), (2, 1), (5, 1)]
    segments = [(0, 0, 2, 0), (2, 0, 2, 1), (2, 1, 5, 1)]
    assert complexity(vertices) == complexity(segments) > 0
    assert similarity(vertices, segments) == (0.0, 0.0)


@pytest.mark.parametrize(
    "wrong", [np.zeros((2, 3)), [0, 0, 1, 1], [[0, 0, 1, np.nan]], [[0, 0]], "wall"]
)
def test_what_is_no_polyline_is_refused_by_the_name_of_the_argument(wrong: ArrayLike) -> None:
    corner = [[0, 0], [1, 0], [1, 1]]
    with pytest.raises(ArgumentError, match=r"^polyline: expected"):
        complexity(wrong)
    with pytest.raises(ArgumentError, match=r"^c: expected"):
        similarity(wrong, corner)
    with pytest.raises(ArgumentError, match=r"^d: expected"):
        similarity(corner, wrong)
