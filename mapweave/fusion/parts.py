"""Parts of a robot's map: consecutive submaps, few enough to be rigid.

A whole map may be bent, so that no one transform lays it on another; what was mapped over some
tens of metres of path is not. Where parts of two maps are found in each other and agree about
how, the maps are joined there.
"""

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment, LineMap, RobotMap
from mapweave.parameters import StageParameters, derived
from mapweave.reasons import Reason, ReasonKind


class PartParameters(StageParameters):
    """How maps are cut, and when parts agree."""

    length: float = derived(
        lambda c: 3 * c.mapping.submap_length,
        gt=0,
        description="[m] of path that is rigid: three submaps",
    )
    count: int = Field(4, ge=1, description="parts at most; of a longer path they are longer")
    distance: float = Field(1.0, gt=0, description="[m] by which two parts' alignments may differ")
    turn: float = Field(0.09, gt=0, description="[rad] by which they may differ: 5°")


def cut(robot_map: RobotMap, component: int, parameters: PartParameters) -> list[LineMap]:
    """Return the parts of `component`, one after the other, in the component's frame."""
    p = parameters
    submaps = [s for s in robot_map.submaps if s.component == component]
    path = np.array([s.trajectory.length for s in submaps])
    length = max(p.length, float(path.sum()) / p.count)
    part = ((np.cumsum(path) - path / 2) / length).astype(np.int64)
    return [
        LineMap.union(
            [s.map.moved(s.pose) for s, k in zip(submaps, part, strict=True) if k == name]
        )
        for name in np.unique(part)
    ]


def agreed(
    found: Sequence[Alignment], middles: FloatArray, parameters: PartParameters
) -> Alignment | None:
    """Return the best held of the accepted alignments `found` of parts, if others agree.

    None where fewer than two were found, or where any two contradict each other: parts that look
    alike are no proof. Its evidence tells how many agree, and the spread [m].

    Parameters
    ----------
    middles
        (n, 2) of the walls of the other map's part that each is of [m], other map's frame.
    """
    if len(found) < 2:
        return None
    pairs = list(itertools.combinations(range(len(found)), 2))
    between = [(middles[i] + middles[j]) / 2 for i, j in pairs]
    errors = [
        difference(found[i].transform, found[j].transform, middle)
        for (i, j), middle in zip(pairs, between, strict=True)
    ]
    spread, turn = np.max(errors, axis=0)
    if spread > parameters.distance or turn > parameters.turn:
        return None
    best = max(found, key=lambda a: a.evidence.held or 0.0)
    agreement = {"parts": float(len(found)), "spread": float(spread)}
    cause = Reason(ReasonKind.PARTS_AGREE, agreement, best.cause)
    return replace(best, cause=cause, evidence=replace(best.evidence, **agreement))


def difference(one: FloatArray, other: FloatArray, middle: FloatArray) -> tuple[float, float]:
    """By how much two transforms (3,) differ at `middle` (2,) [m], [rad]."""
    apart = se2.transform_points(one, middle) - se2.transform_points(other, middle)
    return float(np.hypot(*apart)), float(abs(se2.wrap(one[2] - other[2])))
