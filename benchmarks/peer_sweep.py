"""Peer: a sweep over rotations, each shift by correlation of the grids' walls through the FFT.

The textbook way (Birk and Carpin 2006 search the same score by hill climbing): all turns in steps,
all shifts at once, the best correlation wins; then once more around it, finer.
"""

from dataclasses import dataclass

import numpy as np
from scipy import fft, ndimage

from benchmarks.peer_types import Guess, Peer, View
from benchmarks.peer_views import thin
from mapweave.geometry import se2
from mapweave.geometry.arrays import Float32Array, FloatArray

COARSE, FINE = 0.2, 0.1  # [m] cells
COARSE_TURNS = np.radians(np.arange(0.0, 360.0, 2.0))
FINE_TURNS = np.radians(np.arange(-2.0, 2.01, 0.5))
BLUR = 1.0  # [cells] standard deviation
ROOM = 6  # [cells] between grids side by side: further than a blurred wall reaches
THRESHOLD = 0.4  # of the correlation coefficient; ours, as no package comes with one


@dataclass(frozen=True, slots=True, eq=False)
class Walls:
    """(n, 2) points of wall, one a cell, coarse and fine [m]."""

    coarse: FloatArray
    fine: FloatArray


def sweep_peer() -> Peer:
    """Return the sweep."""
    return Peer("FFT rotation sweep", THRESHOLD, _prepare, _match)


def _prepare(view: View) -> Walls:
    return Walls(thin(view.walls, COARSE), thin(view.walls, FINE))


def _match(first: Walls, second: Walls) -> Guess | None:
    coarse = correlate(first.coarse, second.coarse, COARSE_TURNS, COARSE)
    return correlate(first.fine, second.fine, coarse.transform[2] + FINE_TURNS, FINE)


def correlate(first: FloatArray, second: FloatArray, turns: FloatArray, cell: float) -> Guess:
    """Return the best of all shifts by whole cells and the (k,) `turns` of `second` [rad].

    Its score is the correlation coefficient of the two blurred grids, the cosine of the angle
    between them: 1 for equal ones.
    """
    size, corner = _size(first, second, cell), first.min(axis=0)
    blurred = _blur(_raster(first - corner, size, cell))
    fixed = fft.rfft2(_blur(blurred))  # twice: the second grid's blur, moved over
    best = Guess(np.zeros(3), -1.0)
    for turn in turns:
        turned = second @ se2.rotation(float(turn)).T
        low = turned.min(axis=0)
        moving = fft.rfft2(_raster(turned - low, size, cell))
        overlap = fft.irfft2(fixed * moving.conj(), size)
        peak = np.unravel_index(int(overlap.argmax()), overlap.shape)
        if overlap[peak] > best.score:
            shift = _signed(peak, first, size, cell) + corner - low
            best = Guess(np.array([*shift, turn]), float(overlap[peak]))
    own = _blur(_raster(second - second.min(axis=0), size, cell))
    return Guess(best.transform, best.score / float(np.linalg.norm(blurred) * np.linalg.norm(own)))


def _size(first: FloatArray, second: FloatArray, cell: float) -> tuple[int, int]:
    """Return rows and columns that hold both grids side by side, however `second` is turned."""
    middle = (second.min(axis=0) + second.max(axis=0)) / 2
    reach = np.ptp(first, axis=0) + 2 * np.hypot(*(second - middle).T).max()
    columns, rows = (fft.next_fast_len(int(r / cell) + 2 * ROOM, real=True) for r in reach)
    return rows, columns


def _raster(points: FloatArray, size: tuple[int, int], cell: float) -> Float32Array:
    raster = np.zeros(size, dtype=np.float32)
    column, row = (points / cell + 0.5).astype(np.int64).T
    raster[row, column] = 1.0
    return raster


def _blur(raster: Float32Array) -> Float32Array:
    return np.asarray(ndimage.gaussian_filter(raster, BLUR, mode="wrap"), dtype=np.float32)


def _signed(
    peak: tuple[np.intp, ...], first: FloatArray, size: tuple[int, int], cell: float
) -> FloatArray:
    """Return the (2,) shift x, y [m] at a row and column: beyond the first grid it is negative."""
    shift, whole = np.array(peak[::-1]), np.array(size[::-1])
    beyond = shift > np.ptp(first, axis=0) / cell + ROOM
    return np.asarray(np.where(beyond, shift - whole, shift) * cell)
