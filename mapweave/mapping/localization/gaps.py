"""Gaps: where a robot that lost track came to next, as far as it can have come meanwhile.

Most robots that lost track were not carried away. So where one component ends and another begins
the second is near the first.
"""

from collections.abc import Sequence
from itertools import groupby, pairwise

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Submap
from mapweave.parameters import StageParameters, derived


class GapParameters(StageParameters):
    """How far a robot comes while it is lost, and how finely it is looked for there."""

    reach: float = derived(
        lambda c: 1.5 * c.robot.max_speed,
        gt=0,
        description="[m] that a robot came while it was lost, at most",
    )
    max_reach: float = derived(
        lambda c: 3.75 * c.robot.max_speed,
        gt=0,
        description="[m] the same with a piece in between, its path included",
    )
    looked_at: int = Field(
        2, ge=1, description="between two components where it is looked for, the last"
    )
    step: float = Field(0.3, gt=0, description="[m] between the places tried there")
    turn_step: float = Field(0.06, gt=0, description="[rad] between the headings tried there")


def between_them(
    submaps: Sequence[Submap], older: int, younger: int, p: GapParameters
) -> FloatArray:
    """(n, 3) transforms from `younger` to `older` by which the robot did not leap between them.

    Wherever one ended and the other is the next of the two, the last times; what it saw meanwhile
    may be in a piece too small to be joined.
    """
    seen = [
        (k, s)
        for k, s in enumerate(submaps)
        if s.component in (older, younger) and len(s.trajectory.pose)
    ]
    gaps = [(a, b) for a, b in pairwise(seen) if a[1].component != b[1].component]
    found = [np.empty((0, 3))]
    for (k, before), (m, after) in gaps[-p.looked_at :]:
        moves = _moves(_lost_for(submaps[k + 1 : m], p), p)
        last, first = _pose(before, -1), _pose(after, 0)
        if before.component == older:
            found.append(se2.compose(se2.compose(last, moves), se2.inverse(first)))
        else:
            found.append(se2.compose(first, se2.compose(se2.inverse(moves), se2.inverse(last))))
    return np.concatenate(found)


def _lost_for(pieces: Sequence[Submap], p: GapParameters) -> float:
    """[m] that a robot may have come while it was lost, these pieces of its path included."""
    count = len(list(groupby(pieces, lambda s: s.component)))
    return p.reach * (1 + count) + sum(s.trajectory.length for s in pieces)


def _moves(reach: float, p: GapParameters) -> FloatArray:
    """(n, 3) all moves of a robot that came no farther than `reach` [m, m, rad]; none beyond it."""
    if reach > p.max_reach:
        return np.empty((0, 3))
    shifts = np.linspace(-reach, reach, 2 * int(np.ceil(reach / p.step)) + 1)
    turns = np.arange(-np.pi, np.pi, p.turn_step)
    x, y, turn = (a.ravel() for a in np.meshgrid(shifts, shifts, turns, indexing="ij"))
    within = np.hypot(x, y) <= reach
    moves: FloatArray = np.column_stack([x, y, turn])[within]
    return moves


def _pose(submap: Submap, scan: int) -> FloatArray:
    """(3,) of one of the scans of a submap, component frame [m, m, rad]."""
    return se2.compose(submap.pose, submap.trajectory.pose[scan])
