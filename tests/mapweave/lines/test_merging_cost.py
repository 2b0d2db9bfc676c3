"""The merging cost, the line ld and the merged segment are as the paper's section VII has them."""

import numpy as np
import pytest
from numpy.typing import ArrayLike

from mapweave.errors import ArgumentError
from mapweave.geometry import se2
from mapweave.geometry.arrays import ComplexArray, FloatArray
from mapweave.lines.merging import MergingParameters, evolve
from mapweave.lines.merging_cost import (
    CostWeights,
    Pairs,
    collinearity,
    line_height,
    merge_cost,
    merged_segment,
    merged_segments,
    parallelism,
    proximity,
)


def pair_of(first: list[float], second: list[float]) -> Pairs:
    return Pairs.of(np.array([first]), np.array([second]))


def unit(degrees: float) -> ComplexArray:
    return np.array([np.exp(1j * np.deg2rad(degrees))])


def some_segments(seed: int, count: int = 200) -> tuple[FloatArray, FloatArray]:
    random = np.random.default_rng(seed)
    return random.normal(0, 2, (count, 4)), random.normal(0, 2, (count, 4))


def plain_cost(first: FloatArray, second: FloatArray, direction: float | None) -> float:
    """Return C for one pair, constructed point by point as the paper describes it."""
    a, b, c, d = first[:2], first[2:], second[:2], second[2:]
    if np.linalg.norm((b - a) - (d - c)) > np.linalg.norm((b - a) + (d - c)):
        c, d = d, c
    mean = (b - a) + (d - c)
    mean = mean / np.linalg.norm(mean)
    ad = mean if direction is None else np.array([np.cos(direction), np.sin(direction)])
    l1, l2 = float(np.linalg.norm(b - a)), float(np.linalg.norm(d - c))

    def opening(start: FloatArray, end: FloatArray) -> float:
        # The intersection of {start + s ad} and {end + t across}.
        along = end - start
        across = np.array([-along[1], along[0]])
        s, _ = np.linalg.solve(np.column_stack([ad, -across]), end - start)
        return float(np.linalg.norm(start + s * ad - end))

    normal = np.array([-mean[1], mean[0]])
    m1, m2 = (a + b) / 2, (c + d) / 2
    on_line = m1 + (m2 - m1) * l2 / (l1 + l2)

    def from_lwa(point: FloatArray) -> float:
        return abs(float(normal @ (point - on_line)))

    def from_segment(point: FloatArray, start: FloatArray, end: FloatArray) -> float:
        share = np.clip((point - start) @ (end - start) / ((end - start) @ (end - start)), 0, 1)
        return float(np.linalg.norm(point - start - share * (end - start)))

    par = (l1 * opening(a, b) + l2 * opening(c, d)) / (l1 + l2)
    col = max(from_lwa(a), from_lwa(b)) + max(from_lwa(c), from_lwa(d))
    prox = min(
        from_segment(a, c, d), from_segment(b, c, d), from_segment(c, a, b), from_segment(d, a, b)
    )
    return 2 * par + col / 4 + prox / 2


@pytest.mark.parametrize("direction", [None, 0.4])
def test_the_cost_is_that_of_the_construction_in_the_paper(direction: float | None) -> None:
    first, second = some_segments(1)
    expected = [plain_cost(a, b, direction) for a, b in zip(first, second, strict=True)]
    np.testing.assert_allclose(merge_cost(first, second, direction), expected, rtol=1e-9)


@pytest.mark.parametrize("seed", range(60))
def test_two_segments_evolve_into_one_exactly_where_the_cost_in_the_paper_allows(seed: int) -> None:
    """Up to 55° from each other and of any lengths; neither gaps nor steps keep them apart."""
    random = np.random.default_rng(seed)
    turn = random.uniform(-3, 3) + np.array([0.0, random.uniform(-0.96, 0.96)])
    start = random.normal(0, 0.3, (2, 2))
    along = random.uniform(0.3, 3.0, (2, 1)) * np.column_stack([np.cos(turn), np.sin(turn)])
    pair = np.hstack([start, start + along])
    cost = plain_cost(pair[0], pair[1], None)
    for limit, left in ((0.99 * cost, 2), (1.01 * cost, 1)):
        open_to_all = MergingParameters(
            max_cost=limit, max_step=1e3, max_gap=1e3, direction_tolerance=0.0
        )
        assert len(evolve(pair, None, open_to_all).segments) == left


def test_parallelism_is_length_times_tangent() -> None:
    """B' is where the perpendicular to L1 through B meets the direction line through A."""
    pairs = pair_of([0, 0, 2, 0], [0, 1, 2, 1])
    assert parallelism(pairs, unit(30))[0] == pytest.approx(2 * np.tan(np.pi / 6))


def test_parallelism_weighs_the_longer_segment_more() -> None:
    pairs = pair_of([0, 0, 3, 0], [0, 1, np.sqrt(0.5), 1 + np.sqrt(0.5)])
    assert parallelism(pairs, unit(0))[0] == pytest.approx(1 / 4 * 1.0 * np.tan(np.pi / 4))


@pytest.mark.parametrize("second", [[0, 1, 2, 1], [0, 0, 1, 1]])
def test_parallelism_is_infinite_when_the_direction_is_orthogonal_to_a_segment(
    second: list[float],
) -> None:
    pairs = pair_of([0, 0, 2, 0], second)
    assert np.isposinf(parallelism(pairs, unit(90))[0])
    assert np.isposinf(merge_cost(np.array([[0, 0, 2, 0]]), np.array([second]), np.pi / 2)[0])


def test_parallelism_is_zero_iff_both_segments_and_the_direction_are_parallel() -> None:
    parallel = pair_of([0, 0, 2, 0], [5, 3, 4, 3])
    skew = pair_of([0, 0, 2, 0], [5, 3, 4, 3.01])
    assert parallelism(parallel, unit(0))[0] == pytest.approx(0, abs=1e-12)
    assert parallelism(parallel, unit(1))[0] > 0
    assert parallelism(skew, unit(0))[0] > 0
    assert parallelism(skew, skew.mean_direction)[0] > 0


def test_collinearity_is_zero_iff_the_segments_are_collinear() -> None:
    assert collinearity(pair_of([0, 0, 1, 1], [5, 5, 3, 3]))[0] == pytest.approx(0, abs=1e-12)
    assert collinearity(pair_of([0, 0, 1, 0], [2, 0.1, 3, 0.1]))[0] == pytest.approx(0.1)
    assert collinearity(pair_of([0, 0, 1, 0], [0.5, 0, 1.5, 0.1]))[0] > 0


def test_proximity_is_zero_iff_an_end_of_one_lies_on_the_other() -> None:
    assert proximity(pair_of([0, 0, 2, 0], [1, 0, 1, 3]))[0] == pytest.approx(0)
    assert proximity(pair_of([0, 0, 2, 0], [2, 0, 5, 1]))[0] == pytest.approx(0)
    assert proximity(pair_of([0, 0, 2, 0], [3, 0, 5, 0]))[0] == pytest.approx(1)
    # Crossing is not touching with an end: the paper's definition looks at ends.
    assert proximity(pair_of([-1, 0, 1, 0], [0, -0.5, 0, 2]))[0] == pytest.approx(0.5)


def test_collinear_touching_segments_cost_nothing() -> None:
    cost = merge_cost(np.array([[0.0, 0, 1, 2]]), np.array([[1.0, 2, 3, 6]]))
    assert cost[0] == pytest.approx(0, abs=1e-12)


def test_the_parts_are_weighed_2_to_a_quarter_to_a_half() -> None:
    assert CostWeights() == CostWeights(parallelism=2, collinearity=0.25, proximity=0.5)


def test_how_a_segment_is_directed_does_not_matter() -> None:
    first, second = some_segments(2)
    expected = merge_cost(first, second)
    np.testing.assert_allclose(merge_cost(first[:, [2, 3, 0, 1]], second), expected)
    np.testing.assert_allclose(merge_cost(first, second[:, [2, 3, 0, 1]]), expected)


def test_the_cost_is_symmetric() -> None:
    first, second = some_segments(3)
    np.testing.assert_allclose(merge_cost(first, second), merge_cost(second, first))


def test_a_rigid_motion_changes_no_cost_and_moves_the_merged_segment_along() -> None:
    first, second = some_segments(4)
    for motion in np.random.default_rng(4).uniform(-3, 3, (5, 3)):
        moved = se2.transform_segments(motion, first), se2.transform_segments(motion, second)
        np.testing.assert_allclose(
            merge_cost(*moved, 0.3 + motion[2]), merge_cost(first, second, 0.3), rtol=1e-6
        )
        np.testing.assert_allclose(
            merged_segment(*moved),
            se2.transform_segments(motion, merged_segment(first, second)),
            atol=1e-9,
        )


def test_one_segment_pairs_with_many() -> None:
    first, second = some_segments(5)
    repeated = np.repeat(first[:1], len(second), axis=0)
    np.testing.assert_array_equal(merge_cost(first[:1], second), merge_cost(repeated, second))


def test_the_line_is_placed_so_that_distance_times_length_is_equal_on_both_sides() -> None:
    """d1 l1 = d2 l2, the midpoints on different sides of the line."""
    pairs = Pairs.of(*some_segments(6))
    direction = np.full(200, np.exp(0.7j))
    middles = (pairs.ends[::2] + pairs.ends[1::2]) / 2
    signed = (direction.conj() * middles).imag - line_height(pairs, direction)
    np.testing.assert_allclose(signed[0] * pairs.lengths[0], -signed[1] * pairs.lengths[1])


def test_the_merged_segment_is_the_hull_of_the_projections() -> None:
    merged = merged_segment(np.array([[0.0, 0, 3, 0]]), np.array([[2.0, 0.4, 3.0, 0.4]]))
    np.testing.assert_allclose(merged, [[0, 0.1, 3, 0.1]])


def test_the_merged_segment_follows_the_direction_and_covers_both() -> None:
    first, second = some_segments(7)
    merged = merged_segment(first, second, 0.7)
    ahead = np.array([np.cos(0.7), np.sin(0.7)])
    across = np.array([-ahead[1], ahead[0]])
    ends = np.stack([merged[:, :2], merged[:, 2:]])
    np.testing.assert_allclose(ends[0] @ across, ends[1] @ across)
    both = np.stack([*np.hsplit(first, 2), *np.hsplit(second, 2)]) @ ahead
    np.testing.assert_allclose((ends @ ahead).min(axis=0), both.min(axis=0))
    np.testing.assert_allclose((ends @ ahead).max(axis=0), both.max(axis=0))


def test_the_merged_segment_is_directed_as_the_first() -> None:
    first, second = some_segments(8)
    for direction in (None, 0.7, 0.7 + np.pi):
        merged = merged_segment(first, second, direction)
        product = ((merged[:, 2:] - merged[:, :2]) * (first[:, 2:] - first[:, :2])).sum(axis=1)
        assert (product >= 0).all()


def test_a_segment_of_weight_moves_the_less_for_it() -> None:
    wall, sighting = np.array([[0.0, 0, 4, 0]]), np.array([[0.0, 0.1, 4, 0.1]])
    assert merged_segment(wall, sighting)[0, 1] == pytest.approx(0.05)
    moved = merged_segment(wall, sighting, first_weight=396.0, second_weight=4.0)
    assert moved[0, 1] == pytest.approx(0.001)


def test_weights_in_place_of_lengths_are_lengths_by_default() -> None:
    first, second = some_segments(9)
    lengths = [np.hypot(*(s[:, 2:] - s[:, :2]).T) for s in (first, second)]
    weighed = merge_cost(first, second, first_weight=lengths[0], second_weight=lengths[1])
    np.testing.assert_allclose(weighed, merge_cost(first, second))


def test_ends_within_the_noise_are_averaged_and_others_are_not() -> None:
    pairs = pair_of([0, 0, 4, 0], [0.04, 0, 6, 0])
    share = 4 / (4 + 5.96)
    merged = merged_segments(pairs, unit(0), end_noise=0.05)
    np.testing.assert_allclose(merged, [[0.04 * (1 - share), 0, 6, 0]], atol=1e-12)


def test_a_segment_of_no_length_is_merged_with_nothing() -> None:
    cost = merge_cost(np.array([[1.0, 1, 1, 1]]), np.array([[0.0, 1, 2, 1], [1, 1, 1, 1]]))
    assert np.isposinf(cost).all()


def test_one_pair_is_given_as_lists_and_compared_with_itself_costs_nothing() -> None:
    np.testing.assert_allclose(merge_cost([0, 0, 3, 1], [0, 0, 3, 1]), [0.0], atol=1e-12)
    np.testing.assert_allclose(merged_segment([0, 0, 3, 1], [0, 0, 3, 1]), [[0, 0, 3, 1]])


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("first", [[0.0, 0, 1]]),
        ("first", [[0.0, 0, 1, np.nan]]),
        ("second", [[0, 0, 1, 0]] * 3),
        ("second", "wall"),
        ("direction", [0.1, 0.2, 0.3]),
        ("direction", np.nan),
        ("first_weight", [1.0]),
        ("second_weight", np.inf),
    ],
)
def test_what_is_no_pair_is_refused_by_the_name_of_the_argument(
    argument: str, value: ArrayLike
) -> None:
    walls = [[0, 0, 3, 0], [0, 1, 3, 1]]
    given: dict[str, ArrayLike] = {"first": walls, "second": walls, argument: value}
    for function in (merge_cost, merged_segment):
        with pytest.raises(ArgumentError, match=rf"^{argument}: expected"):
            function(**given)
