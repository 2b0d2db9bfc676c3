"""Pieces of one wall that follow each other in one line are made one.

Where nothing was seen between two pieces, such as behind a cupboard, nothing tells whether the
wall goes on; it is drawn through unless space that was seen through tells that it does not.
"""

import numpy as np
from pydantic import Field
from shapely.geometry.base import BaseGeometry

from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.geometry.segments import cross, units
from mapweave.lines.corner_junctions import length_inside, neighbours
from mapweave.parameters import StageParameters, derived


class StraighteningParameters(StageParameters):
    """Which pieces are of one wall."""

    max_bend: float = derived(
        lambda c: 2 * c.sensor.range_sigma,
        ge=0,
        description="[m] from the chord within which two walls are one (laser noise)",
    )
    max_bridge: float = Field(
        0.6, ge=0, description="[m] of wall unseen, and not seen through, between parts of one"
    )
    max_crossing: float = derived(
        lambda c: 5 * c.sensor.range_sigma,
        ge=0,
        description="[m] of free space that noise may explain",
    )


def straighten(
    segments: FloatArray, free: BaseGeometry, parameters: StraighteningParameters
) -> FloatArray:
    """Return (m, 4) `segments` [m], those that follow each other in one line made one.

    Always the pair that deviates least from its chord next, as Douglas and Peucker would keep
    the point that deviates most.

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], the visible side on the left.
    free
        What was seen through, the same frame [m]: no gap is bridged there.
    parameters
        Which pieces are of one wall.
    """
    walls = segments
    while True:
        a, b, bend = _bends(walls, parameters)
        chords = np.stack([walls[a, 2:], walls[b, :2]], axis=1)
        open_ = np.flatnonzero(length_inside(chords, free) <= parameters.max_crossing)
        if not len(open_):
            return walls
        merged, gone = _merge_pairs(walls, a[open_], b[open_], bend[open_])
        walls = np.concatenate([np.delete(walls, gone, axis=0), merged])


def _bends(walls: FloatArray, p: StraighteningParameters) -> tuple[IntArray, IntArray, FloatArray]:
    """Return pairs in one line, and how far their inner ends are from the common chord [m]."""
    a, b = neighbours(walls, p.max_bridge)
    chord, length = units(np.hstack([walls[a, :2], walls[b, 2:]]))
    inner = [walls[a, 2:] - walls[a, :2], walls[b, :2] - walls[a, :2]]
    bend = np.maximum(*(np.abs(cross(chord, each)) for each in inner))
    directions, lengths = units(walls)
    ahead = (directions[a] * chord).sum(axis=1) > 0.5
    ahead &= (directions[b] * chord).sum(axis=1) > 0.5
    longer = length >= np.maximum(lengths[a], lengths[b])
    kept = np.flatnonzero((bend <= p.max_bend) & ahead & longer)
    return a[kept], b[kept], bend[kept]


def _merge_pairs(
    walls: FloatArray, a: IntArray, b: IntArray, bend: FloatArray
) -> tuple[FloatArray, list[int]]:
    """Merge pairs, the straightest first, each wall once; return them, and what is gone."""
    gone: set[int] = set()
    merged: list[FloatArray] = []
    for k in np.argsort(bend, kind="stable").tolist():
        pair = {int(a[k]), int(b[k])}
        if not pair & gone:
            gone |= pair
            merged.append(np.concatenate([walls[a[k], :2], walls[b[k], 2:]]))
    return np.array(merged).reshape(-1, 4), sorted(gone)
