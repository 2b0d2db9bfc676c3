"""Lost and found: a robot's components are joined as soon as their shapes prove it (paper, II).

By the means by which two robots' maps are joined: a component is a map like any other.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mapweave import se2
from mapweave.assembly import place, unite_lines
from mapweave.fusion import FusionParameters, align_maps
from mapweave.maps import LineMap, Submap

GROWTH = 0.15  # share by which either of two components has grown before they are compared again


class Reunion:
    """Remembers what it compared: a pair that was refused is asked again when it has grown."""

    def __init__(self, parameters: FusionParameters) -> None:
        self._parameters = parameters
        self._compared: dict[tuple[int, int], tuple[float, float]] = {}

    def reunite(self, submaps: Sequence[Submap]) -> tuple[list[Submap], list[tuple[int, int]]]:
        """Join every component to an older one where the shapes prove it.

        Returns
        -------
        submaps
            In the same order, with their new components and poses.
        joints
            For each join, the ids of a submap of the older and one of the younger component:
            those whose walls are nearest, because there the shapes were compared, and what
            tracking did to the rest of either component is not the join's.
        """
        joined = list(submaps)
        joints: list[tuple[int, int]] = []
        for younger in sorted({s.component for s in submaps})[1:]:
            for older in sorted({s.component for s in joined if s.component < younger}):
                after = self._joined(joined, older, younger)
                if after is not None:
                    of_younger = {s.id for s in joined if s.component == younger}
                    joints.append(_nearest(after, older, of_younger))
                    joined = after
                    break
        return joined, joints

    def _joined(self, submaps: Sequence[Submap], older: int, younger: int) -> list[Submap] | None:
        """Return `submaps` with two components as one, where their shapes prove it."""
        walls = _wall(submaps, older), _wall(submaps, younger)
        if not self._is_due((older, younger), walls):
            return None
        self._compared[older, younger] = walls
        alignment = align_maps(
            ("older", _lines(submaps, older)),
            ("younger", _lines(submaps, younger)),
            self._parameters,
        )
        if alignment.decision != "accepted":
            return None
        return [
            replace(s, component=older, pose=se2.compose(alignment.transform, s.pose))
            if s.component == younger
            else s
            for s in submaps
        ]

    def _is_due(self, pair: tuple[int, int], walls: tuple[float, float]) -> bool:
        """Whether either of a pair has notably more wall [m] than when it was compared."""
        before = self._compared.get(pair)
        if before is None:
            return True
        return any(w > (1 + GROWTH) * b for w, b in zip(walls, before, strict=True))


def _nearest(submaps: Sequence[Submap], component: int, younger: set[int]) -> tuple[int, int]:
    """Return the ids of the nearest two submaps, one in `younger` and one that is not."""
    inside = [(s.id, _middle(s)) for s in submaps if s.component == component]
    _, first, second = min(
        (math.dist(a, b), one, other)
        for one, a in inside
        if one not in younger
        for other, b in inside
        if other in younger
    )
    return first, second


def _middle(submap: Submap) -> tuple[float, float]:
    """Middle of a submap's walls, component frame [m]; of none its frame's origin."""
    points = submap.map.segments.reshape(-1, 2)
    middle = points.mean(axis=0) if len(points) else np.zeros(2)
    x, y = se2.transform_points(submap.pose, middle).tolist()
    return x, y


def _wall(submaps: Sequence[Submap], component: int) -> float:
    """[m] of wall in the submaps of a component."""
    return sum(
        float(np.hypot(*(s.map.segments[:, 2:] - s.map.segments[:, :2]).T).sum())
        for s in submaps
        if s.component == component
    )


def _lines(submaps: Sequence[Submap], component: int) -> LineMap:
    return unite_lines([place(s.map, s.pose) for s in submaps if s.component == component])
