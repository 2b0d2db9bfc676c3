"""Which alignments are right: the explanations of them all, the most probable first.

An explanation says of each alignment whether it is right. Those that are right must agree. Its
probability follows from three assumptions:

- an alignment is right with the probability that is its confidence;
- wrong ones agree with others by chance only, with a small probability, `chance`;
- right ones agree always.

So the log of an explanation's weight is the sum of the log odds of those that are right, and
-log(chance) for every independent cycle that they close: #right - #nodes + #parts. Majority
and confidence are in it both, and no alignment, however sure, outweighs a cycle that agrees.
What else speaks against an explanation, such as walls where others saw through, is doubt that
costs as much.
"""

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from pydantic import BaseModel, ConfigDict, Field

from mapweave.team.cycles import CycleParameters, Edge, bad_cycles, bad_cycles_through
from mapweave.team.min_cut import Union
from mapweave.team.orders.bans import Bans, pinned


class ConsistencyParameters(BaseModel):
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
class ConsistentSet:
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


class Contradictions(Protocol):
    """What speaks against poses, beside the alignments themselves."""

    def __call__(self, removed: int, /) -> tuple[float, int]:
        """Return what speaks against the edges that agree once `removed` are not there.

        Returns
        -------
        doubt
            The log of the odds against them, 0 or more.
        edges
            Bit mask of the edges of which one at least would have to go; 0 where there is no doubt.
        """
        ...


def explain(
    count: int,
    edges: Sequence[Edge],
    parameters: ConsistencyParameters,
    contradictions: Contradictions | None = None,
    bans: Bans | None = None,
) -> list[ConsistentSet]:
    """Return the explanations of `edges` between `count` nodes, the most probable first.

    Of each cycle that does not close one edge must go. The sets of edges to remove are tried from
    the least costly, so the first that leaves only cycles that close is the most probable. Where
    that takes too long, what is in most of such cycles goes first. Edges that are pinned never go;
    of those that join what `bans` forbid one must.
    """
    bans = bans or Bans(count, edges, ())
    found = _Search(count, edges, parameters, contradictions or _no_doubt, bans).run()
    least = found[0].cost
    return [
        ConsistentSet(
            frozenset(k for k in range(len(edges)) if not one.removed >> k & 1),
            math.exp(least - one.cost),
        )
        for one in found
    ]


class _Candidate(NamedTuple):
    """A set of removed edges: what it costs, and the part of that which is doubt, once known."""

    cost: float
    removed: int
    doubt: float | None = None


class _Search:
    """Sets of removed edges as bit masks, in the order of what they cost."""

    def __init__(
        self,
        count: int,
        edges: Sequence[Edge],
        p: ConsistencyParameters,
        contradictions: Contradictions,
        bans: Bans,
    ) -> None:
        self._count, self._edges, self._p, self._doubts = count, edges, p, contradictions
        self._bans, self._free = bans, ~pinned(edges)
        self._odds = [p.log_odds(edge.confidence) for edge in edges]
        self._cycles = self._looked_for(0)
        self._whole = self._independent_cycles(0)
        self._waiting = [_Candidate(0.0, 0)]
        self._seen = {0}
        self._found: list[_Candidate] = []

    def run(self) -> list[_Candidate]:
        """Return the explanations."""
        p, found = self._p, self._found
        for _ in range(p.max_tries):
            if not self._waiting or len(found) == p.max_count:
                break
            candidate = heapq.heappop(self._waiting)
            if found and candidate.cost > found[0].cost + math.log(p.max_odds):
                break
            if not self._is_less_than_found(candidate):
                self._look_at(candidate)
        return found or [self._remove_greedily(self._waiting[0].removed)]

    def _is_less_than_found(self, candidate: _Candidate) -> bool:
        """Whether an explanation relies on more edges, and no more speaks against it."""
        return any(
            candidate.removed & found.removed == found.removed
            and (found.doubt or 0.0) <= (candidate.doubt or 0.0)
            for found in self._found
        )

    def _look_at(self, candidate: _Candidate) -> None:
        """Take `candidate` as an explanation, or see what else would have to go."""
        if candidate.doubt is not None:
            self._found.append(candidate)
            return
        conflict = self._bad_cycle(candidate.removed) or self._bans(candidate.removed)
        if not conflict:
            doubt, conflict = self._doubts(candidate.removed)
            believed = _Candidate(candidate.cost + doubt, candidate.removed, doubt)
            heapq.heappush(self._waiting, believed)
        for k in bits(conflict & self._free):
            self._consider(candidate.removed | 1 << k)

    def _consider(self, removed: int) -> None:
        if removed not in self._seen:
            self._seen.add(removed)
            heapq.heappush(self._waiting, _Candidate(self._cost(removed), removed))

    def _bad_cycle(self, removed: int) -> int:
        """Return a cycle that is left and does not close, 0 if there is none."""
        for cycle in self._cycles:
            if not cycle & removed:
                return cycle
        if not removed:
            return 0  # all were looked at in the beginning
        news = self._looked_for(removed)
        self._cycles += news
        return news[0] if news else 0

    def _looked_for(self, removed: int) -> list[int]:
        """Return the cycles that do not close, but for those that are pinned all around."""
        found = bad_cycles(self._count, self._edges, removed, self._p.cycles)
        return [cycle for cycle in found if cycle & self._free]

    def _cost(self, removed: int) -> float:
        odds = sum(self._odds[k] for k in bits(removed))
        lost = self._whole - self._independent_cycles(removed)
        return odds + lost * self._p.cycle_gain

    def _independent_cycles(self, removed: int) -> int:
        """How many of the edges that are left close a cycle."""
        union = Union(self._count)
        return sum(
            not union.join(edge.first, edge.second)
            for k, edge in enumerate(self._edges)
            if not removed >> k & 1
        )

    def _remove_greedily(self, removed: int) -> _Candidate:
        """Remove what is in most cycles until all close; then bring back what still agrees."""
        while self._bad_cycle(removed):
            left = [cycle for cycle in self._cycles if not cycle & removed]
            counts = {
                k: sum(cycle >> k & 1 for cycle in left)
                for k in range(len(self._edges))
                if self._free >> k & 1
            }
            worst = max(counts, key=lambda k: (counts[k], -self._odds[k]))
            removed |= 1 << worst
        while banned := self._bans(removed):
            removed |= 1 << min(bits(banned), key=lambda k: self._odds[k])
        for k in sorted(bits(removed), key=lambda k: -self._odds[k]):
            if self._agrees(k, removed & ~(1 << k)):
                removed &= ~(1 << k)
        return self._remove_doubted(removed)

    def _agrees(self, k: int, removed: int) -> bool:
        """Tell whether edge `k` agrees with all that is left once `removed` are not there."""
        present = [j for j in range(len(self._edges)) if not removed >> j & 1]
        root = self._edges[k].first
        cycles = bad_cycles_through(root, self._count, self._edges, present, self._p.cycles)
        return not any(cycle & self._free for cycle in cycles) and not self._bans(removed)

    def _remove_doubted(self, removed: int) -> _Candidate:
        """Remove the weakest of what is doubted most, as far as that is the more probable."""
        tried = []
        while True:
            doubt, doubted = self._doubts(removed)
            doubted &= self._free
            tried.append(_Candidate(self._cost(removed) + doubt, removed, doubt))
            if not doubted:
                return min(tried)
            removed |= 1 << min(bits(doubted), key=lambda k: self._odds[k])


def bits(mask: int) -> list[int]:
    """Return which bits of `mask` are set."""
    return [k for k in range(mask.bit_length()) if mask >> k & 1]


def _no_doubt(_: int) -> tuple[float, int]:
    return 0.0, 0
