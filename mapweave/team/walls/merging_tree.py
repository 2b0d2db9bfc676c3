"""Walls of many submaps merged two by two, so that one that changes is merged anew alone.

The paper merges a map and what is new (VI). Here maps are: of submaps of a component, and then of
components, in a tree. What comes of two that stay the same is kept; of a team of n submaps one that
changed costs some log n mergings, each of maps that are merged already.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapweave.geometry.arrays import FloatArray
from mapweave.lines.merging import MergingParameters, evolve
from mapweave.team.recent import Recent


@dataclass(frozen=True, slots=True, eq=False)
class Walls:
    """(n, 4) segments [m] in one frame, and (n,) the total length observed of each [m]."""

    segments: FloatArray
    weights: FloatArray


KnownMergings = Recent[tuple[Walls, Walls], Walls]


def merge_all(walls: Sequence[Walls], parameters: MergingParameters, known: KnownMergings) -> Walls:
    """Return what `walls` are when merged (paper, VI), at least one; remembered in `known`."""
    if len(walls) == 1:
        return walls[0]
    # The largest power of two: so that what comes after the last one leaves the trees before it.
    half = 1 << (len(walls) - 1).bit_length() - 1
    left = merge_all(walls[:half], parameters, known)
    right = merge_all(walls[half:], parameters, known)
    return known.get((left, right), lambda: _merged(left, right, parameters))


def _merged(left: Walls, right: Walls, parameters: MergingParameters) -> Walls:
    found = evolve(
        np.concatenate([left.segments, right.segments]),
        np.concatenate([left.weights, right.weights]),
        parameters,
    )
    return Walls(found.segments, found.weights)
