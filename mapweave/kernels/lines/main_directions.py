"""Main directions: the significant peaks of the histogram of segment directions (paper, VI-A)."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np
import scipy
from numpy.typing import ArrayLike

from mapweave.kernels.arrays import FloatArray, IntArray
from mapweave.kernels.loading import COMPILED

LINE_PERIOD = np.pi


@dataclass(frozen=True, slots=True)
class DirectionRules:
    """How the histogram is made and which of its peaks count.

    Attributes
    ----------
    bins
        Of [0, pi).
    smoothing
        Standard deviation [rad].
    significance
        Least height of a peak over that of a uniform histogram.
    separation
        Least depth of the valleys beside a peak, as a share of its height.
    """

    bins: int
    smoothing: float
    significance: float
    separation: float


def numpy_main_directions(
    segments: FloatArray, weights: FloatArray, rules: DirectionRules
) -> FloatArray:
    """Return (k,) main directions [rad] in [0, pi), ascending, of (n, 4) `segments` [m].

    Each segment counts with its (n,) weight.
    """
    asked = segments, weights, rules.bins, LINE_PERIOD, rules.smoothing
    histogram = direction_histogram_numpy(*asked)
    if not histogram.any():
        return np.empty(0)
    angles = _angles(segments)
    rough = _significant_peaks(histogram, rules) * LINE_PERIOD / rules.bins
    fine = [_mean_about(peak, angles, weights, 2 * rules.smoothing) for peak in rough]
    return np.sort(np.mod(fine, LINE_PERIOD))


def direction_histogram_numpy(
    segments: FloatArray, weights: FloatArray, bins: int, period: float, smoothing: float
) -> FloatArray:
    """Twin of `direction_histogram`."""
    index = np.rint(_angles(segments) * bins / period).astype(np.int64) % bins
    raw = np.bincount(index, weights, minlength=bins).astype(np.float64)
    return np.asarray(scipy.ndimage.gaussian_filter1d(raw, smoothing * bins / period, mode="wrap"))


def direction_histogram(
    segments: FloatArray, weights: FloatArray, bins: int, period: float, smoothing: float
) -> FloatArray:
    """Return the (bins,) smoothed circular histogram; bin i is centred at ``i * period / bins``.

    Parameters
    ----------
    segments, weights
        (n, 4) x1 y1 x2 y2 [m]; (n,) what each counts.
    smoothing
        Standard deviation [rad].

    Raises
    ------
    ValueError
        Where lengths do not agree, or a number is not finite.
    """
    if COMPILED is None:
        return direction_histogram_numpy(segments, weights, bins, period, smoothing)
    given = np.ascontiguousarray(segments), np.ascontiguousarray(weights)
    return cast("FloatArray", COMPILED.direction_histogram(*given, bins, period, smoothing))


def likely_turns_numpy(
    reference: FloatArray, other: FloatArray, count: int, separation: float, least: float
) -> FloatArray:
    """Twin of `likely_turns`."""
    bins = np.arange(len(reference))
    likely = reference[(bins[:, None] + bins) % len(bins)] @ other
    peaks = np.flatnonzero((likely >= np.roll(likely, 1)) & (likely > np.roll(likely, -1)))
    peaks = peaks[likely[peaks] >= least * likely.max()]
    kept: list[float] = []
    for peak in peaks[np.argsort(-likely[peaks], kind="stable")].tolist():
        turn = (peak * 2 * np.pi / len(bins) + np.pi) % (2 * np.pi) - np.pi
        if all(np.cos(turn - each) < np.cos(separation) for each in kept):
            kept.append(turn)
    return np.array(kept[:count])


def likely_turns(
    reference: FloatArray, other: FloatArray, count: int, separation: float, least: float
) -> FloatArray:
    """Return (k,) turns, in [-pi, pi), at which most wall of two maps is parallel.

    The likeliest first: peaks of the circular correlation of the histograms of their directions.

    Parameters
    ----------
    reference, other
        (bins,) histograms of a full turn.
    count, separation
        How many at most, and how far apart [rad].
    least
        Share of the parallel wall of the likeliest that each must have.

    Raises
    ------
    ValueError
        Where lengths do not agree.
    """
    compute = likely_turns_numpy if COMPILED is None else COMPILED.likely_turns
    return cast("FloatArray", compute(reference, other, count, separation, least))


def line_difference(first: ArrayLike, second: ArrayLike) -> FloatArray:
    """Return the turn from line direction `second` to `first` [rad], in [-pi/2, pi/2)."""
    turn = np.asarray(first, dtype=float) - np.asarray(second, dtype=float)
    return np.asarray(np.mod(turn + LINE_PERIOD / 2, LINE_PERIOD) - LINE_PERIOD / 2)


def nearest_direction(angle: ArrayLike, directions: FloatArray, tolerance: float) -> FloatArray:
    """Return the one of (k,) `directions` nearest to each angle, NaN where none is near [rad]."""
    asked = np.asarray(angle, dtype=float)
    if not len(directions):
        return np.full(asked.shape, np.nan)
    difference = np.abs(line_difference(asked[..., None], directions))
    nearest = np.argmin(difference, axis=-1)
    return np.where(difference.min(axis=-1) <= tolerance, directions[nearest], np.nan)


def _angles(segments: FloatArray) -> FloatArray:
    return np.arctan2(segments[:, 3] - segments[:, 1], segments[:, 2] - segments[:, 0])


def _significant_peaks(histogram: FloatArray, rules: DirectionRules) -> IntArray:
    """Return the bins that stand out of the level of a uniform histogram and of their valleys."""
    bins = len(histogram)
    around = np.tile(histogram, 3)  # no peak is cut at the ends, no valley missed
    starts = np.flatnonzero(np.append(True, np.diff(around) != 0))  # of runs of equal bins
    ends = np.append(starts[1:], len(around)) - 1
    level = around[starts]
    top = np.flatnonzero((level[1:-1] > level[:-2]) & (level[1:-1] > level[2:])) + 1
    peaks = (starts[top] + ends[top]) // 2
    peaks = peaks[(peaks >= bins) & (peaks < 2 * bins)]
    peaks = peaks[around[peaks] >= rules.significance * histogram.mean()]
    deep = [_prominence(around, k) >= rules.separation * around[k] for k in peaks.tolist()]
    return np.asarray(peaks[np.array(deep, dtype=np.bool_)] - bins)


def _prominence(around: FloatArray, peak: int) -> float:
    """Return how far a peak stands above the higher one of the valleys beside it."""
    higher = np.flatnonzero(around > around[peak])
    left = higher[higher < peak].max(initial=-1) + 1
    right = higher[higher > peak].min(initial=len(around))
    valleys = around[left : peak + 1].min(), around[peak:right].min()
    return float(around[peak] - max(valleys))


def _mean_about(peak: float, angles: FloatArray, mass: FloatArray, reach: float) -> float:
    """Return the weighted mean direction [rad] of what lies within `reach` of `peak`."""
    turn = line_difference(angles, peak)
    near = np.where(np.abs(turn) <= reach, mass, 0.0)
    total = float(near.sum())
    return float(peak + np.dot(near, turn) / total) if total > 0 else peak


if TYPE_CHECKING or COMPILED is None:
    main_directions = numpy_main_directions
else:
    main_directions = COMPILED.main_directions
