"""Every shift of a map over another, in wide cells, at some turns: few sums tell where it may be.

What a metre of wall counts in a wide cell, by the way it faces, times the metres of the other map
there: summed over the cells that a shift lays on each other, and both ways.
"""

from typing import cast

import numpy as np
import scipy

from mapweave.kernels.arrays import Float32Array, FloatArray, IntArray
from mapweave.kernels.loading import COMPILED
from mapweave.kernels.matching.place_views import PlaceView, PlaceViewNumpy

FACINGS = 8  # in wide cells: 45° each
CENTIMETRE = 0.01


class _WideMap:
    """A map at one turn, in wide cells."""

    def __init__(
        self, view: PlaceViewNumpy, turn: float, width: float, directions: int, weight: int
    ) -> None:
        self._turn, self._width = turn, width
        rows, columns = view.codes.shape
        rim = self._turned(
            _centres(view, np.array([[-1, -1], [rows, -1], [-1, columns], [rows, columns]]))
        )
        self.low = rim.min(axis=0)
        rows, columns = ((rim.max(axis=0) - self.low) / width).astype(np.int64) + 1
        self.shape = int(rows), int(columns)
        self.worth = self._count(view, directions, weight)
        self.walls = self._collect(view)

    def _turned(self, places: FloatArray) -> FloatArray:
        c, s = np.cos(self._turn), np.sin(self._turn)
        x, y = places.T
        return np.column_stack([c * x - s * y, s * x + c * y])

    def _cells(self, places: FloatArray) -> tuple[IntArray, IntArray]:
        i, j = ((self._turned(places) - self.low) / self._width).astype(np.int64).T
        return i, j

    def _facing(self, turns: FloatArray) -> IntArray:
        turned = turns + (self._turn / (2 * np.pi) + 2)
        return (turned * FACINGS + 0.5).astype(np.int64) % FACINGS

    def _count(self, view: PlaceViewNumpy, directions: int, weight: int) -> Float32Array:
        """(facings, rows, columns) twice what a metre counts, by every second row and column."""
        index = 2 * np.argwhere(view.codes[::2, ::2] != directions)
        code = view.codes[tuple(index.T)].astype(np.int64)
        cells, near = self._cells(_centres(view, index)), code < directions
        worth = np.zeros((FACINGS, *self.shape), dtype=np.float32)
        facing = self._facing((code + 0.5) / directions)
        for aside, counts in ((0, 2), (1, 1), (-1, 1)):
            np.add.at(worth, ((facing[near] + aside) % FACINGS, *(k[near] for k in cells)), counts)
        seen = np.zeros(self.shape, dtype=np.float32)
        np.add.at(seen, tuple(k[~near] for k in cells), -2 * weight)
        worth += seen
        return worth

    def _collect(self, view: PlaceViewNumpy) -> list[tuple[int, int, int, float]]:
        """Return the walls in cells: facing, row, column, whole centimetres."""
        metres = np.zeros((FACINGS, *self.shape))
        places = view.samples[:, :2]
        inside = (places >= view.origin) & (
            places <= view.origin + view.cell * np.array(view.codes.shape)
        )
        if not inside.all():
            raise ValueError("samples: inside of the raster expected")
        np.add.at(
            metres, (self._facing(view.samples[:, 2]), *self._cells(places)), view.samples[:, 3]
        )
        whole = np.rint(metres / CENTIMETRE)
        return [(f, i, j, float(whole[f, i, j])) for f, i, j in np.argwhere(metres > 0).tolist()]


def best_shifts_numpy(
    reference: PlaceViewNumpy,
    other: PlaceViewNumpy,
    turns: FloatArray,
    width: float,
    directions: int,
    weight: int,
    count: int,
) -> tuple[FloatArray, FloatArray]:
    """Twin of `best_shifts`."""
    here = _WideMap(reference, 0.0, width, directions, weight)
    unit = CENTIMETRE * reference.cell * other.cell / width**2
    found, scores = [np.empty((0, 3))], [np.empty(0)]
    for turn in turns:
        there = _WideMap(other, float(turn), width, directions, weight)
        sums = _sums(here, there).astype(np.float64)
        places = _peaks(sums, count)
        shift = here.low - there.low + width * (_tops(sums, places) - (np.array(there.shape) - 1))
        found.append(np.column_stack([shift, np.full(len(places), turn)]))
        scores.append(sums[tuple(places.T)] * unit)
    return np.concatenate(found), np.concatenate(scores)


def best_shifts(
    reference: PlaceView,
    other: PlaceView,
    turns: FloatArray,
    width: float,
    directions: int,
    weight: int,
    count: int,
) -> tuple[FloatArray, FloatArray]:
    """Return (n, 3) transforms from `other` to `reference` that count most, and what they count.

    At each of (k,) `turns` [rad] at most `count`, the best first: shifts above 0 and no worse than
    those beside; (n,) metres of wall in common less contradicted, the mean of both ways.

    Parameters
    ----------
    reference, other
        The codes of their cells are `directions` of walls near them, that number where there is
        nothing to say, and one more where space was seen through.
    width
        [m] of the cells.
    weight
        Metres in common that a metre where it was seen through outweighs.

    Raises
    ------
    ValueError
        Where a map is too large for such cells, or its walls are not in its raster. Compiled, also
        where the cells are too wide for sums of sixteen bits: more than some tens of the raster's.
    """
    if COMPILED is None:
        here, there = cast("tuple[PlaceViewNumpy, PlaceViewNumpy]", (reference, other))
        return best_shifts_numpy(here, there, turns, width, directions, weight, count)
    found = COMPILED.best_shifts(reference, other, turns, width, directions, weight, count)
    return cast("tuple[FloatArray, FloatArray]", found)


def _centres(view: PlaceViewNumpy, index: IntArray) -> FloatArray:
    """(n, 2) of cells [m]."""
    return view.origin + (index + 0.5) * view.cell


def _sums(here: _WideMap, there: _WideMap) -> Float32Array:
    """(rows, columns) what each shift counts."""
    (m, n), (r, c) = here.shape, there.shape
    sums = np.zeros((m + r - 1, n + c - 1), dtype=np.float32)
    for facing, i, j, metres in there.walls:
        sums[r - 1 - i : r - 1 - i + m, c - 1 - j : c - 1 - j + n] += metres * here.worth[facing]
    for facing, i, j, metres in here.walls:
        sums[i : i + r, j : j + c] += metres * there.worth[facing, ::-1, ::-1]
    return sums


def _peaks(sums: FloatArray, count: int) -> IntArray:
    """(n, 2) rows and columns of those above 0 and no lower than the eight about them."""
    top = scipy.ndimage.maximum_filter(sums, 3, mode="constant")
    places = np.argwhere((sums > 0) & (sums == top))
    return places[np.argsort(-sums[tuple(places.T)], kind="stable")[:count]]


def _tops(sums: FloatArray, places: IntArray) -> FloatArray:
    """(n, 2) where between the cells the peaks are: the tops of parabolas."""
    tops = places.astype(np.float64)
    for axis in (0, 1):
        inside = (places[:, axis] > 0) & (places[:, axis] < sums.shape[axis] - 1)
        at, step = places[inside], np.eye(2, dtype=np.int64)[axis]
        before, here, after = (sums[tuple((at + k * step).T)] for k in (-1, 0, 1))
        bend = before - 2 * here + after
        bent = bend < 0
        tops[np.flatnonzero(inside)[bent], axis] += (before - after)[bent] / (2 * bend[bent])
    return tops
