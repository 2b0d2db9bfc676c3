"""Loose things: short, and free on both sides, as people are and what can be pushed or carried.

What a scan sees of a place is mostly what was there a moment ago. What stands free and is short
may have come since, or go: it is no proof against a pose. Walls are long, or go on behind what is
before them.
"""

import numpy as np

from mapweave.geometry.arrays import IntArray
from mapweave.scan.scan import Scan


def loose_things(scan: Scan, width: float, gap: float) -> IntArray:
    """Return (beams,) the number of the thing that stands free and is short; -1 for none.

    Such a thing is one run of returns without a jump; what is seen beside it, on both sides, is
    farther away, or the field of view ends on one of them.

    Parameters
    ----------
    scan
        One sweep.
    width
        [m] of a loose thing, the most.
    gap
        [m] by which what is beside it is farther; smaller steps are no jump.
    """
    beams = np.flatnonzero(scan.hits)
    loose = np.full(len(scan.ranges), -1, dtype=np.int64)
    if len(beams) < 2:
        return loose
    ranges = scan.ranges[beams]
    step = ranges[1:] - ranges[:-1]
    cuts = np.flatnonzero(np.abs(step) > gap)
    if len(cuts) == 0:
        return loose
    first, last = np.empty((2, len(cuts) + 1), dtype=np.int64)
    first[0], first[1:], last[:-1], last[-1] = 0, cuts + 1, cuts, len(beams) - 1
    chosen = np.ones(len(first), dtype=np.bool_)
    chosen[1:] = step[cuts] < 0  # nearer than what is before it
    chosen[:-1] &= step[cuts] > 0
    points = scan.points
    ends = points[beams[last]] - points[beams[first]]
    chosen &= np.hypot(ends[:, 0], ends[:, 1]) <= width
    numbers = np.where(chosen, np.arange(len(first)), -1)
    loose[beams] = np.repeat(numbers, last - first + 1)
    return loose
