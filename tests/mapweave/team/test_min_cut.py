"""The weakest cut, against every cut there is."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.team.cycles import Edge
from mapweave.team.min_cut import groups, weakest_cut, weakest_cut_of_all


def random_graph(rng: Generator) -> tuple[list[Edge], dict[int, float]]:
    """Return edges between nodes 3 to 7 that hang together, and their strengths."""
    pairs = [(k, k + 1) for k in range(3, 7)]
    pairs += [pair for pair in combinations(range(3, 8), 2) if rng.random() < 0.4]
    edges = [Edge(a, b, np.zeros(3), 0.9) for a, b in pairs]
    return edges, {k: float(rng.uniform(0.1, 9)) for k in range(len(edges))}


def strength_of(side: Sequence[int], edges: Sequence[Edge], strengths: dict[int, float]) -> float:
    return sum(
        v for k, v in strengths.items() if (edges[k].first in side) != (edges[k].second in side)
    )


@pytest.mark.parametrize("seed", range(10))
def test_no_cut_is_weaker_than_the_weakest(seed: int) -> None:
    edges, strengths = random_graph(np.random.default_rng(seed))
    nodes = range(3, 8)
    sides = [side for size in range(1, 5) for side in combinations(nodes, size)]
    between = [side for side in sides if 3 in side and 6 not in side]
    least = min(strength_of(side, edges, strengths) for side in between)
    cut = weakest_cut(nodes, edges, strengths, 3, 6)
    assert cut.strength == pytest.approx(least, abs=0.01)  # flows are whole thousandths
    assert cut.parts(3, 6)
    assert strength_of(list(cut.side), edges, strengths) == pytest.approx(cut.strength)
    least_of_all = min(strength_of(side, edges, strengths) for side in sides)
    assert weakest_cut_of_all(nodes, edges, strengths) == pytest.approx(least_of_all)


def test_groups_are_what_hangs_together() -> None:
    edges = [Edge(a, b, np.zeros(3), 0.9) for a, b in [(0, 2), (3, 1), (2, 4)]]
    assert groups(6, edges, range(3)) == [[0, 2, 4], [1, 3], [5]]
    assert groups(6, edges, [1]) == [[0], [1, 3], [2], [4], [5]]
    assert groups(2, [], []) == [[0], [1]]
