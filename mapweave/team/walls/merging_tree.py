"""Walls of many submaps merged two by two, so that one that changes is merged anew alone.

The paper merges a map and what is new (VI). Here maps are, in a tree: those that lie close to each
other first, so that what has a wall in common becomes one early, and the large maps near the root
meet at their edges alone. Which two are merged goes by where they lie, and by nothing else: what is
new, or moved, leaves all of the tree as it is but its own way to the root. What comes of two that
stay the same is kept; of a team of n submaps one that changed costs some log n mergings.
"""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapweave.geometry.arrays import FloatArray
from mapweave.lines.merging import MergingParameters, evolve
from mapweave.team.recent import Recent

CELL = 1.0  # [m]: submaps whose middles are in one cell lie close to each other, whatever they see
BITS = 31  # of a cell's row and column


@dataclass(frozen=True, slots=True, eq=False)
class Walls:
    """(n, 4) segments [m] in one frame, and (n,) the total length observed of each [m]."""

    segments: FloatArray
    weights: FloatArray


KnownMergings = Recent[tuple[Walls, Walls], Walls]


def merge_all(
    walls: Sequence[Walls],
    places: FloatArray,
    parameters: MergingParameters,
    known: KnownMergings,
) -> Walls:
    """Return what `walls` are when merged (paper, VI), at least one; remembered in `known`.

    Parameters
    ----------
    places
        (n, 2) where each lies [m], the same frame.
    """
    cells = _along_curve(places)
    order = sorted(range(len(walls)), key=cells.__getitem__)
    return _merged_tree([walls[k] for k in order], [cells[k] for k in order], parameters, known)


def _along_curve(places: FloatArray) -> list[int]:
    """Return the number of the cell of each of (n, 2) `places` [m] along Morton's curve.

    The bits of its row and its column in turns: cells whose first bits are the same are in one
    square, which is a cell of a coarser grid.
    """
    half = 1 << BITS - 1
    cells = np.clip(np.floor(places / CELL), -half, half - 1).astype(np.int64) + half
    bit = np.arange(BITS)
    bits = (cells[:, None, :] >> bit[:, None] & 1) << np.column_stack([2 * bit, 2 * bit + 1])
    found: list[int] = bits.sum(axis=(1, 2)).tolist()
    return found


def _merged_tree(
    walls: Sequence[Walls],
    cells: Sequence[int],
    parameters: MergingParameters,
    known: KnownMergings,
) -> Walls:
    """Return what `walls` are when merged, in the order of their `cells`."""
    if len(walls) == 1:
        return walls[0]
    half = _halfway(cells)
    left = _merged_tree(walls[:half], cells[:half], parameters, known)
    right = _merged_tree(walls[half:], cells[half:], parameters, known)
    return known.get((left, right), lambda: _merged(left, right, parameters))


def _halfway(cells: Sequence[int]) -> int:
    """Return how many of `cells`, ascending, are in the first half of the square of all of them.

    Of one cell it is the largest power of two: what comes after the last one leaves the trees
    before it.
    """
    differing = (cells[0] ^ cells[-1]).bit_length()
    if not differing:
        return 1 << (len(cells) - 1).bit_length() - 1
    return bisect_left(cells, cells[-1] >> differing - 1 << differing - 1)


def _merged(left: Walls, right: Walls, parameters: MergingParameters) -> Walls:
    found = evolve(
        np.concatenate([left.segments, right.segments]),
        np.concatenate([left.weights, right.weights]),
        parameters,
        settled=len(left.segments),
    )
    return Walls(found.segments, found.weights)
