"""Oriented points: samples of seen surfaces with the normals towards the side they were seen from.

What the alignment works on. A scan and a map are compared by their oriented points, so that a
wall seen from one side never pulls at the same wall's other side.
"""

from dataclasses import dataclass

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.kernels.lines.sampling import sample_lines
from mapweave.kernels.segmentation import orient
from mapweave.maps import LineMap
from mapweave.scan.scan import Scan
from mapweave.scan.segmentation import ScanSegments

MAX_NEIGHBOUR_GAP = 0.5  # [m] two returns farther apart do not tell a surface's direction


@dataclass(frozen=True, slots=True, eq=False)
class OrientedPoints:
    """Oriented points in one frame.

    Attributes
    ----------
    points
        (n, 2) [m].
    normals
        (n, 2) unit vectors towards the visible side.
    polyline
        (n,) the generalized polyline, or the segment, that each point is on; -1 for none.
    """

    points: FloatArray
    normals: FloatArray
    polyline: IntArray

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.points)

    def moved(self, pose: FloatArray) -> "OrientedPoints":
        """Return the same points, given in the frame at `pose` (3,), in that frame's parent."""
        normals: FloatArray = self.normals @ se2.rotation(pose[2]).T
        return OrientedPoints(se2.transform_points(pose, self.points), normals, self.polyline)

    def at(self, index: IntArray | BoolArray | slice) -> "OrientedPoints":
        """Return the points that `index`, of numbers or a mask (n,), selects."""
        return OrientedPoints(self.points[index], self.normals[index], self.polyline[index])


def join_points(oriented: list[OrientedPoints]) -> OrientedPoints:
    """Return all points of `oriented`, which share a frame."""
    return OrientedPoints(
        np.concatenate([s.points for s in oriented]),
        np.concatenate([s.normals for s in oriented]),
        np.concatenate([s.polyline for s in oriented]),
    )


def left_normals(directions: FloatArray) -> FloatArray:
    """Return (n, 2) unit normals on the left, the visible side, of (n, 2) `directions`."""
    lengths = np.maximum(np.hypot(directions[:, 0], directions[:, 1]), 1e-12)
    normals: FloatArray = np.column_stack([-directions[:, 1], directions[:, 0]]) / lengths[:, None]
    return normals


def scan_points(
    scan: Scan, segments: ScanSegments, max_range: float, spacing: float
) -> tuple[OrientedPoints, OrientedPoints]:
    """Return the oriented points of `scan`, and points between them on its segments.

    Sensor frame; `polyline` names the segment that each is on. A return on a segment takes the
    segment's normal; another, its neighbours'. Returns without a neighbour near enough have no
    direction and are left out.

    Far along a wall the returns are metres apart. Were they all that is remembered of it, a later
    scan would fit best where its returns fall on the same places again: where nothing moved. So
    there are points between.

    Parameters
    ----------
    scan
        One sweep.
    segments
        Its n segments.
    max_range
        [m] beyond which returns are left out.
    spacing
        [m] that two neighbouring points on a segment are apart at the most, returns included.
    """
    returns, between = orient(
        scan.angles,
        scan.ranges,
        segments.segments,
        segments.label,
        max_range,
        MAX_NEIGHBOUR_GAP,
        spacing,
    )
    return OrientedPoints(*returns), OrientedPoints(*between)


def points_on_lines(lines: LineMap, spacing: float) -> tuple[OrientedPoints, IntArray]:
    """Return oriented points along the segments of a map.

    Parameters
    ----------
    lines
        The map; its frame is that of the points.
    spacing
        [m] between points, about; each segment has one at least.

    Returns
    -------
    tuple of OrientedPoints and IntArray
        The points, and (n,) which segment each is on.
    """
    points, normals, owner, _ = sample_lines(lines.segments, spacing)
    return OrientedPoints(points, normals, lines.polyline[owner]), owner
