"""What is rare proves more; an end of a wall counts once, whoever drew it how often."""

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.shape.background import Counts, Shares, load_background, save_background
from mapweave.shape.rarity import (
    RarityParameters,
    WallEnds,
    count_words,
    rarity,
    shared_ends,
    wall_ends,
)

P = RarityParameters()
UNKNOWN = Shares.mean([], P.bins)
MOST = -np.log2(UNKNOWN.share[0])  # [bits] of a word that nobody ever saw


def walls(rng: Generator, count: int = 12) -> FloatArray:
    """Return walls a good way apart from each other, in any direction."""
    starts = rng.permutation(np.stack(np.meshgrid(range(4), range(4)), -1).reshape(-1, 2))[:count]
    angle, length = rng.uniform(-np.pi, np.pi, count), rng.uniform(0.6, 1.2, count)
    steps = length[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    return np.hstack([3.0 * starts, 3.0 * starts + steps])


def bits(segments: FloatArray, shares: Shares = UNKNOWN, own: Counts | None = None) -> float:
    return rarity(wall_ends(segments, P), shares, own or Counts.none(), P)


@pytest.mark.parametrize("seed", range(5))
def test_words_nobody_ever_saw_are_worth_the_same_each_and_an_end_counts_once(seed: int) -> None:
    segments = walls(np.random.default_rng(seed), 6)
    assert bits(segments) == pytest.approx((2 * 6 - 1) * MOST)


@pytest.mark.parametrize("seed", range(5))
def test_a_map_that_is_drawn_twice_has_no_more_ends_than_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    segments = walls(rng)
    again = segments + rng.uniform(-0.05, 0.05, segments.shape)
    assert len(wall_ends(np.vstack([segments, again]), P).points) == 2 * len(segments)


def test_ends_are_those_of_long_walls_the_longest_first_and_know_where_a_wall_begins() -> None:
    ends = wall_ends(np.array([[0.0, 0, 1, 0], [5, 0, 5, 2], [9, 9, 9.4, 9]]), P)
    np.testing.assert_array_equal(ends.points, [[5, 0], [5, 2], [0, 0], [1, 0]])
    np.testing.assert_array_equal(ends.kind, [0, 1, 0, 1])
    np.testing.assert_allclose(ends.direction, [np.pi / 2, np.pi / 2, 0, 0])


@pytest.mark.parametrize("seed", range(5))
def test_all_ends_are_shared_by_a_map_that_was_moved_and_is_moved_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    segments, pose = walls(rng), rng.uniform(-3, 3, 3)
    moved = wall_ends(se2.transform_segments(pose, segments), P)
    assert len(shared_ends(wall_ends(segments, P), moved, se2.inverse(pose), P).points) == 24


def test_an_end_is_not_shared_where_a_wall_begins_runs_otherwise_or_ends_elsewhere() -> None:
    one = np.array([[0.0, 0, 3, 0]])
    for other, count in (
        ([[0, 0, 3, 0]], 2),
        ([[3, 0, 0, 0]], 0),
        ([[0, 0, 0, 3]], 0),
        ([[0.2, 0, 3.3, 0]], 1),
    ):
        ends = wall_ends(one, P), wall_ends(np.array(other, dtype=float), P)
        assert len(shared_ends(*ends, np.zeros(3), P).points) == count


@pytest.mark.parametrize("seed", range(5))
def test_words_stay_the_same_wherever_a_map_is_and_whichever_end_comes_first(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ends = wall_ends(walls(rng), P)
    order = rng.permutation(len(ends.points))
    pose = np.array([*rng.uniform(-9, 9, 2), 0.0])
    moved = WallEnds(se2.transform_points(pose, ends.points), ends.direction, ends.kind).at(order)
    ours, theirs = count_words(ends, P), count_words(moved, P)
    np.testing.assert_array_equal(ours.words, theirs.words)
    np.testing.assert_array_equal(ours.count, theirs.count)


def test_what_a_building_is_full_of_proves_less_than_what_it_never_saw() -> None:
    segments = walls(np.random.default_rng(1), 6)
    full = Shares.mean([count_words(wall_ends(segments, P), P)], P.bins)
    assert bits(segments, full) < 0.5 * bits(segments)


def test_what_repeats_in_the_maps_themselves_proves_less_but_not_for_being_in_both() -> None:
    segments = walls(np.random.default_rng(2), 6)
    words = count_words(wall_ends(segments, P), P)
    assert bits(segments, own=words.plus(words)) == bits(segments)
    repeated = words
    for _ in range(9):
        repeated = repeated.plus(words)
    assert bits(segments, own=repeated) < 0.5 * bits(segments)


@pytest.mark.parametrize("seed", range(5))
def test_of_all_ways_to_tell_ends_one_by_another_the_commonest_counts(seed: int) -> None:
    """Against all trees grown edge by edge, the cheapest first."""
    rng = np.random.default_rng(seed)
    ends = wall_ends(walls(rng, 5), P)
    share = rng.uniform(1e-6, 1.0, P.bins)
    edges = []
    for i, j in combinations(range(10), 2):
        pair = count_words(ends.at(np.array([i, j])), P)
        edges += [(float(-np.log2(share[w])), i, j) for w in pair.words.tolist()]
    group, total = list(range(10)), 0.0
    for cost, i, j in sorted(edges):
        if group[i] != group[j]:
            total += cost
            group = [group[i] if g == group[j] else g for g in group]
    assert rarity(ends, Shares(share), Counts.none(), P) == pytest.approx(total)


def test_ends_too_far_apart_to_be_told_by_each_other_prove_nothing_of_each_other() -> None:
    segments = np.array([[0.0, 0, 1, 0], [100, 0, 101, 0]])
    assert bits(segments) == pytest.approx(2 * MOST)
    assert bits(np.array([[0.0, 0, 20, 0]])) == bits(np.empty((0, 4))) == 0.0


def test_a_background_comes_back_from_its_file(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    known = {name: count_words(wall_ends(walls(rng), P), P) for name in ("one", "another")}
    file = tmp_path / "background.npz"
    save_background(known, file)
    found = load_background(file)
    assert set(found) == set(known)
    for name, counts in known.items():
        np.testing.assert_array_equal(found[name].words, counts.words)
        np.testing.assert_array_equal(found[name].count, counts.count)


def test_the_background_holds_counts_of_words_and_nothing_else() -> None:
    for counts in load_background().values():
        assert counts.words.min() >= 0
        assert counts.words.max() < P.bins
        assert np.all(np.diff(counts.words) > 0) and np.all(counts.count > 0)
