"""Cycles of alignments that do not close: at least one alignment in each of them is wrong.

Pairwise consistency (Mangelson et al. 2018, ICRA) carried over to a graph: the transforms along a
cycle of right alignments compose to the identity, but for what each of them errs by.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeAlias

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray

Pose: TypeAlias = tuple[float, float, float]

LIKELY = 2.45  # standard deviations along x and y, within which 19 of 20 are


class CycleParameters(BaseModel):
    """When a cycle of alignments closes."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    max_distance: float = Field(
        0.75, gt=0, description="[m] by which a cycle of three may miss: each may err by 0.25"
    )
    max_turn: float = Field(0.09, gt=0, description="[rad] by which a cycle of three may miss: 5°")
    max_cycles: int = Field(400, ge=1, description="looked at in one go, the shortest")


@dataclass(frozen=True, eq=False)
class Edge:
    """An alignment as the edge of a graph.

    Attributes
    ----------
    first, second
        The nodes it links, by number.
    transform
        (3,) of the second in the frame of the first [m, m, rad].
    confidence
        That it is right, before others are asked.
    bend
        [m] standard deviation along x and y that bent maps add to what it errs by.
    places
        (k, 2) where it holds, in the frame of the first [m]; none where that is not told.
    pinned
        Whether an operator says that it is right: then it is, whatever else is found.
    """

    first: int
    second: int
    transform: FloatArray
    confidence: float
    bend: float = 0.0
    places: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    pinned: bool = False

    @cached_property
    def forth(self) -> Pose:
        """The transform as numbers."""
        x, y, turn = self.transform.tolist()
        return x, y, turn

    @cached_property
    def back(self) -> Pose:
        """Its inverse as numbers."""
        x, y, turn = se2.inverse(self.transform).tolist()
        return x, y, turn


def bad_cycles(count: int, edges: Sequence[Edge], removed: int, p: CycleParameters) -> list[int]:
    """Return the cycles that do not close, shortest first, each as a bit mask of its edges.

    Parameters
    ----------
    count
        How many nodes there are.
    removed
        Bit mask of the edges that are not there.
    """
    present = [k for k in range(len(edges)) if not removed >> k & 1]
    found: set[int] = set()
    for root in sorted({edges[k].first for k in present} | {edges[k].second for k in present}):
        found.update(bad_cycles_through(root, count, edges, present, p))
    return sorted(found, key=lambda mask: (mask.bit_count(), mask))[: p.max_cycles]


def poses_along(
    root: int, count: int, edges: Sequence[Edge], present: Sequence[int]
) -> tuple[FloatArray, list[int]]:
    """Return the poses in the frame of `root` by the fewest steps, and the edges stepped along.

    Returns
    -------
    poses
        (count, 3) [m, m, rad]; NaN where there is no way.
    paths
        For each node a bit mask of the edges from `root`; -1 where there is no way.
    """
    steps: list[list[int]] = [[] for _ in range(count)]
    for k in present:
        steps[edges[k].first].append(k)
        steps[edges[k].second].append(k)
    poses, paths = [(math.nan, math.nan, math.nan)] * count, [-1] * count
    poses[root], paths[root] = (0.0, 0.0, 0.0), 0
    reached = [root]
    for here in reached:  # grows meanwhile: nodes in the order of their steps from the root
        for k in steps[here]:
            edge = edges[k]
            forward = edge.first == here
            there = edge.second if forward else edge.first
            if paths[there] < 0:
                poses[there] = _stepped(poses[here], edge.forth if forward else edge.back)
                paths[there] = paths[here] | 1 << k
                reached.append(there)
    return np.array(poses).reshape(count, 3), paths


def _stepped(pose: Pose, step: Pose) -> Pose:
    """`se2.compose` of two single poses, of which there are thousands."""
    (x, y, turn), (dx, dy, more) = pose, step
    c, s = math.cos(turn), math.sin(turn)
    angle = math.pi - (math.pi - turn - more) % (2 * math.pi)
    return x + c * dx - s * dy, y + s * dx + c * dy, angle


def misfit(transform: FloatArray, first: FloatArray, second: FloatArray) -> FloatArray:
    """Return what `transform` and the poses of `first` and `second`, all (..., 3), differ by."""
    return se2.between(transform, se2.between(first, second))


def bad_cycles_through(
    root: int, count: int, edges: Sequence[Edge], present: Sequence[int], p: CycleParameters
) -> list[int]:
    """Return those that do not close, of an edge and the shortest paths to it from `root`."""
    poses, paths = poses_along(root, count, edges, present)
    here = [k for k in present if paths[edges[k].first] >= 0]
    # What two paths have in common cancels: it is no part of the cycle.
    masks = {k: (paths[edges[k].first] ^ paths[edges[k].second]) ^ (1 << k) for k in here}
    closing = [k for k in here if masks[k]]
    if not closing:
        return []
    transforms = np.array([edges[k].forth for k in closing])
    first = poses[[edges[k].first for k in closing]]
    second = poses[[edges[k].second for k in closing]]
    off = misfit(transforms, first, second)
    # Errors of independent alignments add up as their squares do.
    length = np.array([masks[k].bit_count() / 3 for k in closing])
    beyond = np.sum(off[:, :2] ** 2, axis=1) - p.max_distance**2 * length
    turned = np.abs(off[:, 2]) > p.max_turn * np.sqrt(length)
    return [
        masks[closing[at]]
        for at in np.flatnonzero((beyond > 0) | turned).tolist()
        if turned[at] or beyond[at] > _bent(edges, masks[closing[at]])
    ]


def _bent(edges: Sequence[Edge], mask: int) -> float:
    """[m²] that bends may add to what the cycle of the edges in `mask` misses by, squared."""
    squares = 0.0
    while mask:
        k = mask.bit_length() - 1
        squares += (LIKELY * edges[k].bend) ** 2
        mask ^= 1 << k
    return squares
