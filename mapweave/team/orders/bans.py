"""Joins that an operator forbids, as constraints on which alignments may be right together."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapweave.geometry.arrays import FloatArray
from mapweave.reasons import Pair
from mapweave.team.cycles import Edge, misfit, poses_along

SAME_PLACE = 1.0  # [m] within which, and
SAME_TURN = 0.157  # [rad], 9°, poses count as one: beyond that hypotheses are different ones


@dataclass(frozen=True, slots=True, eq=False)
class Ban:
    """Two nodes that may not be joined.

    Attributes
    ----------
    first, second
        By number.
    transform
        (3,) of the second in the frame of the first that is forbidden [m, m, rad]; None where any
        is.
    names
        The two components.
    words
        Who forbids it, and why.
    """

    first: int
    second: int
    transform: FloatArray | None
    names: Pair
    words: str


class Bans:
    """Says which edges join what may not be joined.

    Parameters
    ----------
    count
        How many nodes there are.
    """

    def __init__(self, count: int, edges: Sequence[Edge], bans: Sequence[Ban]) -> None:
        self._count, self._edges, self._bans = count, edges, bans
        self._pinned = pinned(edges)

    def __call__(self, removed: int) -> int:
        """Return edges that join what may not be joined once `removed` are not there; 0 for none.

        Both are bit masks. Of those returned one must go; what is pinned stays.
        """
        present = [k for k in range(len(self._edges)) if not removed >> k & 1]
        ways = (self._way(ban, present) for ban in self._bans)
        return next((way for way in ways if way), 0)

    def broken_by(self, k: int, right: Sequence[int]) -> Ban | None:
        """Return the ban that edge `k` would break, beside the edges `right`; None if none."""
        present = sorted({*right, k})
        return next((ban for ban in self._bans if self._way(ban, present) >> k & 1), None)

    def _way(self, ban: Ban, present: Sequence[int]) -> int:
        return joining(ban, self._count, self._edges, present) & ~self._pinned


def joining(ban: Ban, count: int, edges: Sequence[Edge], present: Sequence[int]) -> int:
    """Return the bit mask of the edges that join what `ban` forbids; 0 where nothing does."""
    poses, paths = poses_along(ban.first, count, edges, present)
    if paths[ban.second] <= 0:
        return 0
    if ban.transform is not None and not is_same(ban.transform, poses[ban.second]):
        return 0
    return paths[ban.second]


def is_same(one: FloatArray, other: FloatArray) -> bool:
    """Tell whether two poses (3,) count as one."""
    off = misfit(one, np.zeros(3), other)
    return bool(np.hypot(off[0], off[1]) <= SAME_PLACE and abs(off[2]) <= SAME_TURN)


def pinned(edges: Sequence[Edge]) -> int:
    """Return the bit mask of those edges that an operator has pinned."""
    return sum(1 << k for k, edge in enumerate(edges) if edge.pinned)
