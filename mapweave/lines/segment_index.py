"""Which segments may be close to a given one: a grid of cells, each knowing who passes."""

import math

import numpy as np

from mapweave.geometry.arrays import FloatArray, IntArray

_STRIDE = 1 << 24  # cells in a row: a cell (i, j) has the key i * _STRIDE + j
_AROUND = (np.arange(-1, 2)[:, None] * _STRIDE + np.arange(-1, 2)).ravel()


class SegmentIndex:
    """A set of numbered segments that can be asked for those close to another.

    Parameters
    ----------
    reach
        Segments at most this far apart [m] are found, and some farther ones.
    """

    def __init__(self, reach: float) -> None:
        # Points of a segment are taken every 2 * reach at most, its ends included. Where two
        # segments come closest one of them ends, unless they cross: either way both have such
        # a point within 2 * reach of the other's, so in the same or in adjoining cells.
        self._spacing = 2 * reach
        self._cell = 2 * reach
        self._passing: dict[int, set[int]] = {}
        self._cells: dict[int, set[int]] = {}

    def add(self, number: int, segment: FloatArray) -> None:
        """Add `segment`, (4,) x1 y1 x2 y2 [m], under a number that is not in use."""
        cells = set(self._keys(segment).tolist())
        self._cells[number] = cells
        for key in cells:
            self._passing.setdefault(key, set()).add(number)

    def remove(self, number: int) -> None:
        """Forget the segment of that number; KeyError if there is none."""
        for key in self._cells.pop(number):
            self._passing[key].discard(number)

    def near(self, segment: FloatArray) -> IntArray:
        """Return the numbers of the segments that may be in reach of the (4,) `segment`, sorted."""
        keys = set((self._keys(segment)[:, None] + _AROUND).ravel().tolist())
        found = set().union(*(self._passing[key] for key in keys if key in self._passing))
        return np.array(sorted(found), dtype=np.int64)

    def _keys(self, segment: FloatArray) -> IntArray:
        """Return the keys of the cells that points along `segment` fall into."""
        start, along = segment[:2], segment[2:] - segment[:2]
        steps = math.ceil(math.hypot(*along) / self._spacing)
        points = start + np.arange(steps + 1)[:, None] * (along / max(steps, 1))
        i, j = np.floor(points / self._cell).astype(np.int64).T
        return np.asarray(i * _STRIDE + j)
