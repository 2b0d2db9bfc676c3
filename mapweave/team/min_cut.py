"""The weakest cut: what must be wrong for two parts of a graph to lie wrongly to each other."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.team.cycles import Edge

UNITS = 1000  # of capacity per unit of strength: flows are whole numbers
MAX_UNITS = 2**20  # a capacity; a thousand of them still fit into 32 bits


@dataclass(frozen=True, slots=True)
class Cut:
    """A way to part a graph in two.

    Attributes
    ----------
    strength
        Sum of the strengths of the edges cut.
    side
        The nodes on the side of the first one.
    """

    strength: float
    side: frozenset[int]

    def parts(self, first: int, second: int) -> bool:
        """Tell whether two nodes end up on different sides."""
        return (first in self.side) != (second in self.side)


class Union:
    """Numbered nodes that hang together, more and more of them (union-find)."""

    def __init__(self, count: int) -> None:
        self._above = list(range(count))

    def root(self, node: int) -> int:
        """Return the node that stands for all that `node` hangs together with: the least."""
        above = self._above
        while above[node] != node:
            above[node] = above[above[node]]
            node = above[node]
        return node

    def join(self, first: int, second: int) -> bool:
        """Make two nodes hang together; return whether they did not before."""
        a, b = sorted((self.root(first), self.root(second)))
        self._above[b] = a
        return a != b

    def groups(self) -> list[list[int]]:
        """Return the nodes that hang together, each group ascending, that of the least first."""
        found: dict[int, list[int]] = {}
        for node in range(len(self._above)):
            found.setdefault(self.root(node), []).append(node)
        return list(found.values())


def groups(count: int, edges: Sequence[Edge], present: Iterable[int]) -> list[list[int]]:
    """Return the nodes that hang together by the edges `present`, each group ascending."""
    union = Union(count)
    for k in present:
        union.join(edges[k].first, edges[k].second)
    return union.groups()


def weakest_cut(
    nodes: Sequence[int],
    edges: Sequence[Edge],
    strengths: dict[int, float],
    first: int,
    second: int,
) -> Cut:
    """Return the weakest cut between two of `nodes`: by maximum flow (Ford and Fulkerson 1956).

    Parameters
    ----------
    strengths
        Of the edges between them, by their numbers; 0 or more.
    """
    place = {node: k for k, node in enumerate(nodes)}
    capacity = _capacities(place, edges, strengths)
    flow = scipy.sparse.csgraph.maximum_flow(capacity, place[first], place[second])
    left = capacity - flow.flow
    left.eliminate_zeros()
    side = scipy.sparse.csgraph.breadth_first_order(left, place[first], return_predecessors=False)
    cut = Cut(0.0, frozenset(nodes[int(k)] for k in side))
    crossing = (v for k, v in strengths.items() if cut.parts(edges[k].first, edges[k].second))
    return Cut(sum(crossing), cut.side)


def weakest_cut_of_all(
    nodes: Sequence[int], edges: Sequence[Edge], strengths: Mapping[int, float]
) -> float:
    """Return the strength of the weakest of all cuts that part `nodes`, two or more.

    By Stoer and Wagner (1997): of nodes taken one by one, always that which hangs most strongly on
    those taken, the last one's edges are the weakest cut between the last two. These become one
    node, and so on: no flow is looked for.
    """
    place = {node: k for k, node in enumerate(nodes)}
    between = np.zeros((len(nodes), len(nodes)))
    for k, strength in strengths.items():
        first, second = place[edges[k].first], place[edges[k].second]
        between[first, second] += strength
        between[second, first] += strength
    weakest = math.inf
    for left in range(len(nodes), 1, -1):
        last, one, strength = _last_two(between[:left, :left])
        weakest = min(weakest, strength)
        # What was `one` is `last` as well now, and the place that falls free is filled.
        between[last] += between[one]
        between[:, last] += between[:, one]
        between[last, last] = 0.0
        between[one], between[:, one] = between[left - 1], between[:, left - 1]
        between[one, one] = 0.0
    return weakest


def _last_two(between: FloatArray) -> tuple[int, int, float]:
    """Return the last two nodes taken, and how strongly the last one hangs on all others."""
    hangs = between[0].copy()
    hangs[0] = -math.inf
    before, here = 0, 0
    for _ in range(len(between) - 1):
        before, here = here, int(hangs.argmax())
        strength = float(hangs[here])
        hangs += between[here]
        hangs[here] = -math.inf
    return before, here, strength


def _capacities(
    place: Mapping[int, int], edges: Sequence[Edge], strengths: dict[int, float]
) -> "scipy.sparse.csr_array":
    """(n, n) how much flows from node to node, alike both ways."""
    table: IntArray = np.zeros((len(place), len(place)), dtype=np.int64)
    for k, strength in strengths.items():
        units = min(max(round(strength * UNITS), 1), MAX_UNITS)
        first, second = place[edges[k].first], place[edges[k].second]
        table[first, second] += units
        table[second, first] += units
    return scipy.sparse.csr_array(np.minimum(table, 2**30).astype(np.int32))
