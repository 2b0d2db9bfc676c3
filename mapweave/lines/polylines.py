"""Segments to generalized polylines (paper, V).

"We form an ordered list of segments by minimizing the sum of the distances of their endpoints.
Finally, if the endpoints of consecutive segments are too far apart, we split the list into
sublists." A segment keeps its direction, because its visible side is on the left: only the *end*
of one is ever linked to the *start* of the next.

The best list is an open travelling-salesman path. But links longer than `max_gap` are cut anyway,
so how long they are is no matter: what is left to choose is at most one successor and at most one
predecessor for each segment, a link costing its gap and a missing link costing `max_gap`. That is
an assignment problem, solved exactly and fast over the few pairs within `max_gap`. Its one flaw is
that successors may run in a circle; a circle loses its longest link, where a person would cut a
closed outline too, and the rest is chosen anew without it, until no circle is left. The result is
the shortest list whenever the first assignment has no circle.
"""

import numpy as np
from numpy.typing import ArrayLike

from mapweave.geometry.arguments import as_positive, as_segments
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.kernels.lines import polylines as kernel

MAX_GAP = 0.5  # [m] within a polyline: half of a door


def generalized_polylines(segments: ArrayLike, max_gap: float = MAX_GAP) -> list[FloatArray]:
    """Return the generalized polylines that directed segments form (paper, V).

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], any frame, the visible side on the left; or (n, 2) vertices [m].
    max_gap
        The longest distance from one segment's end to the next one's start within a polyline [m].

    Returns
    -------
    list of FloatArray
        (k, 4) the segments of each, in order; that whose first segment comes first in the input
        comes first.

    Raises
    ------
    ArgumentError
        If `segments` has another shape, or holds NaN or infinity, or `max_gap` is not above 0.

    Examples
    --------
    >>> found = generalized_polylines([[0, 0, 2, 0], [9, 9, 9, 8], [2, 0.1, 2, 3]])
    >>> [polyline.tolist() for polyline in found]
    [[[0.0, 0.0, 2.0, 0.0], [2.0, 0.1, 2.0, 3.0]], [[9.0, 9.0, 9.0, 8.0]]]
    """
    given = as_segments("segments", segments)
    order, polyline = group_polylines(given, as_positive("max_gap", max_gap, "m"))
    starts = np.flatnonzero(np.diff(polyline)) + 1
    return np.split(given[order], starts) if len(given) else []


def group_polylines(segments: FloatArray, max_gap: float) -> tuple[IntArray, IntArray]:
    """Order directed segments into generalized polylines (paper, V).

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], any frame, the visible side on the left.
    max_gap
        The longest distance from one segment's end to the next one's start within a polyline [m].

    Returns
    -------
    order
        (n,) which segment comes at each place: ``segments[order]`` is the list.
    polyline
        (n,) the polyline at each place of the list: 0, 0, 1, 1, 1, 2, … ascending. The polyline
        whose first segment comes first in the input comes first.
    """
    return kernel.group_polylines(np.ascontiguousarray(segments, dtype=np.float64), max_gap)
