"""The weakest cut: what must be wrong for two parts of a graph to lie wrongly to each other."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from mapweave.geometry.arrays import IntArray
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


def groups(count: int, edges: Sequence[Edge], present: Iterable[int]) -> list[list[int]]:
    """Return the nodes that hang together by the edges `present`, each group ascending."""
    ends = np.array([(edges[k].first, edges[k].second) for k in present], dtype=int).reshape(-1, 2)
    links = scipy.sparse.csr_array(
        (np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(count, count)
    )
    number, labels = scipy.sparse.csgraph.connected_components(links, directed=False)
    return [np.flatnonzero(labels == label).tolist() for label in range(number)]


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
    nodes: Sequence[int], edges: Sequence[Edge], strengths: dict[int, float]
) -> Cut:
    """Return the weakest of all cuts that part `nodes`, of which there are two or more."""
    first, *others = nodes
    cuts = [weakest_cut(nodes, edges, strengths, first, other) for other in others]
    return min(cuts, key=lambda cut: cut.strength)


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
