"""A scan, prepared: its lines, grouped into generalized polylines, and its oriented points."""

from dataclasses import dataclass

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave.lines.polylines import group_polylines
from mapweave.maps import LineMap
from mapweave.scan.points import OrientedPoints, join_points, scan_surface, surface_between
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


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """A scan with what was made of it, all in the sensor's frame.

    Attributes
    ----------
    scan
        The scan itself.
    lines
        Its segments as generalized polylines (paper, V).
    surface
        The oriented points of its returns, each knowing its polyline.
    walls
        The same with points between them where they lie on one segment: what to remember.
    """

    scan: Scan
    lines: LineMap
    oriented: OrientedPoints
    walls: OrientedPoints


def observe(scan: Scan, parameters: ObservationParameters) -> Observation:
    """Approximate `scan` with segments and group them (paper, V, the first two steps)."""
    found = extract_segments(scan, parameters.segments)
    order, polyline = group_polylines(found.segments, parameters.max_gap)
    rank = np.argsort(order)
    label = np.where(found.label >= 0, rank[found.label] if len(rank) else -1, -1)
    ordered = ScanSegments(found.segments[order], label)
    support = np.ones(len(order), dtype=np.int64)
    lines = LineMap(ordered.segments, polyline, support)
    oriented = scan_surface(scan, ordered, polyline, parameters.sight)
    between = surface_between(scan, ordered, polyline, parameters.sight, parameters.spacing)
    return Observation(scan, lines, oriented, join_points([oriented, between]))
