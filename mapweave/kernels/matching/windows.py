"""Windows of maps, which of two maps' are alike, and the motions that lay one on the other."""

import itertools
from typing import NamedTuple, cast

import numpy as np

from mapweave.kernels.arrays import ComplexArray, FloatArray, IntArray
from mapweave.kernels.loading import COMPILED


class WindowSamples(NamedTuple):
    """Windows: (k,) straightness, (k,) places in their order, (k, m, 2) samples [m].

    Successive places are neighbours.
    """

    straightness: FloatArray
    place: IntArray
    points: FloatArray


class AlikePairs(NamedTuple):
    """Pairs of windows: (p,) numbers, gain, similarity, (p, 3) motion, (p,) rms residual [m]."""

    row: IntArray
    column: IntArray
    gain: FloatArray
    similarity: FloatArray
    transform: FloatArray
    residual: FloatArray


def sample_windows_numpy(
    segments: FloatArray, begin: FloatArray, length: float, samples: int
) -> tuple[ComplexArray, FloatArray]:
    """Twin of `sample_windows`."""
    steps = segments[:, 2:] - segments[:, :2]
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    ends = np.cumsum(lengths)
    at = begin[:, None] + length * (np.arange(samples) + 0.5) / samples
    segment = np.minimum(np.searchsorted(ends, at, side="right"), len(ends) - 1)
    unit = steps / np.where(lengths > 0, lengths, 1)[:, None]
    along = at - (ends - lengths)[segment]
    points = segments[segment, :2] + along[..., None] * unit[segment]
    return (unit[:, 0] + 1j * unit[:, 1])[segment], points


def sample_windows(
    segments: FloatArray, begin: FloatArray, length: float, samples: int
) -> tuple[ComplexArray, FloatArray]:
    """Return exp(i · direction) (k, m) and place (k, m, 2) [m] of the samples of windows.

    Each stands for the middle of an equal share of its window.

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], in order; none has no windows.
    begin
        (k,) where windows begin: the arc length from the first segment's start on [m].
    length
        Of a window [m].
    samples
        How many a window has.
    """
    compute = sample_windows_numpy if COMPILED is None else COMPILED.sample_windows
    found = compute(np.ascontiguousarray(segments), begin, length, samples)
    return cast("tuple[ComplexArray, FloatArray]", found)


def alike_windows_numpy(
    product: ComplexArray,
    rows: WindowSamples,
    columns: WindowSamples,
    min_similarity: float,
    min_gain: float,
) -> AlikePairs:
    """Twin of `alike_windows`."""
    row, column = np.nonzero(product.real**2 + product.imag**2 >= min_similarity**2)
    found = product[row, column]
    similarity = np.minimum(np.abs(found), 1)
    gain = similarity - np.maximum(rows.straightness[row], columns.straightness[column])
    gain = np.where(gain > min_gain, gain, -np.inf).round(9).astype(np.float64)
    peak = _peaks(gain, rows.place[row], columns.place[column])
    row, column, rotation = row[peak], column[peak], np.angle(found[peak])
    transform, residual = _fit(rows.points[row], columns.points[column], rotation)
    return AlikePairs(row, column, gain[peak], similarity[peak], transform, residual)


def alike_windows(
    product: ComplexArray,
    rows: WindowSamples,
    columns: WindowSamples,
    min_similarity: float,
    min_gain: float,
) -> AlikePairs:
    """Return the pairs that are alike and that no neighbouring pair beats.

    Neighbours, one place away in one or both maps, stand for the same alignment; of equal ones the
    first stays. Gains are rounded, so that which of equals is the first does not hang on the maps'
    frames.

    Parameters
    ----------
    product
        (r, c) similarity of each pair, times exp(i · rotation).
    rows, columns
        The windows of both maps.
    min_similarity, min_gain
        Least similarity, and least similarity beyond that of either to a straight line.
    """
    if COMPILED is None:
        return alike_windows_numpy(product, rows, columns, min_similarity, min_gain)
    found = COMPILED.alike_windows(
        np.ascontiguousarray(product).view(np.float64).reshape(*product.shape, 2),
        *(rows.straightness, columns.straightness, rows.place, columns.place),
        *(rows.points, columns.points, min_similarity, min_gain),
    )
    return AlikePairs(*found)


def _peaks(gain: FloatArray, row: IntArray, column: IntArray) -> IntArray:
    """Return which pairs no neighbouring pair beats; of equal neighbours the first stays.

    Parameters
    ----------
    gain
        (p,) of each pair; -inf where it is out of the question.
    row, column
        (p,) places of its windows, ascending.
    """
    laid_out = np.full((row.max(initial=0) + 2, column.max(initial=0) + 2), -np.inf)
    laid_out[row, column] = gain
    peak = np.flatnonzero(gain > -np.inf)
    for down, right in itertools.product((-1, 0, 1), repeat=2):
        if (down, right) == (0, 0):
            continue
        beside = laid_out[row[peak] + down, column[peak] + right]
        own = gain[peak]
        peak = peak[own > beside if (down, right) < (0, 0) else own >= beside]
    return peak


def _fit(a: FloatArray, b: FloatArray, rotation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the (p, 3) rigid motions from b to a with given rotations, and their rms [m] (V1)."""
    ours, theirs = (points[..., 0] + 1j * points[..., 1] for points in (a, b))
    apart = ours - np.exp(1j * rotation)[:, None] * theirs
    shift = apart.mean(axis=1)
    residual = np.sqrt(np.mean(np.abs(apart - shift[:, None]) ** 2, axis=1))
    return np.column_stack([shift.real, shift.imag, rotation]), residual
