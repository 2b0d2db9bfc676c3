"""Oriented points: samples of seen surfaces with the normals towards the side they were seen from.

What the alignment works on. A scan and a map are compared by their oriented points, so that a
wall seen from one side never pulls at the same wall's other side.
"""

from dataclasses import dataclass

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
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
        (n,) the generalized polyline each point is on; -1 for none.
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


def scan_surface(
    scan: Scan, segments: ScanSegments, polyline: IntArray, max_range: float
) -> OrientedPoints:
    """Return the oriented points of a scan, sensor frame.

    A return on a segment takes the segment's normal; another, its neighbours'. Returns without
    a neighbour near enough have no direction and are left out.

    Parameters
    ----------
    scan
        One sweep.
    segments
        Its n segments.
    polyline
        (n,) the generalized polyline of each segment.
    max_range
        [m] beyond which returns are left out.
    """
    with np.errstate(invalid="ignore"):
        used = np.flatnonzero(scan.hits & (scan.ranges <= max_range))
    points = scan.points[used]
    if len(used) < 2:
        return OrientedPoints(np.empty((0, 2)), np.empty((0, 2)), np.empty(0, dtype=np.int64))
    directions = _neighbour_directions(points)
    label = segments.label[used]
    on_segment = label >= 0
    lines = segments.segments[label[on_segment]]
    directions[on_segment] = lines[:, 2:] - lines[:, :2]
    of_polyline = np.full(len(used), -1)
    of_polyline[on_segment] = polyline[label[on_segment]]
    oriented = np.hypot(*directions.T) > 0
    return OrientedPoints(
        points[oriented], left_normals(directions[oriented]), of_polyline[oriented]
    )


def surface_between(
    scan: Scan, segments: ScanSegments, polyline: IntArray, max_range: float, spacing: float
) -> OrientedPoints:
    """Return oriented points between the returns of `scan` on each segment, sensor frame.

    Far along a wall the returns are metres apart. Were they all that is remembered of it, a later
    scan would fit best where its returns fall on the same places again: where nothing moved.

    Parameters
    ----------
    scan
        One sweep.
    segments
        Its n segments.
    polyline
        (n,) the generalized polyline of each segment.
    max_range
        [m] beyond which returns are left out.
    spacing
        [m] that two neighbouring points are apart at the most, returns included.
    """
    with np.errstate(invalid="ignore"):
        used = np.flatnonzero((segments.label >= 0) & (scan.ranges <= max_range))
    points, label = scan.points[used], segments.label[used]
    step = np.diff(points, axis=0)
    count = np.maximum(0, np.ceil(np.hypot(*step.T) / spacing).astype(np.int64) - 1)
    count[label[1:] != label[:-1]] = 0
    owner = np.repeat(np.arange(len(count)), count)
    rank = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    fraction = (rank + 1) / (count[owner] + 1)
    lines = segments.segments[label[owner]]
    normals = left_normals(lines[:, 2:] - lines[:, :2])
    between = points[owner] + fraction[:, None] * step[owner]
    return OrientedPoints(between, normals, polyline[label[owner]])


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
    segments = lines.segments
    directions = segments[:, 2:] - segments[:, :2]
    lengths = np.hypot(directions[:, 0], directions[:, 1])
    counts = np.maximum(1, np.round(lengths / spacing)).astype(np.int64)
    owner = np.repeat(np.arange(len(segments)), counts)
    rank = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    fraction = (rank + 0.5) / counts[owner]
    points = segments[owner, :2] + fraction[:, None] * directions[owner]
    return OrientedPoints(points, left_normals(directions)[owner], lines.polyline[owner]), owner


def _neighbour_directions(points: FloatArray) -> FloatArray:
    """(n, 2) from the previous to the next return; zero where both are too far away."""
    forward = np.vstack([np.diff(points, axis=0), np.zeros((1, 2))])
    forward[np.hypot(*forward.T) > MAX_NEIGHBOUR_GAP] = 0
    directions: FloatArray = forward + np.vstack([np.zeros((1, 2)), forward[:-1]])
    return directions
