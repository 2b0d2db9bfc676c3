"""A scan, prepared: its lines, grouped into generalized polylines, and its oriented points."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.lines.polylines import group_polylines
from mapweave.maps import LineMap
from mapweave.scan.points import OrientedPoints, join_points, scan_points
from mapweave.scan.scan import Scan
from mapweave.scan.segmentation import ScanSegments, SegmentationParameters, extract_segments


class ObservationParameters(BaseModel):
    """What is used of a scan."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    segments: SegmentationParameters = SegmentationParameters()
    max_gap: float = Field(0.5, gt=0, description="[m] within a generalized polyline")
    spacing: float = Field(0.2, gt=0, description="[m] between points on walls, at the most")
    sight: float = Field(
        25.0,
        gt=0,
        description="[m] returns up to here are aligned: the end of a corridor is all"
        " that tells how far along it a robot is",
    )


@dataclass(frozen=True, eq=False)
class Observation:
    """A scan with what was made of it, all in the sensor's frame.

    Attributes
    ----------
    scan
        The scan itself.
    found
        Its segments, in beam order.
    oriented
        The oriented points of its returns; `polyline` names the segment of each.
    walls
        The same with points between them where they lie on one segment: what to remember.
    max_gap
        [m] within a generalized polyline.
    """

    scan: Scan
    found: ScanSegments
    oriented: OrientedPoints
    walls: OrientedPoints
    max_gap: float

    @property
    def segments(self) -> FloatArray:
        """(n, 4) its segments [m], in beam order."""
        return self.found.segments

    @cached_property
    def lines(self) -> LineMap:
        """Its segments as generalized polylines (paper, V): only where shapes are asked."""
        order, polyline = self._grouped
        return LineMap(self.segments[order], polyline, np.ones(len(order), dtype=np.int64))

    @property
    def on_lines(self) -> OrientedPoints:
        """The points that are on segments, each knowing its polyline in `lines`."""
        order, polyline = self._grouped
        of_segment = np.empty_like(polyline)
        of_segment[order] = polyline
        held = self.oriented.at(self.oriented.polyline >= 0)
        return OrientedPoints(held.points, held.normals, of_segment[held.polyline])

    @cached_property
    def _grouped(self) -> tuple[IntArray, IntArray]:
        return group_polylines(self.segments, self.max_gap)


def observe(scan: Scan, parameters: ObservationParameters) -> Observation:
    """Approximate `scan` with segments, and orient its returns (paper, V, the first step)."""
    p = parameters
    found = extract_segments(scan, p.segments)
    oriented, between = scan_points(scan, found, p.sight, p.spacing)
    return Observation(scan, found, oriented, join_points([oriented, between]), p.max_gap)
