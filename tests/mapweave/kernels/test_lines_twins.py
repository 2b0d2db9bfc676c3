"""The compiled kernels of lines compute what their NumPy twins do."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import Generator

from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.kernels.denials import NumpyWitnesses
from mapweave.kernels.lines.evidence import near_points
from mapweave.kernels.lines.main_directions import (
    direction_histogram,
    direction_histogram_numpy,
    likely_turns,
    likely_turns_numpy,
    numpy_main_directions,
)
from mapweave.kernels.lines.merging import NumpyEvolvingMap
from mapweave.kernels.lines.polylines import numpy_group_polylines
from mapweave.kernels.lines.sampling import (
    sample_lines,
    sample_lines_numpy,
    sample_parts,
    sample_parts_numpy,
)
from mapweave.kernels.lines.slivers import numpy_sliver_owners
from mapweave.kernels.loading import COMPILED
from mapweave.lines.merging import MergingParameters
from mapweave.lines.merging_cost import CostWeights

pytestmark = pytest.mark.skipif(COMPILED is None, reason="no compiled kernels here")
seeds = st.integers(0, 2**32 - 1)
sizes = st.sampled_from([0, 1, 2, 5, 30, 60])
PARAMETERS = [
    MergingParameters(),
    MergingParameters(max_step=0.25, max_shift=0.0),
    MergingParameters(balance=CostWeights(parallelism=0.5, collinearity=1.0, proximity=0.0)),
    MergingParameters(max_cost=2.0, max_step=1.0, max_gap=1.5, direction_tolerance=0.4),
]


def compiled(name: str) -> Any:  # noqa: ANN401
    assert COMPILED is not None
    return getattr(COMPILED, name)


def walls_seen(rng: Generator, count: int, noises: tuple[float, ...] = (0.02, 0.2)) -> FloatArray:
    """Return (count, 4) noisy parts [m] of walls in three directions, many on each other."""
    angle = rng.choice([0.3, 0.3 + np.pi / 2, 0.8], count)
    middle = rng.integers(0, 3, (count, 2)) * rng.choice([0.1, 1.5])
    along = rng.choice([0.2, 1.0, 6.0], (count, 1)) / 2
    half = along * np.column_stack([np.cos(angle), np.sin(angle)])
    noise = rng.normal(0, rng.choice(noises), (count, 4))
    return np.hstack([middle - half, middle + half]) + noise


def assert_same(one: Any, other: NumpyEvolvingMap) -> None:  # noqa: ANN401
    np.testing.assert_allclose(one.segments(), other.segments(), rtol=0, atol=1e-9)
    np.testing.assert_allclose(one.weights(), other.weights(), rtol=1e-12)
    np.testing.assert_array_equal(one.numbers(), other.numbers())
    np.testing.assert_array_equal(one.labels(), other.labels())


@settings(max_examples=60, deadline=None)
@given(seeds, sizes, st.sampled_from([0.0, 0.5, 1.0]), st.sampled_from(PARAMETERS))
def test_the_same_segments_evolve_into_the_same(
    seed: int, count: int, settled: float, parameters: MergingParameters
) -> None:
    rng = np.random.default_rng(seed)
    segments, weights = walls_seen(rng, count), rng.uniform(0.1, 100.0, count)
    one = compiled("EvolvingMap")(parameters.rules, segments, weights)
    other = NumpyEvolvingMap(parameters.rules, segments, weights)
    one.simplify(int(settled * count))
    other.simplify(int(settled * count))
    assert_same(one, other)


@settings(max_examples=30, deadline=None)
@given(seeds, st.integers(1, 8), st.sampled_from(PARAMETERS))
def test_the_same_scans_make_the_same_map(
    seed: int, scans: int, parameters: MergingParameters
) -> None:
    rng = np.random.default_rng(seed)
    known = walls_seen(rng, 4)
    one = compiled("EvolvingMap")(parameters.rules, known, np.ones(4))
    other = NumpyEvolvingMap(parameters.rules, known, np.ones(4))
    for _ in range(scans):
        segments, scan = walls_seen(rng, int(rng.integers(0, 20))), int(rng.integers(0, 99))
        one.merge_scan(segments, scan)
        other.merge_scan(segments, scan)
        assert_same(one, other)
        owner = numpy_sliver_owners(other.segments(), 0.4, 0.15, 2.0)
        for ours, theirs in zip(one.seen(owner), other.seen(owner), strict=True):
            np.testing.assert_array_equal(ours, theirs)


def test_equal_segments_evolve_into_one() -> None:
    segments = np.tile([[1.0, 2.0, 4.0, 3.0]], (300, 1))
    for kind in (compiled("EvolvingMap"), NumpyEvolvingMap):
        evolving = kind(MergingParameters().rules, segments, np.ones(300))
        evolving.simplify()
        np.testing.assert_allclose(evolving.segments(), segments[:1], atol=1e-9)
        assert evolving.weights().tolist() == [pytest.approx(300)]
        assert not evolving.labels().any()


def test_a_wall_that_thousands_saw_is_one_segment() -> None:
    rng = np.random.default_rng(3)
    ends = np.sort(rng.uniform(0, 10, (3000, 2)), axis=1)
    segments = np.column_stack([ends[:, 0], np.zeros(3000), ends[:, 1] + 0.3, np.zeros(3000)])
    segments += rng.normal(0, 0.02, segments.shape)
    lengths = np.hypot(*(segments[:, 2:] - segments[:, :2]).T)
    evolving = compiled("EvolvingMap")(MergingParameters().rules, segments, lengths)
    evolving.simplify()
    np.testing.assert_allclose(evolving.segments(), [[0, 0, 10.3, 0]], atol=0.06)
    assert evolving.weights()[0] == pytest.approx(lengths.sum())


@settings(max_examples=80, deadline=None)
@given(seeds, sizes, st.sampled_from([8, 45, 180]), st.floats(0.01, 0.2))
def test_main_directions_are_the_same(seed: int, count: int, bins: int, smoothing: float) -> None:
    rng = np.random.default_rng(seed)
    segments, weights = walls_seen(rng, count, (0.0, 0.02)), rng.uniform(0, 9, count)
    rules = MergingParameters().directions.model_copy(
        update={"bins": bins, "smoothing": smoothing, "significance": 1.5}
    )
    one = compiled("main_directions")(segments, weights, rules.rules)
    np.testing.assert_allclose(
        one, numpy_main_directions(segments, weights, rules.rules), atol=1e-9
    )


@settings(max_examples=60, deadline=None)
@given(seeds, sizes)
def test_slivers_have_the_same_owners(seed: int, count: int) -> None:
    segments = walls_seen(np.random.default_rng(seed), count)
    one = compiled("sliver_owners")(segments, 0.4, 0.15, 2.0)
    np.testing.assert_array_equal(one, numpy_sliver_owners(segments, 0.4, 0.15, 2.0))


@settings(max_examples=100, deadline=None)
@given(seeds, sizes, st.sampled_from([0.3, 1.0, 3.0]))
def test_polylines_are_the_same(seed: int, count: int, max_gap: float) -> None:
    rng = np.random.default_rng(seed)
    start = rng.uniform(0, np.sqrt(count + 1), (count, 2))
    segments = np.hstack([start, start + rng.normal(0, 0.5, (count, 2))])
    one = compiled("group_polylines")(segments, max_gap)
    for ours, theirs in zip(one, numpy_group_polylines(segments, max_gap), strict=True):
        np.testing.assert_array_equal(ours, theirs)


def added(kind: Any, rng: Generator) -> Any:  # noqa: ANN401
    """Return witnesses from different places, the last of them added late."""
    witnesses = kind(0.1, 0.3, 0.26, 0.8)
    for scan in (3, 4, 6, 5):
        clear = rng.uniform(0.5, 9.0) * np.ones(90) - rng.uniform(0, 0.4, 90)
        step = float(rng.choice([np.pi / 90, np.pi / 45]))
        witnesses.add(scan, clear, -1.5, step, rng.uniform(-2, 2, 3))
    return witnesses


@settings(max_examples=60, deadline=None)
@given(seeds, sizes)
def test_as_many_scans_see_through_each_segment(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    segments, last = walls_seen(rng, count), rng.integers(-1, 7, count)
    one, other = (
        added(compiled("Witnesses"), np.random.default_rng(seed)),
        added(NumpyWitnesses, np.random.default_rng(seed)),
    )
    np.testing.assert_array_equal(one.count(segments, last), other.count(segments, last))


@settings(max_examples=30, deadline=None)
@given(seeds)
def test_what_is_known_of_a_segment_is_what_would_be_found_again(seed: int) -> None:
    rng = np.random.default_rng(seed)
    segments = walls_seen(rng, 40)
    witnesses = added(compiled("Witnesses"), rng)
    for _ in range(5):
        numbers: IntArray = np.sort(rng.choice(40, int(rng.integers(0, 40)), replace=False))
        last = rng.integers(-1, 7, len(numbers))
        found = witnesses.count_numbered(numbers, segments[numbers], last)
        np.testing.assert_array_equal(found, witnesses.count(segments[numbers], last))
        witnesses.add(7, rng.uniform(1, 9, 90), -1.5, np.pi / 90, rng.uniform(-2, 2, 3))


@pytest.mark.parametrize("kind", ["compiled", "twin"])
def test_what_does_not_fit_is_refused(kind: str) -> None:
    rules, good = MergingParameters().rules, np.zeros((2, 4))
    evolving = compiled("EvolvingMap") if kind == "compiled" else NumpyEvolvingMap
    with pytest.raises(ValueError, match="weights"):
        evolving(rules, good, np.ones(3))
    with pytest.raises(ValueError, match="segments"):
        evolving(rules, np.full((1, 4), np.nan), np.ones(1))
    with pytest.raises(ValueError, match="scan"):
        evolving(rules, good, np.ones(2)).merge_scan(good, -1)
    with pytest.raises(ValueError, match="owner"):
        evolving(rules, good, np.ones(2)).seen(np.array([0, 2]))
    witnesses = (compiled("Witnesses") if kind == "compiled" else NumpyWitnesses)(0.1, 0.3, 0.2, 1)
    with pytest.raises(ValueError, match="last_seen"):
        witnesses.count(good, np.zeros(1, dtype=np.int64))
    with pytest.raises(ValueError, match="numbers"):
        witnesses.count_numbered(np.array([1, 0]), good, np.zeros(2, dtype=np.int64))


@settings(max_examples=40, deadline=None)
@given(seeds, sizes, st.sampled_from([8, 180, 360]), st.sampled_from([np.pi, 2 * np.pi]))
def test_histograms_of_directions_are_the_same(
    seed: int, count: int, bins: int, period: float
) -> None:
    rng = np.random.default_rng(seed)
    segments, weights = walls_seen(rng, count)[:, [2, 3, 0, 1]], rng.uniform(0, 3, count)
    asked = segments, weights, bins, period, 0.03
    np.testing.assert_allclose(
        direction_histogram(*asked), direction_histogram_numpy(*asked), atol=1e-9
    )


@settings(max_examples=40, deadline=None)
@given(seeds, st.sampled_from([0, 1, 30]), st.sampled_from([0.0, 0.15]), st.integers(0, 16))
def test_the_same_turns_are_likely(seed: int, count: int, least: float, most: int) -> None:
    rng = np.random.default_rng(seed)
    ours, theirs = np.zeros((2, 360))
    ours[rng.integers(0, 360, count)] = theirs[rng.integers(0, 360, count)] = (
        1.0  # whole: exact, equals among them
    )
    ours, theirs = ours + rng.choice([0.0, 1.0]), theirs.cumsum()
    asked = ours, theirs, most, 0.17, least
    np.testing.assert_allclose(likely_turns(*asked), likely_turns_numpy(*asked), atol=1e-9)


@settings(max_examples=40, deadline=None)
@given(seeds, sizes, st.sampled_from([1e-6, 0.3, 2.0]))
def test_points_are_paired_with_those_within_reach(seed: int, count: int, reach: float) -> None:
    ends = walls_seen(np.random.default_rng(seed), count).reshape(-1, 2)
    first, second = ends[::2], np.vstack([ends[::2], ends[1::2]])
    apart = np.hypot(*(first[:, None] - second).T).T.reshape(len(first), len(second))
    found = near_points(first, second, reach)
    np.testing.assert_array_equal(np.stack(found), np.stack(np.nonzero(apart <= reach)))


@settings(max_examples=40, deadline=None)
@given(seeds, sizes, st.sampled_from([0.07, 0.5, 20.0]))
def test_lines_have_the_same_samples(seed: int, count: int, spacing: float) -> None:
    walls = walls_seen(np.random.default_rng(seed), count)
    found = sample_lines(walls, spacing), sample_lines_numpy(walls, spacing)
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-12)


@settings(max_examples=40, deadline=None)
@given(seeds, sizes, st.sampled_from([0.07, 0.5, 20.0]))
def test_parts_of_lines_have_the_same_middles(seed: int, count: int, spacing: float) -> None:
    walls = walls_seen(np.random.default_rng(seed), count)
    found = sample_parts(walls, spacing), sample_parts_numpy(walls, spacing)
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-12)


def test_samples_stand_for_equal_parts_that_add_up_to_the_line() -> None:
    lines = np.array([[0.0, 0, 3, 4], [2, 0, 2, -1], [1, 1, 1, 1]])
    found = sample_parts(lines, 2.0)
    assert found.owner.tolist() == [0, 0, 0, 1, 2]
    np.testing.assert_allclose(found.lengths, [5 / 3] * 3 + [1, 0])
    np.testing.assert_allclose(found.points[1], [1.5, 2])
    np.testing.assert_array_equal(found.directions[3:], [[0, -1], [0, 0]])


def test_lines_that_are_not_finite_are_refused() -> None:
    with pytest.raises(ValueError, match="finite"):
        sample_lines(np.full((1, 4), np.nan), 0.1)
    with pytest.raises(ValueError, match="finite"):
        sample_parts(np.array([[0.0, 0, np.inf, 0]]), 0.1)
