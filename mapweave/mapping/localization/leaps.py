"""Leaps: joins of components by which a robot was where it cannot have come to in the time.

It may have been carried off, and the join be right. But most robots are not, and buildings repeat
themselves: a corridor fits its twin as well as a robot that was carried off fits its place. So a
join with a leap is held until walls that the robot saw since agree with it.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydantic import Field

from mapweave.fusion.agreement import AgreementParameters, difference
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.localization.whereabouts import Path, WhereaboutsParameters, farthest_way
from mapweave.maps import Submap
from mapweave.parameters import StageParameters, derived


class LeapParameters(StageParameters):
    """What is a leap, and when one is believed."""

    whereabouts: WhereaboutsParameters = derived(WhereaboutsParameters.of)
    agreement: AgreementParameters = AgreementParameters()
    drift: float = Field(
        0.02, ge=0, description="[m/m] of both paths, by which they may be bent, as loops allow"
    )
    again: float = Field(
        2.0, gt=1, description="times the wall in common at first, by which a leap is believed"
    )


class _Held(NamedTuple):
    """A join (3,) with a leap, and the wall in common [m], when it was found first."""

    transform: FloatArray
    common: float


class LeapJudge:
    """Remembers the joins with a leap that were found once.

    Parameters
    ----------
    known
        How many of the first submaps are of earlier runs: from one run to another a robot may be
        taken anywhere.
    """

    def __init__(self, parameters: LeapParameters, known: int = 0) -> None:
        self._p, self._known = parameters, known
        self._held: dict[tuple[int, int], _Held] = {}
        self._jumps: list[int] = []

    def note_jump(self, scan: int) -> None:
        """Note that from number `scan` on the robot was elsewhere than tracking had it."""
        self._jumps.append(scan)

    def leaps(self, submaps: Sequence[Submap], pair: tuple[int, int], join: FloatArray) -> bool:
        """Whether the robot leaped from one of a `pair` of components to the other.

        Parameters
        ----------
        join
            (3,) from the second component to the first.
        """
        own = submaps[self._known :]
        if not set(pair) <= {s.component for s in own if len(s.trajectory.pose)}:
            return False
        first, second = (Path.of(own, component) for component in pair)
        bent = self._p.drift * sum(s.trajectory.length for s in own if s.component in pair)
        moved = second._replace(pose=se2.compose(join, second.pose))
        return any(
            float(np.hypot(*(one.pose[k] - other.pose[m])[:2]))
            > bent + farthest_way(one, k, other, m, self._p.whereabouts)
            for one, k, other, m in _crossings(first, moved)
            if not any(one.number[k] < jump <= other.number[m] for jump in self._jumps)
        )

    def is_believed(
        self, pair: tuple[int, int], join: FloatArray, common: float, middle: FloatArray
    ) -> bool:
        """Whether a `join` (3,) with a leap was found before, with much less wall in `common` [m].

        Parameters
        ----------
        middle
            (2,) of the second component's walls [m], where joins are compared.
        """
        held, p = self._held.get(pair), self._p
        if held is not None:
            apart, turned = difference(held.transform, join, middle)
            if apart <= p.agreement.distance and turned <= p.agreement.turn:
                return common >= p.again * held.common
        self._held[pair] = _Held(join, common)
        return False


def _crossings(first: Path, second: Path) -> list[tuple[Path, int, Path, int]]:
    """Return the scans, by their places in two paths, between which a robot changed paths."""
    both = np.concatenate([first.number, second.number])
    order = np.argsort(both, kind="stable")
    of_second = order >= len(first.number)
    found = []
    for k in np.flatnonzero(np.diff(of_second.astype(int))).tolist():
        before, after = int(order[k]), int(order[k + 1])
        one, other = (second, first) if of_second[k] else (first, second)
        start = len(first.number)
        found.append(
            (one, before - start * (one is second), other, after - start * (other is second))
        )
    return found
