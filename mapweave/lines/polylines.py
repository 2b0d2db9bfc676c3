"""Segments to generalized polylines (paper, V).

"We form an ordered list of segments by minimizing the sum of the distances of their endpoints.
Finally, if the endpoints of consecutive segments are too far apart, we split the list into
sublists." A segment keeps its direction, because its visible side is on the left: only the *end*
of one is ever linked to the *start* of the next.

The best list is an open travelling-salesman path. But links longer than `max_gap` are cut anyway,
so how long they are is no matter: what is left to choose is at most one successor and at most one
predecessor for each segment, a link costing its gap and a missing link costing `max_gap`. That is
an assignment problem, solved exactly and fast over the few pairs within `max_gap`. Its one flaw is
that successors may run in a circle; a circle loses its longest link, where a person would cut a
closed outline too, and the rest is chosen anew without it, until no circle is left. The result is
the shortest list whenever the first assignment has no circle.
"""

import numpy as np
import scipy
from numpy.typing import ArrayLike

from mapweave.geometry.arguments import as_positive, as_segments
from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray

NONE = -1
MAX_GAP = 0.5  # [m] within a polyline: half of a door


def generalized_polylines(segments: ArrayLike, max_gap: float = MAX_GAP) -> list[FloatArray]:
    """Return the generalized polylines that directed segments form (paper, V).

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], any frame, the visible side on the left; or (n, 2) vertices [m].
    max_gap
        The longest distance from one segment's end to the next one's start within a polyline [m].

    Returns
    -------
    list of FloatArray
        (k, 4) the segments of each, in order; that whose first segment comes first in the input
        comes first.

    Raises
    ------
    ArgumentError
        If `segments` has another shape, or holds NaN or infinity, or `max_gap` is not above 0.

    Examples
    --------
    >>> found = generalized_polylines([[0, 0, 2, 0], [9, 9, 9, 8], [2, 0.1, 2, 3]])
    >>> [polyline.tolist() for polyline in found]
    [[[0.0, 0.0, 2.0, 0.0], [2.0, 0.1, 2.0, 3.0]], [[9.0, 9.0, 9.0, 8.0]]]
    """
    given = as_segments("segments", segments)
    order, polyline = group_polylines(given, as_positive("max_gap", max_gap, "m"))
    starts = np.flatnonzero(np.diff(polyline)) + 1
    return np.split(given[order], starts) if len(given) else []


def group_polylines(segments: FloatArray, max_gap: float) -> tuple[IntArray, IntArray]:
    """Order directed segments into generalized polylines (paper, V).

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], any frame, the visible side on the left.
    max_gap
        The longest distance from one segment's end to the next one's start within a polyline [m].

    Returns
    -------
    order
        (n,) which segment comes at each place: ``segments[order]`` is the list.
    polyline
        (n,) the polyline at each place of the list: 0, 0, 1, 1, 1, 2, … ascending. The polyline
        whose first segment comes first in the input comes first.
    """
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
