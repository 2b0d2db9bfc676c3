"""A stretch of a polyline: what of it lies between two arc lengths."""

import numpy as np

from mapweave.geometry.arrays import FloatArray

_ROUNDING = 1e-9  # share of a polyline's length below which a piece of a segment is none


def stretch_of(polyline: FloatArray, start: float, end: float) -> FloatArray:
    """Return the segments of `polyline` from arc length `start` to `end`, its gaps left out.

    Parameters
    ----------
    polyline
        (n, 4) x1 y1 x2 y2 [m], any frame, in order.
    start, end
        Arc lengths from the polyline's beginning, gaps not counted [m].

    Returns
    -------
    FloatArray
        (k, 4) [m], the same frame; the first and the last one cut where the stretch starts and
        ends.
    """
    steps = polyline[:, 2:] - polyline[:, :2]
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    ends = np.cumsum(lengths)
    starts = ends - lengths
    least = _ROUNDING * lengths.sum()
    used = np.flatnonzero(np.minimum(ends, end) - np.maximum(starts, start) > least)
    unit = steps[used] / lengths[used, None]
    low = (np.maximum(start, starts[used]) - starts[used])[:, None]
    high = (np.minimum(end, ends[used]) - starts[used])[:, None]
    first = polyline[used, :2]
    return np.hstack([first + low * unit, first + high * unit])
