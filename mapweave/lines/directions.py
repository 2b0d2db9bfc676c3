"""Main directions: the significant peaks of the histogram of segment directions (paper, VI-A).

A wall counts for the direction of its line, modulo pi, so that its two faces add up. The same
histogram modulo 2 pi keeps the visible sides apart and serves rotation hypotheses.
"""

import numpy as np
import scipy
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry.arguments import as_segments, as_values
from mapweave.geometry.arrays import FloatArray, IntArray

LINE_PERIOD = np.pi
DIRECTED_PERIOD = 2 * np.pi


class DirectionParameters(BaseModel):
    """How the direction histogram is made and which of its peaks are significant."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    bins: int = Field(default=180, ge=8, description="bins of [0, pi); 1° each")
    smoothing: float = Field(
        default=np.deg2rad(1.5),
        gt=0,
        description="standard deviation of the smoothing [rad]; the direction noise of a 1 m"
        " segment of a laser with 1–2 cm noise",
    )
    significance: float = Field(
        default=3.0,
        gt=1,
        description="height of a main direction over that of a uniform histogram; 3 asks for 6 %"
        " of the wall in one direction and lets chance peaks of round walls pass by",
    )
    separation: float = Field(
        default=0.5,
        gt=0,
        le=1,
        description="depth of the valleys beside a peak, as a share of its height; drops shoulders",
    )


def direction_histogram(
    segments: FloatArray,
    weights: FloatArray | None = None,
    *,
    bins: int = 180,
    period: float = LINE_PERIOD,
    smoothing: float = np.deg2rad(1.5),
) -> FloatArray:
    """Return the smoothed circular histogram of segment directions (paper, VI-A).

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m].
    weights
        (n,) what each contributes; by default its length [m], as in the paper.
    bins
        How many; bin i is centred at ``i * period / bins``.
    period
        ``pi`` for directions of lines, ``2 * pi`` for directed segments.
    smoothing
        Standard deviation of the Gaussian [rad].

    Returns
    -------
    FloatArray
        (bins,), summing to the sum of the weights.
    """
    angles, lengths = _angles_and_lengths(segments)
    index = np.rint(angles * bins / period).astype(np.int64) % bins
    raw = np.bincount(index, lengths if weights is None else weights, minlength=bins)
    return np.asarray(scipy.ndimage.gaussian_filter1d(raw, smoothing * bins / period, mode="wrap"))


def main_directions(
    segments: ArrayLike,
    weights: ArrayLike | None = None,
    parameters: DirectionParameters | None = None,
) -> FloatArray:
    """Return the main directions: significant peaks of the direction histogram (paper, VI-A).

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], or (n, 2) the vertices of one polyline [m].
    weights
        (n,) what each segment contributes; by default its length [m].
    parameters
        What a significant peak is.

    Returns
    -------
    FloatArray
        (k,) angles [rad] in [0, pi), ascending; empty where no direction stands out.

    Raises
    ------
    ArgumentError
        If `segments` or `weights` has another shape, or holds NaN or infinity.

    Examples
    --------
    >>> np.degrees(main_directions([[0, 0], [5, 0], [5, 3], [0, 3]]))
    array([ 0., 90.])
    """
    chosen = parameters or DirectionParameters()
    given = as_segments("segments", segments)
    angles, lengths = _angles_and_lengths(given)
    mass = lengths if weights is None else as_values("weights", weights, len(given), "segment")
    histogram = direction_histogram(given, mass, bins=chosen.bins, smoothing=chosen.smoothing)
    if not histogram.any():
        return np.empty(0)
    rough = _significant_peaks(histogram, chosen) * LINE_PERIOD / chosen.bins
    fine = [_mean_about(peak, angles, mass, 2 * chosen.smoothing) for peak in rough]
    return np.sort(np.mod(fine, LINE_PERIOD))


def likely_turns(
    reference: FloatArray, other: FloatArray, count: int, separation: float
) -> FloatArray:
    """Return the turns that make the walls of `other` parallel to those of `reference`.

    Directed segments, so that half a turn is not the same: peaks of the circular correlation of
    the two histograms.

    Parameters
    ----------
    reference, other
        (n, 4) and (m, 4) x1 y1 x2 y2 [m].
    count
        How many turns at most.
    separation
        [rad] between any two.

    Returns
    -------
    FloatArray
        (k,) [rad] in [-pi, pi), the likeliest first.
    """
    bins = 360
    ours, theirs = (
        np.fft.rfft(direction_histogram(segments, bins=bins, period=DIRECTED_PERIOD))
        for segments in (reference, other)
    )
    likely = np.fft.irfft(ours * theirs.conj(), bins)
    peaks = np.flatnonzero((likely >= np.roll(likely, 1)) & (likely > np.roll(likely, -1)))
    kept: list[float] = []
    for peak in peaks[np.argsort(-likely[peaks], kind="stable")]:
        turn = float(np.mod(peak * DIRECTED_PERIOD / bins + np.pi, DIRECTED_PERIOD) - np.pi)
        if all(np.cos(turn - other_turn) < np.cos(separation) for other_turn in kept):
            kept.append(turn)
    return np.array(kept[:count])


def nearest_direction(angle: ArrayLike, directions: FloatArray, tolerance: float) -> FloatArray:
    """Return the direction of a line nearest to each angle, NaN where none is near.

    Parameters
    ----------
    angle
        (...) [rad], of lines or segments.
    directions
        (k,) to choose from [rad], modulo pi.
    tolerance
        The largest difference [rad].

    Returns
    -------
    FloatArray
        (...) elements of `directions`, or NaN.
    """
    asked = np.asarray(angle, dtype=float)
    if not len(directions):
        return np.full(asked.shape, np.nan)
    difference = np.abs(line_difference(asked[..., None], directions))
    nearest = np.argmin(difference, axis=-1)
    return np.where(difference.min(axis=-1) <= tolerance, directions[nearest], np.nan)


def line_difference(first: ArrayLike, second: ArrayLike) -> FloatArray:
    """Return the turn from line direction `second` to `first` [rad], in [-pi/2, pi/2)."""
    turn = np.asarray(first, dtype=float) - np.asarray(second, dtype=float)
    return np.asarray(np.mod(turn + LINE_PERIOD / 2, LINE_PERIOD) - LINE_PERIOD / 2)


def _angles_and_lengths(segments: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (n,) directions [rad] and (n,) lengths [m]."""
    dx, dy = segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1]
    return np.arctan2(dy, dx), np.hypot(dx, dy)


def _significant_peaks(histogram: FloatArray, parameters: DirectionParameters) -> FloatArray:
    """Return the bins that stand out of the level of a uniform histogram and of their valleys."""
    bins = len(histogram)
    around = np.tile(histogram, 3)  # no peak is cut at the ends, no valley missed
    peaks = local_maxima(around)
    peaks = peaks[around[peaks] >= parameters.significance * histogram.mean()]
    deep = prominences(around, peaks) >= parameters.separation * around[peaks]
    once = (peaks >= bins) & (peaks < 2 * bins)
    return np.asarray(peaks[deep & once] - bins, dtype=np.float64)


def local_maxima(values: FloatArray) -> IntArray:
    """Return (k,) where `values` (n,) are higher than on both sides; the middle of a plateau."""
    edges = np.flatnonzero(values[1:] != values[:-1])
    first, last = np.concatenate([[0], edges + 1]), np.concatenate([edges, [len(values) - 1]])
    level = values[first]
    higher = (level[1:-1] > level[:-2]) & (level[1:-1] > level[2:])
    middle: IntArray = (first[1:-1][higher] + last[1:-1][higher]) // 2
    return middle


def prominences(values: FloatArray, peaks: IntArray) -> FloatArray:
    """Return (k,) how far `peaks` (k,) stand out of the higher one of the valleys beside them.

    A valley reaches from the peak to the next place that is higher than the peak, or to the end.
    """
    depths = np.empty(len(peaks))
    for k, peak in enumerate(peaks.tolist()):
        higher = np.flatnonzero(values > values[peak])
        at = int(np.searchsorted(higher, peak))
        start = higher[at - 1] + 1 if at else 0
        end = higher[at] if at < len(higher) else len(values)
        depths[k] = values[peak] - max(values[start : peak + 1].min(), values[peak:end].min())
    return depths


def _mean_about(peak: float, angles: FloatArray, mass: FloatArray, reach: float) -> float:
    """Return the weighted mean direction [rad] of what lies within `reach` of `peak`."""
    turn = line_difference(angles, peak)
    near = np.where(np.abs(turn) <= reach, mass, 0.0)
    return float(peak + np.dot(near, turn) / near.sum())
