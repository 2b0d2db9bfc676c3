"""What merging must not depend on: the frame, the scale, the order, and how a wall was cut up."""

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.lines.merging import evolve, merge_scan
from mapweave.lines.merging_cost import merge_cost, merged_segment

METRES = st.floats(-10, 10)
SEGMENTS = st.tuples(METRES, METRES, METRES, METRES).map(lambda ends: np.array([ends]))
MOTIONS = st.tuples(METRES, METRES, st.floats(-3, 3)).map(np.array)
SEEDS = st.integers(0, 2**32 - 1)
SOME = settings(max_examples=25)  # an evolution takes tens of milliseconds


def lengths_of(segments: FloatArray) -> FloatArray:
    return np.asarray(np.hypot(*(segments[:, 2:] - segments[:, :2]).T))


def assume_directions(first: FloatArray, second: FloatArray) -> None:
    """Leave out points, and pairs so square to each other that rounding decides how they face."""
    u, v = (s[0, 2:] - s[0, :2] for s in (first, second))
    assume(min(np.hypot(*u), np.hypot(*v)) > 0.05)
    assume(abs(u @ v) > 1e-3 * np.hypot(*u) * np.hypot(*v))


def sightings(seed: int) -> FloatArray:
    """Return what four noisy scans saw of three walls: some 30 segments in no special position."""
    rng = np.random.default_rng(seed)
    walls = np.array([[0.0, 0, 6, 0], [6, 0, 6, 4], [2, 3, -1, 5]])[rng.integers(0, 3, 30)]
    low = rng.uniform(0, 0.8, 30)
    high = rng.uniform(low + 0.1, 1)  # long enough to tell how they are directed
    along = walls[:, 2:] - walls[:, :2]
    ends = [walls[:, :2] + share[:, None] * along for share in (low, high)]
    return np.hstack(ends) + rng.normal(0, 0.02, (30, 4))


def as_set(segments: FloatArray) -> FloatArray:
    """Return the rows in an order of their own, for comparing."""
    return segments[np.lexsort(np.round(segments, 6).T)]


@given(SEGMENTS, SEGMENTS, MOTIONS)
def test_a_rigid_motion_changes_no_cost_and_takes_the_merged_segment_along(
    first: FloatArray, second: FloatArray, motion: FloatArray
) -> None:
    assume_directions(first, second)
    moved = [se2.transform_segments(motion, segment) for segment in (first, second)]
    np.testing.assert_allclose(merge_cost(*moved), merge_cost(first, second), rtol=1e-6, atol=1e-9)
    there = se2.transform_segments(motion, merged_segment(first, second))
    np.testing.assert_allclose(merged_segment(*moved), there, atol=1e-6)


@given(SEGMENTS, SEGMENTS, st.floats(0.1, 10))
def test_costs_are_lengths_so_they_grow_with_the_scale(
    first: FloatArray, second: FloatArray, scale: float
) -> None:
    assume_directions(first, second)
    larger = merge_cost(scale * first, scale * second)
    np.testing.assert_allclose(larger, scale * merge_cost(first, second), rtol=1e-6, atol=1e-9)


@given(SEGMENTS, SEGMENTS)
def test_costs_are_never_negative_and_the_same_for_both(
    first: FloatArray, second: FloatArray
) -> None:
    assume_directions(first, second)
    cost = merge_cost(first, second)
    assert (cost >= 0).all()
    np.testing.assert_allclose(merge_cost(second, first), cost, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(
        merge_cost(first, second[:, [2, 3, 0, 1]]), cost, rtol=1e-6, atol=1e-9
    )


@given(SEGMENTS, SEGMENTS, st.floats(0.1, 100), st.floats(0.1, 100))
def test_the_heavier_of_two_moves_less_in_the_inverse_ratio_of_the_weights(
    first: FloatArray, second: FloatArray, heavy: float, light: float
) -> None:
    """d1 w1 = d2 w2 (paper, VII): how far the midpoints lie from the merged line."""
    assume_directions(first, second)
    merged = merged_segment(first, second, first_weight=heavy, second_weight=light)
    assume(lengths_of(merged)[0] > 0.05)
    along = (merged[0, 2:] - merged[0, :2]) / lengths_of(merged)[0]
    normal = np.array([-along[1], along[0]])
    away = [((s[0, :2] + s[0, 2:]) / 2 - merged[0, :2]) @ normal for s in (first, second)]
    np.testing.assert_allclose(away[0] * heavy, -away[1] * light, atol=1e-6)


@SOME
@given(SEEDS, st.permutations(range(30)))
def test_what_evolves_does_not_depend_on_the_order_of_the_sightings(
    seed: int, order: list[int]
) -> None:
    segments = sightings(seed)
    here, there = evolve(segments), evolve(segments[order])
    np.testing.assert_allclose(as_set(there.segments), as_set(here.segments), atol=1e-6)
    same = here.labels[:, None] == here.labels
    np.testing.assert_array_equal(there.labels[:, None] == there.labels, same[np.ix_(order, order)])


@SOME
@given(SEEDS, METRES, METRES, st.integers(0, 3))
def test_what_evolves_moves_with_the_sightings(seed: int, x: float, y: float, turns: int) -> None:
    """By whole quarter turns, which the histogram of directions does not tell apart."""
    motion = np.array([x, y, turns * np.pi / 2])
    here = evolve(sightings(seed)).segments
    there = evolve(se2.transform_segments(motion, sightings(seed))).segments
    moved = se2.transform_segments(motion, here)
    assert len(there) == len(moved)
    off = np.abs(there[:, None] - moved).max(axis=-1)
    assert off.min(axis=1).max() < 1e-6


@SOME
@given(SEEDS)
def test_nothing_that_was_seen_is_lost_or_counted_twice(seed: int) -> None:
    segments = sightings(seed)
    evolution = evolve(segments)
    total = np.bincount(evolution.labels, lengths_of(segments), len(evolution.segments))
    np.testing.assert_allclose(evolution.weights, total)


@SOME
@given(SEEDS, st.integers(1, 29))
def test_scan_by_scan_nothing_is_lost_either(seed: int, cut: int) -> None:
    segments = sightings(seed)
    known = evolve(segments[:cut])
    evolution = merge_scan(known.segments, known.weights, segments[cut:])
    mass = np.concatenate([known.weights, lengths_of(segments[cut:])])
    total = np.bincount(evolution.labels, mass, len(evolution.segments))
    np.testing.assert_allclose(evolution.weights, total)


@SOME
@given(SEEDS)
def test_no_two_that_face_each_other_are_merged(seed: int) -> None:
    """The walls seen from inside and from outside: twice as many segments, in pairs."""
    inside = sightings(seed)
    both = np.vstack([inside, inside[:, [2, 3, 0, 1]]])
    labels = evolve(both).labels
    assert not set(labels[: len(inside)]) & set(labels[len(inside) :])
