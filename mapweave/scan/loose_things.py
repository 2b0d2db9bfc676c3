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
    ranges, points = scan.ranges[beams], scan.points[beams]
    step = np.diff(ranges)
    cuts = np.flatnonzero(np.abs(step) > gap)
    first, last = np.append(0, cuts + 1), np.append(cuts, len(beams) - 1)
    nearer_before = np.append(True, step[cuts] < 0)  # than what is before it
    nearer_after = np.append(step[cuts] > 0, True)
    ends = points[last] - points[first]
    short = np.hypot(ends[:, 0], ends[:, 1]) <= width
    chosen = nearer_before & nearer_after & short & (len(cuts) > 0)
    numbers = np.where(chosen, np.arange(len(first)), -1)
    loose[beams] = np.repeat(numbers, last - first + 1)
    return loose
