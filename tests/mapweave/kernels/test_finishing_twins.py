"""What finishing a submap takes: the compiled kernels compute what their NumPy twins do."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapweave.kernels import clearing, multiview, polygons, scores
from mapweave.kernels.clearing import Grid, Sights
from mapweave.kernels.lines import evidence
from mapweave.kernels.loading import COMPILED
from mapweave.kernels.point_map import Floats

pytestmark = pytest.mark.skipif(COMPILED is None, reason="no compiled kernels here")
seeds = st.integers(0, 2**32 - 1)
counts = st.sampled_from([0, 1, 2, 30])


def same(one: object, other: object) -> None:
    """Check that two results, or two tuples of them, agree."""
    results = (x if isinstance(x, tuple) else (x,) for x in (one, other))
    for a, b in zip(*results, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-9, rtol=1e-9)


def some_segments(rng: np.random.Generator, count: int) -> Floats:
    start = rng.uniform(-4, 4, (count, 2))
    run = rng.normal(0, 1.5, (count, 2)) * (rng.random((count, 1)) < 0.9)  # some are points
    return np.hstack([start, start + run])


def directions(rng: np.random.Generator, count: int) -> Floats:
    angle = rng.uniform(-np.pi, np.pi, count)
    return np.column_stack([np.cos(angle), np.sin(angle)])


def some_sights(rng: np.random.Generator, count: int, beams: int = 40) -> Sights:
    angles = np.tile(np.linspace(-1.9, 1.9, beams), count)
    clear = rng.uniform(0, 6, count * beams) * (rng.random(count * beams) < 0.8)
    start = beams * np.arange(count + 1)
    return Sights(angles, clear, start, rng.uniform(-3, 3, (count, 3)))


@settings(max_examples=40, deadline=None)
@given(seeds, counts, counts, st.sampled_from([0.05, 0.3, 3.0]))
def test_segments_find_the_same_points_near_them(
    seed: int, count: int, points: int, reach: float
) -> None:
    rng = np.random.default_rng(seed)
    segments, places = some_segments(rng, count), rng.uniform(-4, 4, (points, 2))
    asked = segments, places, directions(rng, points), reach
    same(evidence.near_pairs(*asked), evidence.near_pairs_numpy(*asked))


@settings(max_examples=40, deadline=None)
@given(seeds, counts, counts, st.sampled_from([0.05, 0.3, 3.0]), st.sampled_from([-1.0, 0.9]))
def test_segments_share_as_much_with_others(
    seed: int, count: int, others: int, reach: float, least_cosine: float
) -> None:
    rng = np.random.default_rng(seed)
    asked = some_segments(rng, count), some_segments(rng, others), 0.1, reach, least_cosine
    same(evidence.find_shared(*asked), evidence.find_shared_numpy(*asked))


def test_of_a_segment_that_lies_along_two_half_each_all_is_covered() -> None:
    halves = np.array([[0.0, 0, 2, 0], [2, 0, 4, 0], [0, 5, 4, 5]])
    segment, other, shared, covered = evidence.find_shared(
        halves, np.array([[0.0, 0.01, 4, 0.01], [0, 3, 1, 3]]), 0.5, 0.05, 0.9
    )
    assert segment.tolist() == [0, 1] and other.tolist() == [0, 0]
    np.testing.assert_allclose(shared, [2, 2])
    np.testing.assert_allclose(covered, [1, 0])


@settings(max_examples=40, deadline=None)
@given(seeds, counts, counts)
def test_the_same_segments_are_taken(seed: int, count: int, samples: int) -> None:
    rng = np.random.default_rng(seed)
    pairs = 4 * min(count, samples)
    flat = rng.choice(max(count * samples, 1), min(pairs, count * samples), replace=False)
    segment, sample = np.divmod(flat, max(samples, 1))
    explains = rng.random(len(flat)) < 0.8
    weights = rng.integers(1, 64, samples) / 32  # sums without rounding: of equals, the first
    asked = count, segment, sample, explains, weights, 0.3
    same(evidence.take_greedily(*asked), evidence.take_greedily_numpy(*asked))


@settings(max_examples=40, deadline=None)
@given(seeds, counts)
def test_samples_are_gathered_alike(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    asked = rng.uniform(-0.2, 0.2, (count, 2)), directions(rng, count), rng.uniform(1, 2, count)
    same(evidence.gather(*asked, 0.05, 24), evidence.gather_numpy(*asked, 0.05, 24))


@settings(max_examples=40, deadline=None)
@given(seeds, st.integers(1, 5), counts, counts, st.sampled_from([0.04, 0.15, 1.0]))
def test_scans_pull_at_each_other_alike(
    seed: int, scans: int, points: int, walls: int, scale: float
) -> None:
    rng = np.random.default_rng(seed)
    moving = (
        rng.uniform(-1, 1, (points, 2)),
        directions(rng, points),
        rng.integers(0, scans, points),
    )
    poses = rng.normal(0, 0.2, (scans, 3))
    staying = rng.uniform(-1, 1, (walls, 2)), directions(rng, walls)
    asked = *moving, poses, *staying, 0.4, 3, scale
    same(multiview.normal_equations(*asked), multiview.normal_equations_numpy(*asked))


@settings(max_examples=25, deadline=None)
@given(seeds, st.integers(0, 20))
def test_a_positive_definite_system_is_solved(seed: int, size: int) -> None:
    rng = np.random.default_rng(seed)
    root, right = rng.normal(0, 1, (size, size)), rng.normal(0, 1, size)
    matrix = root @ root.T + np.eye(size)
    np.testing.assert_allclose(matrix @ multiview.solve_positive(matrix, right), right, atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(seeds, st.integers(0, 4), st.sampled_from([0.0, 0.15]))
def test_scans_clear_the_same_cells(seed: int, scans: int, margin: float) -> None:
    rng = np.random.default_rng(seed)
    asked = some_sights(rng, scans), margin, Grid(np.array([-4.0, -3.0]), 0.1, 90, 70)
    same(clearing.clear_cells(*asked), clearing.clear_cells_numpy(*asked))


@settings(max_examples=40, deadline=None)
@given(seeds, st.integers(1, 3), st.sampled_from([0.3, 0.9, 1.0]), st.integers(1, 30))
def test_the_same_is_deep_in_free_space_and_its_outlines_are_the_same(
    seed: int, depth: int, share: float, rows: int
) -> None:
    rng = np.random.default_rng(seed)
    free = (rng.random((rows, 20)) < share).astype(np.uint8)
    distance = clearing.from_core(free, depth)
    same(distance, clearing.from_core_numpy(free, depth))
    found = clearing.outlines(distance, depth - 0.5)
    same(found, clearing.outlines_numpy(distance, depth - 0.5))


@settings(max_examples=40, deadline=None)
@given(seeds, counts, st.integers(0, 12))
def test_points_and_paths_are_as_deep_inside(seed: int, count: int, corners: int) -> None:
    rng = np.random.default_rng(seed)
    ring = rng.uniform(-3, 3, (corners, 2))
    edges = np.hstack([ring, np.roll(ring, -1, axis=0)])
    points, paths = rng.uniform(-4, 4, (count, 2)), rng.uniform(-4, 4, (count, 3, 2))
    asked = points, edges, 0.5
    same(polygons.depths(*asked), polygons.depths_numpy(*asked))
    same(polygons.lengths_inside(paths, edges), polygons.lengths_inside_numpy(paths, edges))


def a_scored_map(rng: np.random.Generator, count: int) -> scores.ScoredMap:
    points, (facing, weight, missing) = (
        rng.uniform(-9, 9, (count, 2)),
        rng.uniform(0, 1, (3, count)),
    )
    origin, codes = rng.uniform(-9, -5, 2), rng.integers(0, 3, (20, 15), dtype=np.uint8)
    return scores.ScoredMap(points, facing, weight, missing, origin, rng.choice([0.5, 0.7]), codes)


@settings(max_examples=40, deadline=None)
@given(seeds, counts, counts, st.sampled_from([1, 7, 100]))
def test_maps_are_worth_the_same_at_many_motions(
    seed: int, count: int, motions: int, most: int
) -> None:
    rng = np.random.default_rng(seed)
    maps = a_scored_map(rng, count), a_scored_map(rng, 30)
    moved = np.column_stack([rng.uniform(-9, 9, (motions, 2)), rng.uniform(-3, 3, motions)])
    asked = *maps, moved, most, rng.normal(0, 1, (3, 64)).astype(np.float32)
    same(scores.mutual_scores(*asked), scores.mutual_scores_numpy(*asked))


ONE, PLACES = np.ones(1, dtype=np.int64), np.zeros((1, 2))


@pytest.mark.parametrize(
    "refused",
    [
        lambda: evidence.near_pairs(np.zeros((1, 4)), np.zeros((2, 2)), np.zeros((1, 2)), 1.0),
        lambda: evidence.near_pairs(np.full((1, 4), np.nan), PLACES, PLACES, 1.0),
        lambda: evidence.find_shared(np.full((1, 4), np.nan), np.ones((1, 4)), 1.0, 1.0, 0.0),
        lambda: evidence.take_greedily(1, ONE, ONE, ONE == 1, np.ones(1), 0.0),
        lambda: evidence.gather(np.zeros((1, 2)), np.zeros((2, 2)), np.ones(1), 1.0, 4),
        lambda: multiview.solve_positive(np.zeros((2, 2)), np.zeros(2)),
        lambda: clearing.from_core(np.zeros((2, 2), np.uint8), 0),
        lambda: clearing.outlines(np.zeros((3, 3), np.float32), 1.0),
        lambda: polygons.depths(np.zeros((1, 2)), np.zeros((1, 3)), 1.0),
    ],
)
def test_what_does_not_agree_is_refused(refused: Callable[[], object]) -> None:
    with pytest.raises(ValueError, match="expected"):
        refused()
