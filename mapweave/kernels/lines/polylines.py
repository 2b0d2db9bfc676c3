"""Segments to generalized polylines: at most one successor each (paper, V).

`mapweave.lines.polylines` says why this is an assignment problem. Its one flaw is that successors
may run in a circle: a circle loses its longest link, and the rest is chosen anew without it.
"""

from typing import TYPE_CHECKING

import numpy as np
import scipy

from mapweave.kernels.arrays import BoolArray, FloatArray, IntArray
from mapweave.kernels.loading import COMPILED

NONE = -1


def numpy_group_polylines(segments: FloatArray, max_gap: float) -> tuple[IntArray, IntArray]:
    """Return (n,) the order of (n, 4) `segments` [m], and (n,) the polyline at each place."""
    source, target, gap = _possible_links(segments, max_gap)
    allowed = np.ones(len(gap), dtype=bool)
    while True:
        chosen = _cheapest_links(len(segments), source, target, gap, allowed, max_gap)
        chains, circles = _follow(len(segments), source[chosen], target[chosen])
        if not circles:
            break
        allowed[_longest_links(circles, source, gap, chosen)] = False
    order = np.fromiter((s for chain in chains for s in chain), np.int64, len(segments))
    polyline = np.repeat(np.arange(len(chains)), [len(chain) for chain in chains])
    return order, polyline.astype(np.int64)


def _possible_links(segments: FloatArray, max_gap: float) -> tuple[IntArray, IntArray, FloatArray]:
    """Return all pairs (source, target, gap [m]) with target's start within reach of source's end.

    No segment follows itself.
    """
    if not len(segments):
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64), np.empty(0)
    ends, starts = scipy.spatial.KDTree(segments[:, 2:]), scipy.spatial.KDTree(segments[:, :2])
    near = ends.sparse_distance_matrix(starts, max_gap, output_type="ndarray")
    source, target = near["i"].astype(np.int64), near["j"].astype(np.int64)
    other = source != target
    return source[other], target[other], near["v"][other]


def _cheapest_links(
    n: int,
    source: IntArray,
    target: IntArray,
    gap: FloatArray,
    allowed: BoolArray,
    max_gap: float,
) -> IntArray:
    """Return the indices of the links that form the cheapest assignment.

    Each of the n segments has n real successors and one of its own that stands for "none". The
    solver takes no zero weights; a constant added to all costs changes no choice.
    """
    if not len(gap):
        return np.empty(0, dtype=np.int64)
    link = np.flatnonzero(allowed)
    nobody = np.arange(n)
    cost = np.concatenate([gap[link], np.full(n, max_gap)]) + 1.0
    rows = np.concatenate([source[link], nobody])
    columns = np.concatenate([target[link], n + nobody])
    costs = scipy.sparse.csr_array((cost, (rows, columns)), shape=(n, 2 * n))
    _, successor = scipy.sparse.csgraph.min_weight_full_bipartite_matching(costs)
    chosen: BoolArray = successor[source[link]] == target[link]
    return link[chosen]


def _follow(n: int, source: IntArray, target: IntArray) -> tuple[list[list[int]], list[list[int]]]:
    """Return the chains, in the order of their first segments, and the circles of the links."""
    successor = np.full(n, NONE)
    successor[source] = target
    following = successor.tolist()
    unseen = [True] * n

    def walk(segment: int) -> list[int]:
        walked = []
        while segment != NONE and unseen[segment]:
            unseen[segment] = False
            walked.append(segment)
            segment = following[segment]
        return walked

    chains = [walk(first) for first in np.setdiff1d(np.arange(n), target).tolist()]
    circles = [walk(segment) for segment in range(n) if unseen[segment]]
    return chains, circles


def _longest_links(
    circles: list[list[int]], source: IntArray, gap: FloatArray, chosen: IntArray
) -> list[int]:
    """Return the index of each circle's longest link."""
    link_of = dict(zip(source[chosen].tolist(), chosen.tolist(), strict=True))
    return [max((link_of[s] for s in circle), key=lambda link: gap[link]) for circle in circles]


if TYPE_CHECKING or COMPILED is None:
    group_polylines = numpy_group_polylines
else:
    group_polylines = COMPILED.group_polylines
