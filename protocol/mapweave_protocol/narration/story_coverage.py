"""What of the region is searched, told when it has grown by half, or nothing is left to search."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from mapweave.maps import JointComponent, JointMap, parse_component
from mapweave.text import counted

if TYPE_CHECKING:
    from mapweave.scan.coverage import Coverage

GROWN = 1.5  # times what was told last
WORTH_A_LINE = 10.0  # [m²]


class CoverageStory:
    """Tells how far the search is."""

    def __init__(self) -> None:
        self._told: dict[str, Coverage] = {}  # by the first of a joint component

    def changed(self, joint: JointMap) -> Iterator[str]:
        """Tell what is new in a version."""
        from mapweave.scan.coverage import coverage  # who imports `watch` need not load geometry

        for component in joint.components:
            first = min(component.robots, key=parse_component)
            now = coverage(component.map)
            if self._is_news(self._told.get(first), now):
                self._told[first] = now
                yield _tell(component, now)

    def _is_news(self, told: Coverage | None, now: Coverage) -> bool:
        if told is None:
            return now.explored >= WORTH_A_LINE
        done = bool(told.frontiers) and not now.frontiers
        return now.explored >= GROWN * told.explored or done


def _tell(component: JointComponent, now: Coverage) -> str:
    searched = f"{' + '.join(sorted(component.robots))}: {now.explored:.0f} m² searched"
    count = len(now.frontiers)
    if not count:
        return f"{searched}, nothing left to search"
    widest = float(np.linalg.norm(np.diff(now.frontiers[0], axis=0), axis=1).sum())
    return f"{searched}, goes on at {counted(count, 'frontier')}, the widest {widest:.1f} m"
