"""Main directions: the significant peaks of the histogram of segment directions (paper, VI-A).

A wall counts for the direction of its line, modulo pi, so that its two faces add up. The same
histogram modulo 2 pi keeps the visible sides apart and serves rotation hypotheses.
"""

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry.arguments import as_segments, as_values
from mapweave.geometry.arrays import FloatArray
from mapweave.geometry.segments import lengths
from mapweave.kernels.lines import main_directions as kernel
from mapweave.kernels.lines.main_directions import LINE_PERIOD, DirectionRules, line_difference

DIRECTED_PERIOD = 2 * np.pi
TURN_BINS = 360  # in which turns are looked for: 1° each

__all__ = [
    "DIRECTED_PERIOD",
    "LINE_PERIOD",
    "DirectionParameters",
    "direction_histogram",
    "likely_turns",
    "line_difference",
    "main_directions",
    "mirrored_turns",
    "nearest_direction",
    "turn_histogram",
]


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

    @property
    def rules(self) -> DirectionRules:
        """The same as plain numbers."""
        return DirectionRules(self.bins, self.smoothing, self.significance, self.separation)


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
    mass = lengths(segments) if weights is None else weights
    return kernel.direction_histogram(segments, mass, bins, period, smoothing)


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
    mass = (
        lengths(given) if weights is None else as_values("weights", weights, len(given), "segment")
    )
    return kernel.main_directions(
        np.ascontiguousarray(given), np.ascontiguousarray(mass), chosen.rules
    )


def turn_histogram(segments: FloatArray) -> FloatArray:
    """Return the histogram (360,) of the directions of (n, 4) `segments` [m].

    Directed, so that half a turn is not the same. Of a map compared with many it is made once.
    """
    return direction_histogram(segments, bins=TURN_BINS, period=DIRECTED_PERIOD)


def mirrored_turns(histogram: FloatArray) -> FloatArray:
    """Return the histogram, as of `turn_histogram`, of a map of which y is -y.

    What is on the left of a wall is on its right then: it runs the other way.
    """
    return histogram[(TURN_BINS // 2 - np.arange(TURN_BINS)) % TURN_BINS]


def likely_turns(
    reference: FloatArray, other: FloatArray, count: int, separation: float, least: float = 0.0
) -> FloatArray:
    """Return the turns that make the walls of `other` parallel to those of `reference`.

    Peaks of the circular correlation of the histograms of their directions.

    Parameters
    ----------
    reference, other
        As of `turn_histogram`.
    count
        How many turns at most.
    separation
        [rad] between any two.
    least
        Share of the parallel wall of the likeliest that each must have.

    Returns
    -------
    FloatArray
        (k,) [rad] in [-pi, pi), the likeliest first.
    """
    return kernel.likely_turns(reference, other, count, separation, least)


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
    return kernel.nearest_direction(angle, directions, tolerance)
