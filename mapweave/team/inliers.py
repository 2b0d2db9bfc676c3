"""Which alignments to rely on, given the explanations of them all, and how sure a component is."""

import math
from collections.abc import Iterable, Sequence

from mapweave.team.consistency import ConsistencyParameters, ConsistentSet
from mapweave.team.cycles import Edge
from mapweave.team.min_cut import Union, groups, weakest_cut_of_all

CERTAIN = 1e-6  # least doubt in an alignment that is counted
MAX_UNDECIDED = 0.5 + 1e-6  # an even chance, rounding included, decides nothing


def rely(
    count: int, edges: Sequence[Edge], explanations: Sequence[ConsistentSet]
) -> frozenset[int]:
    """Return the edges of the most probable explanation, less those that nothing decides about.

    A group of nodes that holds together rightly in half of what may be, or less, loses the edge
    that is right in the least part of it, until what is left is more probably right than wrong.
    """
    right = set(explanations[0].right)
    while True:
        doubtful = [
            group
            for group in groups(count, edges, right)
            if _share(group, count, edges, right, explanations) <= MAX_UNDECIDED
        ]
        if not doubtful:
            return frozenset(right)
        for group in doubtful:
            inside = [k for k in right if edges[k].first in group]
            right.remove(min(inside, key=lambda k: (part_right(k, explanations), k)))


def component_confidence(
    group: Sequence[int],
    count: int,
    edges: Sequence[Edge],
    right: frozenset[int],
    explanations: Sequence[ConsistentSet],
    parameters: ConsistencyParameters,
) -> float:
    """Return how probably the nodes of `group` lie rightly to each other by the edges `right`.

    Against it are the other explanations, and that everything in the weakest cut is wrong and
    agrees by chance: of k edges with the odds o1 … ok the odds are o1 · … · ok / chance^(k - 1).
    So a chain is as sure as its weakest alignment, and a cycle as the two weakest and their
    agreement.
    """
    if len(group) == 1:
        return 1.0
    inside = set(group)
    strengths = {
        k: max(_log_odds(edges[k]) + parameters.cycle_gain, 0.0)
        for k in sorted(right)
        if edges[k].first in inside
    }
    cut = weakest_cut_of_all(group, edges, strengths)
    share = _share(group, count, edges, right, explanations)
    against = (1 - share) / share + math.exp(parameters.cycle_gain - cut)
    return 1 / (1 + against)


def weakest_link(
    group: Sequence[int],
    count: int,
    edges: Sequence[Edge],
    right: Iterable[int],
    worth: Sequence[float],
) -> float:
    """Return the least `worth` on the best ways that hold `group` together by the edges `right`.

    1 for a node alone.

    Parameters
    ----------
    worth
        (n,) of each edge.
    """
    if len(group) == 1:
        return 1.0
    inside = set(group)
    union, missing = Union(count), len(group) - 1
    for k in sorted(right, key=lambda k: -worth[k]):
        if union.join(edges[k].first, edges[k].second) and edges[k].first in inside:
            missing -= 1
        if missing == 0:
            return worth[k]
    raise ValueError(f"expected edges that hold {list(group)} together")


def _share(
    group: Sequence[int],
    count: int,
    edges: Sequence[Edge],
    right: Iterable[int],
    explanations: Sequence[ConsistentSet],
) -> float:
    """Return the part that those explanations have in all, by which `group` holds together."""
    inside = frozenset(k for k in right if edges[k].first in group)
    holding = [
        e.weight
        for e in explanations
        if e.right >= inside or list(group) in groups(count, edges, e.right & inside)
    ]
    return sum(holding) / sum(e.weight for e in explanations)


def part_right(edge: int, explanations: Sequence[ConsistentSet]) -> float:
    """Return in what part of all explanations, as probable as they are, `edge` is right."""
    weights = [e.weight for e in explanations if edge in e.right]
    return sum(weights) / sum(e.weight for e in explanations)


def _log_odds(edge: Edge) -> float:
    doubt = min(max(1 - edge.confidence, CERTAIN), 1 - CERTAIN)
    return math.log((1 - doubt) / doubt)
