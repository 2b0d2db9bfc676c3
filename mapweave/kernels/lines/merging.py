"""Discrete Segment Evolution: many sightings of a surface become one segment (paper, VI)."""

import heapq
from typing import TYPE_CHECKING

import numpy as np

from mapweave.kernels.arrays import BoolArray, FloatArray, IntArray
from mapweave.kernels.lines.merging_cost import Pairs
from mapweave.kernels.lines.merging_rules import MergingRules, Pairing
from mapweave.kernels.loading import COMPILED

NO_SCAN = -1


class NumpyEvolvingMap:
    """Segments that evolve scan by scan: G_t from G_(t-1) and S_t.

    Of two segments it is the younger that looks for the older, so every pair is known to one of
    them, and a segment's entry in the queue is never dearer than its cheapest older partner that
    is left. When the partner of the first in the queue is gone, the first looks again and queues
    again. Only what a scan brings, and what comes of it, looks for partners.

    Parameters
    ----------
    rules
        Which pairs are merged.
    segments, weights
        (n, 4) x1 y1 x2 y2 [m], the visible side on the left, and (n,) total length observed [m]:
        what is known at the start, by no scan, and is not merged further among itself.
    """

    def __init__(self, rules: MergingRules, segments: FloatArray, weights: FloatArray) -> None:
        self._rules = rules
        self._segments = np.empty((64, 4))  # by number, in the order of their making; may be longer
        self._weights = np.empty(64)
        self._parent: list[int] = []  # into what each was merged, itself if it is left
        self._scans: dict[int, set[int]] = {}  # that saw each of those left
        self._queue: list[tuple[float, int, int]] = []
        self._left = np.empty(0, dtype=np.int64)  # ascending
        self._sightings: list[int] = []
        _check(segments)
        if len(weights) != len(segments) or not (np.isfinite(weights) & (weights >= 0)).all():
            raise ValueError("weights: numbers of 0 or more expected, one a segment")
        for segment, weight in zip(segments, weights.tolist(), strict=True):
            self._sightings.append(self._enter(segment, weight, set()))
        self._left = np.arange(len(segments))

    def merge_scan(self, segments: FloatArray, scan: int) -> None:
        """Merge the (k, 4) `segments` [m] of a scan: pair creation, then simplification (VI)."""
        _check(segments)
        if scan < 0:
            raise ValueError("scan: 0 or more expected")
        known = len(self._parent)
        lengths = np.hypot(*(segments[:, 2:] - segments[:, :2]).T)
        fresh = [
            self._enter(segment, weight, {scan})
            for segment, weight in zip(segments, lengths.tolist(), strict=True)
        ]
        self._sightings += fresh
        pairing = self._pairing(np.concatenate([self._left, fresh]).astype(np.int64))
        self._create_pairs(np.array(fresh, dtype=np.int64), pairing)
        self._left = self._standing(known)
        for number in self._left[self._left >= known].tolist():
            self._look_for_partner(number, pairing)
        self._run(pairing)

    def simplify(self, settled: int = 0) -> None:
        """Merge the cheapest pair again and again until none is cheap enough (VI).

        The first `settled` are merged among themselves: they wait to be found by others.
        """
        pairing = self._pairing(self._left)
        for number in self._left[self._left >= settled].tolist():
            self._look_for_partner(number, pairing)
        self._run(pairing)

    def segments(self) -> FloatArray:
        """Return (m, 4) what is left [m], in the order of their making."""
        return self._segments[self._left]

    def weights(self) -> FloatArray:
        """Return (m,) the total length observed of each [m]."""
        return self._weights[self._left]

    def numbers(self) -> IntArray:
        """Return (m,) a number of each, ascending; one that moves gets another."""
        return self._left.copy()

    def labels(self) -> IntArray:
        """Return which of those left each input went into: those at the start, then the scans'."""
        end = list(self._parent)
        for number in reversed(range(len(end))):  # a merged segment is younger than what it is of
            end[number] = end[end[number]]
        inputs = np.array([end[number] for number in self._sightings], dtype=np.int64)
        return np.searchsorted(self._left, inputs).astype(np.int64)

    def seen(self, owner: IntArray) -> tuple[IntArray, IntArray]:
        """Return (m,) how many scans saw each segment, and the last that did.

        What was seen of a segment counts for its (m,) `owner`, itself or another that takes it
        over. For one that is taken over: 0 and -1.
        """
        if len(owner) != len(self._left) or not ((owner >= 0) & (owner < len(owner))).all():
            raise ValueError("owner: indices of segments expected, one a segment")
        scans: list[set[int]] = [set() for _ in self._left]
        for number, to in zip(self._left.tolist(), owner.tolist(), strict=True):
            scans[to] |= self._scans[number]
        own = owner == np.arange(len(owner))
        support = [len(each) for each in scans]
        last = [max(each, default=NO_SCAN) for each in scans]
        return np.where(own, support, 0), np.where(own, last, NO_SCAN)

    def _enter(self, segment: FloatArray, weight: float, scans: set[int]) -> int:
        """Add a segment, the youngest, and return its number."""
        number = len(self._parent)
        if number == len(self._weights):
            self._segments = np.concatenate([self._segments, np.empty_like(self._segments)])
            self._weights = np.concatenate([self._weights, np.empty_like(self._weights)])
        self._segments[number] = segment
        self._weights[number] = weight
        self._parent.append(number)
        self._scans[number] = scans
        return number

    def _pairing(self, numbers: IntArray) -> Pairing:
        return Pairing(self._segments[numbers], self._weights[numbers], self._rules)

    def _create_pairs(self, fresh: IntArray, pairing: Pairing) -> None:
        """Replace pairs of a known segment and one of `fresh`, cheapest first (VI).

        The paper creates all similar pairs; here a segment goes into one pair at most, so that
        nothing is counted twice: simplification merges what is left over.
        """
        near = _close_boxes(self._segments[self._left], self._segments[fresh], pairing.reach)
        old, new = self._left[near[0]], fresh[near[1]]
        costs = pairing.cost(self._pairs(old, new))
        for k in np.argsort(costs, kind="stable").tolist():
            first, second = int(old[k]), int(new[k])
            if np.isfinite(costs[k]) and self._is_left(first) and self._is_left(second):
                self._merge(first, second, pairing)

    def _look_for_partner(self, number: int, pairing: Pairing) -> None:
        """Queue a segment with its cheapest older partner, if it has one."""
        older = self._left[self._left < number]
        own = self._segments[[number]]
        older = older[_close_boxes(self._segments[older], own, pairing.reach)[0]]
        if not len(older):
            return
        costs = pairing.cost(self._pairs(np.array([number]), older))
        best = int(np.argmin(costs))
        if np.isfinite(costs[best]):
            heapq.heappush(self._queue, (float(costs[best]), number, int(older[best])))

    def _run(self, pairing: Pairing) -> None:
        """Merge the cheapest pair until the queue is empty."""
        while self._queue:
            _, younger, older = heapq.heappop(self._queue)
            if not self._is_left(younger):
                continue
            if self._is_left(older):
                number = self._merge(younger, older, pairing)
                gone = (self._left == younger) | (self._left == older)
                self._left = np.append(self._left[~gone], number)
                self._look_for_partner(number, pairing)
            else:
                self._look_for_partner(younger, pairing)

    def _merge(self, first: int, second: int, pairing: Pairing) -> int:
        """Replace two segments by the merged one, and return its number."""
        merged = pairing.merged(self._pairs(np.array([first]), np.array([second])))[0]
        weight = float(self._weights[first] + self._weights[second])
        scans = self._scans.pop(first) | self._scans.pop(second)
        number = self._enter(merged, weight, scans)
        self._parent[first] = self._parent[second] = number
        return number

    def _pairs(self, first: IntArray, second: IntArray) -> Pairs:
        return Pairs.of(
            self._segments[first],
            self._segments[second],
            self._weights[first],
            self._weights[second],
        )

    def _is_left(self, number: int) -> bool:
        return self._parent[number] == number

    def _standing(self, known: int) -> IntArray:
        """Return the numbers of those left, of which `known` ones were there before."""
        parent = np.array(self._parent, dtype=np.int64)
        asked = np.concatenate([self._left, np.arange(known, len(parent))])
        return np.asarray(asked[parent[asked] == asked])


def _check(segments: FloatArray) -> None:
    if segments.ndim != 2 or segments.shape[1] != 4 or not np.isfinite(segments).all():
        raise ValueError("segments: finite numbers expected, four a segment")


def _close_boxes(first: FloatArray, second: FloatArray, reach: float) -> tuple[IntArray, IntArray]:
    """Return the index pairs of segments whose bounding boxes are at most `reach` [m] apart."""
    low_1, high_1 = _boxes(first)
    low_2, high_2 = _boxes(second)
    apart: BoolArray = (low_1[:, None] > high_2 + reach) | (low_2 > high_1[:, None] + reach)
    old, new = np.nonzero(~apart.any(axis=-1))
    return old, new


def _boxes(segments: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the (n, 2) lower and upper corners of bounding boxes."""
    ends = segments.reshape(-1, 2, 2)
    return ends.min(axis=1), ends.max(axis=1)


if TYPE_CHECKING or COMPILED is None:  # noqa: SIM108 (an alias for types, too)
    EvolvingMap = NumpyEvolvingMap
else:
    EvolvingMap = COMPILED.EvolvingMap
