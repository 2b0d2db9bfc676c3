"""The most probable explanation of all alignments: majority and confidence, weighed by a model."""

import math
from collections.abc import Iterable, Sequence
from itertools import combinations, product

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.team.consistency import ConsistencyParameters, explain
from mapweave.team.cycles import CycleParameters, Edge, bad_cycles
from mapweave.team.inliers import component_confidence, rely
from mapweave.team.min_cut import groups
from tests.mapweave.buildings import random_pose

P = ConsistencyParameters()
CHANCE = P.chance
AWAY = np.array([6.0, -4.0, 1.0])


def poses_of(count: int, seed: int = 1) -> FloatArray:
    rng = np.random.default_rng(seed)
    return np.array([random_pose(rng) for _ in range(count)])


def edge(poses: FloatArray, first: int, second: int, confidence: float = 0.9) -> Edge:
    return Edge(first, second, se2.between(poses[first], poses[second]), confidence)


def wrong(poses: FloatArray, first: int, second: int, confidence: float = 0.99) -> Edge:
    right = edge(poses, first, second)
    return Edge(first, second, se2.compose(right.transform, AWAY), confidence)


def ring(count: int, confidence: float = 0.9) -> list[Edge]:
    poses = poses_of(count)
    return [edge(poses, k, (k + 1) % count, confidence) for k in range(count)]


def agree(count: int, edges: Sequence[Edge], right: Iterable[int]) -> bool:
    removed = sum(1 << k for k in range(len(edges)) if k not in set(right))
    return not bad_cycles(count, edges, removed, P.cycles)


def weight(count: int, edges: Sequence[Edge], right: Sequence[int]) -> float:
    """Return the probability of an explanation, but for a factor: the model, written down."""
    cycles = len(right) - count + len(groups(count, edges, right))
    odds = [math.exp(P.log_odds(edges[k].confidence)) for k in right]
    return float(np.prod(odds)) / CHANCE**cycles


def all_explanations(count: int, edges: Sequence[Edge]) -> list[tuple[float, frozenset[int]]]:
    """Return every choice of edges that agree, the most probable first: by brute force."""
    found = [
        (weight(count, edges, right), frozenset(right))
        for size in range(len(edges) + 1)
        for right in combinations(range(len(edges)), size)
        if agree(count, edges, right)
    ]
    return sorted(found, key=lambda item: -item[0])


def random_graph(rng: Generator, wrong_ones: int) -> tuple[int, list[Edge]]:
    count = int(rng.integers(3, 6))
    poses = poses_of(count, int(rng.integers(1000)))
    pairs = [pair for pair in combinations(range(count), 2) if rng.random() < 0.8]
    picked = set(rng.permutation(len(pairs))[:wrong_ones])
    edges = []
    for k, pair in enumerate(pairs):
        confidence = float(rng.uniform(0.6, 0.98))
        good = edge(poses, *pair, confidence)
        off = np.array([*rng.uniform(3, 9, 2), rng.uniform(0.3, 3)])
        edges.append(
            Edge(*pair, se2.compose(good.transform, off), confidence) if k in picked else good
        )
    return count, edges


@pytest.mark.parametrize("seed", range(12))
def test_the_first_explanation_is_the_most_probable_of_all_there_are(seed: int) -> None:
    count, edges = random_graph(np.random.default_rng(seed), seed % 4)
    found = explain(count, edges, P)
    best, right = all_explanations(count, edges)[0]
    assert weight(count, edges, sorted(found[0].right)) == pytest.approx(best)
    assert found[0].right == right


@pytest.mark.parametrize("seed", range(12))
def test_explanations_weigh_what_the_model_says_and_none_could_hold_more(seed: int) -> None:
    count, edges = random_graph(np.random.default_rng(seed), 1 + seed % 3)
    found = explain(count, edges, P)
    heaviest = weight(count, edges, sorted(found[0].right))
    for one in found:
        ours = weight(count, edges, sorted(one.right))
        assert one.weight == pytest.approx(ours / heaviest)
        more = [k for k in range(len(edges)) if k not in one.right]
        assert not any(agree(count, edges, [*one.right, k]) for k in more)


def test_where_all_agree_there_is_one_explanation() -> None:
    (only,) = explain(6, ring(6), P)
    assert only.right == frozenset(range(6))


def test_the_surest_alignment_goes_when_a_cycle_agrees_without_it() -> None:
    poses = poses_of(4)
    edges = [*ring(4, 0.7), wrong(poses, 0, 2, 0.999)]
    explanations = explain(4, edges, P)
    assert explanations[0].right == frozenset(range(4))
    assert rely(4, edges, explanations) == frozenset(range(4))


def test_one_cycle_alone_leaves_it_to_the_confidences() -> None:
    poses = poses_of(3)
    edges = [edge(poses, 0, 1, 0.95), edge(poses, 1, 2, 0.95), wrong(poses, 0, 2, 0.7)]
    explanations = explain(3, edges, P)
    assert {e.right for e in explanations} == {frozenset(pair) for pair in [(0, 1), (0, 2), (1, 2)]}
    right = rely(3, edges, explanations)
    assert right == {0, 1}
    # Odds 19, 19 and 7/3: the other two explanations, and that one of the two is wrong.
    other = (7 / 3) / 19
    expected = 1 / (1 + 2 * other + 1 / 19)
    assert component_confidence([0, 1, 2], 3, edges, right, explanations, P) == pytest.approx(
        expected
    )


def test_nothing_is_relied_on_that_is_more_probably_wrong_than_right() -> None:
    """Three alike that contradict each other: two of them would be right in a third of cases."""
    poses = poses_of(3)
    edges = [edge(poses, 0, 1), edge(poses, 1, 2), wrong(poses, 0, 2, 0.9)]
    explanations = explain(3, edges, P)
    right = rely(3, edges, explanations)
    assert len(right) == 1
    (kept,) = right
    group = sorted((edges[kept].first, edges[kept].second))
    sure = component_confidence(group, 3, edges, right, explanations, P)
    assert sure == pytest.approx(1 / (1 + 1 / 2 + 1 / 9))
    assert sure < 0.9


def test_two_alignments_of_one_pair_that_differ_leave_the_surer() -> None:
    poses = poses_of(2)
    edges = [edge(poses, 0, 1, 0.9), wrong(poses, 0, 1, 0.6)]
    assert rely(2, edges, explain(2, edges, P)) == {0}


def test_two_wrong_ones_that_agree_lose_to_more_cycles_without_them() -> None:
    """Robot 0 placed wrongly by two look-alikes in the same way, and rightly by three others."""
    poses = poses_of(6)
    among_others = [edge(poses, a, b) for a, b in combinations(range(1, 6), 2)]
    elsewhere = poses.copy()
    elsewhere[0] = se2.compose(poses[0], AWAY)
    look_alikes = [edge(elsewhere, 0, k, 0.99) for k in (1, 2)]
    rightly = [edge(poses, 0, k, 0.8) for k in (3, 4, 5)]
    edges = [*among_others, *look_alikes, *rightly]
    right = rely(6, edges, explain(6, edges, P))
    assert right == set(range(15)) - {10, 11}


@pytest.mark.parametrize("confidences", list(product([0.6, 0.9], [0.8, 0.99])))
def test_a_chain_is_as_sure_as_its_weakest_alignment(confidences: tuple[float, ...]) -> None:
    poses = poses_of(3)
    edges = [edge(poses, k, k + 1, c) for k, c in enumerate(confidences)]
    explanations = explain(3, edges, P)
    sure = component_confidence([0, 1, 2], 3, edges, frozenset({0, 1}), explanations, P)
    assert sure == pytest.approx(min(confidences))


def test_a_cycle_is_as_sure_as_its_two_weakest_and_their_agreement() -> None:
    poses = poses_of(4)
    edges = [edge(poses, k, (k + 1) % 4, c) for k, c in enumerate([0.9, 0.7, 0.95, 0.8])]
    explanations = explain(4, edges, P)
    sure = component_confidence(range(4), 4, edges, frozenset(range(4)), explanations, P)
    odds = (0.7 / 0.3) * (0.8 / 0.2) / CHANCE
    assert sure == pytest.approx(odds / (1 + odds))


def test_a_further_alignment_that_agrees_never_makes_less_sure(rng: Generator) -> None:
    for _ in range(20):
        count, edges = random_graph(rng, 0)
        for some in range(1, len(edges)):
            before, after = edges[:some], edges[: some + 1]
            whole = list(range(count))
            if whole in groups(count, before, range(some)):
                sure = [
                    component_confidence(
                        whole, count, e, frozenset(range(len(e))), explain(count, e, P), P
                    )
                    for e in (before, after)
                ]
                assert sure[1] >= sure[0] - 1e-9


def test_too_many_contradictions_are_still_resolved_into_some_that_agree(rng: Generator) -> None:
    """All edges among 7 nodes at random: nothing agrees with anything."""
    edges = [Edge(a, b, random_pose(rng), 0.9) for a, b in combinations(range(7), 2)]
    (found,) = explain(7, edges, P.model_copy(update={"max_tries": 20}))
    assert agree(7, edges, found.right)
    assert groups(7, edges, found.right) == [list(range(7))]


@pytest.mark.parametrize("tries", [1, P.max_tries])
@pytest.mark.parametrize(("doubt", "right"), [(1.0, {0, 1, 2}), (3.0, {0, 2})])
def test_what_is_doubted_goes_when_that_is_the_more_probable(
    tries: int, doubt: float, right: set[int]
) -> None:
    """A chain of odds 19, 4 and 9, whose first two together are doubted: also without a search."""
    poses = poses_of(4)
    edges = [edge(poses, k, k + 1, c) for k, c in enumerate([0.95, 0.8, 0.9])]

    def contradictions(removed: int, /) -> tuple[float, int]:
        return (0.0, 0) if removed & 3 else (doubt, 3)

    p = P.model_copy(update={"max_tries": tries})
    assert explain(4, edges, p, contradictions)[0].right == right


def test_errors_add_up_along_a_cycle_as_their_squares_do() -> None:
    p = CycleParameters()
    for count in (3, 12):
        most = p.max_distance * math.sqrt(count / 3)
        poses = np.column_stack([np.arange(count, dtype=float), np.zeros((count, 2))])
        for share, bad in ((0.99, []), (1.01, [(1 << count) - 1])):
            edges = [edge(poses, k, (k + 1) % count) for k in range(count)]
            shift = np.array([0, share * most, 0])
            edges[0] = Edge(0, 1, se2.compose(edges[0].transform, shift), 0.9)
            assert bad_cycles(count, edges, 0, p) == bad
