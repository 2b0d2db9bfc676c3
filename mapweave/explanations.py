"""Which alignments are right: the explanations of them all, the most probable first.

An explanation says of each alignment whether it is right. Those that are right must agree. Its
probability follows from three assumptions:

- an alignment is right with the probability that is its confidence;
- wrong ones agree with others by chance only, with a small probability, `chance`;
- right ones agree always.

So the log of an explanation's weight is the sum of the log odds of those that are right, and
-log(chance) for every independent cycle that they close: |right| - |nodes| + |parts|. Majority
and confidence are in it both, and no alignment, however sure, outweighs a cycle that agrees.
"""

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass

from pydantic import BaseModel, ConfigDict, Field

from mapweave.cycles import CycleParameters, Edge, bad_cycles


class ExplanationParameters(BaseModel):
    """What is assumed of wrong alignments, and how long is looked for explanations."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    cycles: CycleParameters = CycleParameters()
    chance: float = Field(
        0.001,
        gt=0,
        lt=1,
        description="that a wrong alignment agrees with a given pose: a circle of 0.75 m in a"
        " building of 20 m by 20 m, one of the four turns that keep walls parallel",
    )
    max_confidence: float = Field(
        0.99, gt=0.5, lt=1, description="counted: no calibration on some hundred pairs tells more"
    )
    min_confidence: float = Field(
        0.51, gt=0.5, lt=1, description="counted: what was accepted is more probable than not"
    )
    max_tries: int = Field(3000, ge=1, description="sets of alignments looked at")
    max_count: int = Field(32, ge=1, description="explanations")
    max_odds: float = Field(1000.0, gt=1, description="of the best against the last explanation")

    def log_odds(self, confidence: float) -> float:
        """Return the log odds of an alignment of this confidence."""
        sure = min(max(confidence, self.min_confidence), self.max_confidence)
        return math.log(sure / (1 - sure))

    @property
    def cycle_gain(self) -> float:
        """The log of how much an independent cycle that closes makes an explanation likelier."""
        return -math.log(self.chance)


@dataclass(frozen=True, slots=True)
class Explanation:
    """One choice of alignments that agree.

    Attributes
    ----------
    right
        The numbers of the edges that are right.
    weight
        How probable it is, beside the others.
    """

    right: frozenset[int]
    weight: float


def explain(
    count: int, edges: Sequence[Edge], parameters: ExplanationParameters
) -> list[Explanation]:
    """Return the explanations of `edges` between `count` nodes, the most probable first.

    Of each cycle that does not close one edge must go. The sets of edges to remove are tried from
    the least costly, so the first that leaves only cycles that close is the most probable. Where
    that takes too long, what is in most of such cycles goes first.
    """
    found = _Search(count, edges, parameters).run()
    least = found[0][0]
    return [
        Explanation(
            frozenset(k for k in range(len(edges)) if not removed >> k & 1),
            math.exp(least - cost),
        )
        for cost, removed in found
    ]


class _Search:
    """Sets of removed edges as bit masks, in the order of what removing them costs."""

    def __init__(self, count: int, edges: Sequence[Edge], p: ExplanationParameters) -> None:
        self._count, self._edges, self._p = count, edges, p
        self._odds = [p.log_odds(edge.confidence) for edge in edges]
        self._cycles = bad_cycles(count, edges, 0, p.cycles)
        self._whole = self._independent_cycles(0)

    def run(self) -> list[tuple[float, int]]:
        """Return (cost, removed) of each explanation."""
        p = self._p
        found: list[tuple[float, int]] = []
        waiting, seen = [(0.0, 0)], {0}
        for _ in range(p.max_tries):
            if not waiting or len(found) == p.max_count:
                break
            cost, removed = heapq.heappop(waiting)
            if found and cost > found[0][0] + math.log(p.max_odds):
                break
            if any(removed & less == less for _, less in found):
                continue  # an explanation already, less one that could as well be right
            cycle = self._bad_cycle(removed)
            if not cycle:
                found.append((cost, removed))
            for k in _bits(cycle):
                more = removed | 1 << k
                if more not in seen:
                    seen.add(more)
                    heapq.heappush(waiting, (self._cost(more), more))
        return found or [self._remove_greedily(waiting[0][1])]

    def _bad_cycle(self, removed: int) -> int:
        """Return a cycle that is left and does not close, 0 if there is none."""
        for cycle in self._cycles:
            if not cycle & removed:
                return cycle
        news = bad_cycles(self._count, self._edges, removed, self._p.cycles)
        self._cycles += news
        return news[0] if news else 0

    def _cost(self, removed: int) -> float:
        odds = sum(self._odds[k] for k in _bits(removed))
        lost = self._whole - self._independent_cycles(removed)
        return odds + lost * self._p.cycle_gain

    def _independent_cycles(self, removed: int) -> int:
        """How many of the edges that are left close a cycle."""
        group = list(range(self._count))

        def root(node: int) -> int:
            while group[node] != node:
                group[node] = group[group[node]]
                node = group[node]
            return node

        closing = 0
        for k, edge in enumerate(self._edges):
            if not removed >> k & 1:
                a, b = root(edge.first), root(edge.second)
                closing += a == b
                group[a] = b
        return closing

    def _remove_greedily(self, removed: int) -> tuple[float, int]:
        while self._bad_cycle(removed):
            left = [cycle for cycle in self._cycles if not cycle & removed]
            counts = [sum(cycle >> k & 1 for cycle in left) for k in range(len(self._edges))]
            worst = max(range(len(counts)), key=lambda k: (counts[k], -self._odds[k]))
            removed |= 1 << worst
        return self._cost(removed), removed


def _bits(mask: int) -> list[int]:
    return [k for k in range(mask.bit_length()) if mask >> k & 1]
