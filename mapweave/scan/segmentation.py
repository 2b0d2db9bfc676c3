"""Scan to line segments, directed so that the visible side is known (paper, V).

Split and merge: consecutive returns are cut into runs where the range jumps, each run is split
at its farthest point until it is straight, neighbouring pieces that one line explains are merged
again, and every piece is fitted by total least squares. Beams run counter-clockwise, so a segment
in beam order has the sensor, and with it the visible side, on its left.
"""

from dataclasses import dataclass

from pydantic import Field

from mapweave.geometry.arguments import check_kind
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.kernels import segmentation
from mapweave.kernels.segmentation import SegmentationSettings
from mapweave.parameters import StageParameters, derived
from mapweave.scan.scan import Scan


class SegmentationParameters(StageParameters):
    """How returns become segments."""

    max_range: float = derived(
        lambda c: 1.2 * c.mapping.far_range,
        gt=0,
        description="[m] farther returns are left out: their spacing hides the shape",
    )
    max_jump: float = Field(
        0.25, gt=0, description="[m] between neighbouring returns of one surface, at close range"
    )
    grazing: float = Field(
        0.12,
        gt=0,
        description="[rad] flattest angle at which a beam still meets a surface: neighbouring"
        " returns of one surface lie at most range x spacing / sin(grazing) apart",
    )
    tolerance: float = derived(
        lambda c: 2 * c.sensor.range_sigma,
        gt=0,
        description="[m] largest deviation of a return from its segment (SICK: 1-2 cm)",
    )
    relative_tolerance: float = Field(
        0.004, ge=0, description="[m/m] what the tolerance grows with range"
    )
    min_points: int = Field(3, ge=2, description="fewest returns of a segment")
    min_length: float = Field(0.1, ge=0, description="[m] shortest segment")


@dataclass(frozen=True, slots=True, eq=False)
class ScanSegments:
    """The segments of a scan.

    Attributes
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], sensor frame, in beam order, visible side on the left.
    label
        (beams,) index of the segment that each beam's return belongs to; -1 for none.
    """

    segments: FloatArray
    label: IntArray


def extract_segments(scan: Scan, parameters: SegmentationParameters | None = None) -> ScanSegments:
    """Approximate the returns of `scan` by directed line segments (paper, V, first step).

    Parameters
    ----------
    scan
        The scan; beams that did not come back belong to no segment.
    parameters
        How returns become segments.

    Returns
    -------
    ScanSegments
        In the sensor's frame [m], in beam order, with the segment of each beam.

    Raises
    ------
    ArgumentError
        If it is no scan.

    Examples
    --------
    >>> import numpy as np
    >>> angles = np.linspace(-0.5, 0.5, 60)
    >>> wall = Scan(2 / np.cos(angles), angles)  # 2 m ahead, seen from the origin
    >>> extract_segments(wall).segments.round(2)
    array([[ 2.  , -1.09,  2.  ,  1.09]])
    """
    check_kind("scan", scan, Scan)
    p = parameters or SegmentationParameters()
    settings = SegmentationSettings(
        p.max_range,
        p.max_jump,
        p.grazing,
        p.tolerance,
        p.relative_tolerance,
        p.min_points,
        p.min_length,
    )
    return ScanSegments(*segmentation.extract_segments(scan.angles, scan.ranges, settings))


def fit_segment(points: FloatArray) -> FloatArray:
    """Return the segment that fits points best by total least squares.

    Parameters
    ----------
    points
        (k, 2) [m], k at least 2, in beam order.

    Returns
    -------
    FloatArray
        (4,) x1 y1 x2 y2 [m], directed as the points come.
    """
    return segmentation.fit_segment(points)
