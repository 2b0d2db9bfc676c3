"""Discrete Segment Evolution: many sightings of a surface become one segment (paper, VI).

Always the cheapest pair is merged next, until none is cheap enough;
`mapweave.lines.merging_rules` has the
rules. Each segment weighs the total length observed, not its own length as in the paper, so that
a well-known wall stays where it is.

Neither step sees polylines. The paper hands corresponding polylines to both; here any two segments
are a pair that are near, show the same face and are cheap, and polylines are made of the result.
"""

import heapq
from dataclasses import dataclass

import numpy as np
import shapely

from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.geometry.segments import lengths
from mapweave.lines.merging_cost import Pairs
from mapweave.lines.merging_rules import MergingParameters, Pairing
from mapweave.lines.segment_index import SegmentIndex

_ROUNDING = 1e-9  # [m] that distances computed in two ways may differ by

__all__ = ["Evolution", "MergingParameters", "count_support", "evolve", "merge_scan"]


@dataclass(frozen=True, slots=True, eq=False)
class Evolution:
    """What n segments evolved into.

    Attributes
    ----------
    segments
        (m, 4) x1 y1 x2 y2 [m], directed as their parents.
    weights
        (m,) total length observed [m].
    labels
        (n,) which of `segments` each input went into.
    """

    segments: FloatArray
    weights: FloatArray
    labels: IntArray


def evolve(
    segments: FloatArray,
    weights: FloatArray | None = None,
    parameters: MergingParameters | None = None,
) -> Evolution:
    """Merge the cheapest pair again and again until none is cheap enough (simplification, VI).

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], the visible side on the left.
    weights
        (n,) total length observed of each [m]; by default its length: seen once.
    parameters
        Which pairs are merged.

    Returns
    -------
    Evolution
        The segments that remain, in the order of their making.
    """
    mass = lengths(segments) if weights is None else weights
    chosen = parameters or MergingParameters()
    return _simplify(segments, mass, 0, Pairing(segments, mass, chosen))


def merge_scan(
    segments: FloatArray,
    weights: FloatArray,
    scan_segments: FloatArray,
    parameters: MergingParameters | None = None,
) -> Evolution:
    """Return G_t from G_(t-1) and the aligned S_t: pair creation, then simplification (VI).

    Parameters
    ----------
    segments, weights
        (n, 4) [m] and (n,) total length observed [m]: the map G_(t-1), itself simplified; only
        pairs with something new are looked at.
    scan_segments
        (k, 4) [m], map frame: the scan S_t.
    parameters
        Which pairs are merged.

    Returns
    -------
    Evolution
        Its labels are those of the n map segments, then those of the k scan segments.
    """
    chosen = parameters or MergingParameters()
    everything = np.concatenate([segments, scan_segments])
    mass = np.concatenate([weights, lengths(scan_segments)])
    pairing = Pairing(everything, mass, chosen)
    paired, settled = _create_pairs(everything, mass, len(segments), pairing)
    simplified = _simplify(paired.segments, paired.weights, settled, pairing)
    return Evolution(simplified.segments, simplified.weights, simplified.labels[paired.labels])


def count_support(labels: IntArray, scans: IntArray) -> IntArray:
    """Count the distinct scans that saw each merged segment.

    Parameters
    ----------
    labels
        (n,) which merged segment each sighting went into; all of 0…m-1 occur.
    scans
        (n,) the scan of each sighting.

    Returns
    -------
    IntArray
        (m,)
    """
    sightings = np.unique(np.column_stack([labels, scans]), axis=0)
    return np.bincount(sightings[:, 0]).astype(np.int64)


class _Evolving:
    """Segments while they evolve, each with its cheapest older partner in a queue.

    Of two segments it is the younger that looks for the older, so every pair is known to one of
    them, and a segment's entry is never dearer than its cheapest older partner that is left. When
    the partner of the first in the queue is gone, the first looks again and queues again: N log N.
    """

    def __init__(self, count: int, pairing: Pairing) -> None:
        self._pairing = pairing
        self._segments = np.empty((2 * count, 4))  # a tree of n leaves has under 2 n nodes
        self._weights = np.empty(2 * count)
        self._parent: list[int] = []
        self._left = SegmentIndex(pairing.reach)
        self._queue: list[tuple[float, int, int]] = []

    def add(self, segment: FloatArray, weight: float) -> None:
        """Add a segment, the youngest."""
        number = len(self._parent)
        self._parent.append(number)
        self._segments[number] = segment
        self._weights[number] = weight
        self._left.add(number, segment)

    def look_for_partner(self, number: int) -> None:
        """Queue a segment with its cheapest older partner, if it has one."""
        near = self._left.near(self._segments[number])
        older = near[near < number]
        if not len(older):
            return
        costs = self._pairing.cost(self._pairs(number, older))
        best = int(np.argmin(costs))
        if np.isfinite(costs[best]):
            heapq.heappush(self._queue, (float(costs[best]), number, int(older[best])))

    def look_for_partners(self, first: int) -> None:
        """Queue the segments from `first` on as `look_for_partner` would, all at once."""
        lines = shapely.linestrings(self._segments[: len(self._parent)].reshape(-1, 2, 2))
        near = shapely.STRtree(lines).query(
            lines[first:], predicate="dwithin", distance=self._pairing.reach + _ROUNDING
        )
        number, other = near[0] + first, near[1]
        older = other < number
        number, other = number[older], other[older]
        costs = self._pairing.cost(self._pairs(number, other))
        order = np.lexsort([other, costs, number])
        order = order[np.isfinite(costs[order])]
        _, best = np.unique(number[order], return_index=True)
        for k in order[best].tolist():
            heapq.heappush(self._queue, (float(costs[k]), int(number[k]), int(other[k])))

    def run(self) -> None:
        """Merge the cheapest pair until the queue is empty."""
        while self._queue:
            _, younger, older = heapq.heappop(self._queue)
            if not self._is_left(younger):
                continue
            if self._is_left(older):
                self._merge(younger, older)
            else:
                self.look_for_partner(younger)

    def result(self) -> Evolution:
        """Return what is left, and into what every input went."""
        end = list(self._parent)
        for number in reversed(range(len(end))):  # a merged segment is younger than what it is of
            end[number] = end[end[number]]
        inputs = len(self._segments) // 2
        left, labels = np.unique(np.array(end[:inputs], dtype=np.int64), return_inverse=True)
        return Evolution(self._segments[left], self._weights[left], labels.astype(np.int64))

    def _is_left(self, number: int) -> bool:
        return self._parent[number] == number

    def _merge(self, younger: int, older: int) -> None:
        """Replace two segments by the merged one."""
        merged = self._pairing.merged(self._pairs(younger, np.array([older])))[0]
        self._left.remove(younger)
        self._left.remove(older)
        weight = self._weights[younger] + self._weights[older]
        number = len(self._parent)
        self._parent[younger] = self._parent[older] = number
        self.add(merged, float(weight))
        self.look_for_partner(number)

    def _pairs(self, number: int | IntArray, others: IntArray) -> Pairs:
        return Pairs.of(
            np.atleast_2d(self._segments[number]),
            self._segments[others],
            self._weights[number],
            self._weights[others],
        )


def _simplify(
    segments: FloatArray, weights: FloatArray, settled: int, pairing: Pairing
) -> Evolution:
    """Merge the cheapest pair until none is left; not two of the `settled` first segments."""
    evolving = _Evolving(len(segments), pairing)
    for segment, weight in zip(segments, weights, strict=True):
        evolving.add(segment, float(weight))
    evolving.look_for_partners(settled)
    evolving.run()
    return evolving.result()


def _create_pairs(
    segments: FloatArray, weights: FloatArray, known: int, pairing: Pairing
) -> tuple[Evolution, int]:
    """Replace pairs of one of the `known` first segments and a later one, cheapest first (VI).

    The paper creates all similar pairs; here a segment goes into one pair at most, so that
    nothing is counted twice: simplification merges what is left over. Returns how many known
    segments stayed as they were, too: they come first.
    """
    old, new = _close_boxes(segments[:known], segments[known:], pairing.reach)
    new = new + known
    pairs = Pairs.of(segments[old], segments[new], weights[old], weights[new])
    chosen = _cheapest_matching(old, new, pairing.cost(pairs))
    old, new = old[chosen], new[chosen]
    merged = pairing.merged(Pairs.of(segments[old], segments[new], weights[old], weights[new]))
    untouched = np.setdiff1d(np.arange(len(segments)), np.concatenate([old, new]))
    labels = np.empty(len(segments), dtype=np.int64)
    labels[untouched] = np.arange(len(untouched))
    labels[old] = labels[new] = len(untouched) + np.arange(len(old))
    pairing_done = Evolution(
        np.concatenate([segments[untouched], merged]),
        np.concatenate([weights[untouched], weights[old] + weights[new]]),
        labels,
    )
    return pairing_done, int(np.searchsorted(untouched, known))


def _close_boxes(first: FloatArray, second: FloatArray, reach: float) -> tuple[IntArray, IntArray]:
    """Return the index pairs of segments whose bounding boxes are at most `reach` [m] apart."""
    low_1, high_1 = _boxes(first)
    low_2, high_2 = _boxes(second)
    apart = (low_1[:, None] > high_2 + reach) | (low_2 > high_1[:, None] + reach)
    old, new = np.nonzero(~apart.any(axis=-1))
    return old, new


def _boxes(segments: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the (n, 2) lower and upper corners of bounding boxes."""
    ends = segments.reshape(-1, 2, 2)
    return ends.min(axis=1), ends.max(axis=1)


def _cheapest_matching(first: IntArray, second: IntArray, costs: FloatArray) -> IntArray:
    """Return which pairs to take, cheapest first, finite only, each index once a side."""
    taken: list[int] = []
    used_first: set[int] = set()
    used_second: set[int] = set()
    for k in np.argsort(costs, kind="stable").tolist():
        i, j = int(first[k]), int(second[k])
        if np.isfinite(costs[k]) and i not in used_first and j not in used_second:
            taken.append(k)
            used_first.add(i)
            used_second.add(j)
    return np.array(taken, dtype=np.int64)
