"""A scan, prepared: its lines, grouped into generalized polylines, and its oriented points."""

import math
from dataclasses import dataclass, replace

import numpy as np

from mapweave.geometry.sectors import Sector, within
from mapweave.lines.polylines import group_polylines
from mapweave.maps import LineMap
from mapweave.parameters import StageParameters, derived
from mapweave.scan.points import OrientedPoints, join_points, scan_surface, surface_between
from mapweave.scan.scan import Scan
from mapweave.scan.segmentation import ScanSegments, SegmentationParameters, extract_segments


class ObservationParameters(StageParameters):
    """What is used of a scan."""

    max_range: float = derived(
        lambda c: math.inf if c.sensor.max_range is None else c.sensor.max_range,
        gt=0,
        description="[m] readings at or beyond it are no returns",
    )
    min_range: float = derived(
        lambda c: c.sensor.range_min,
        ge=0,
        description="[m] readings nearer than it are no returns",
    )
    masks: tuple[Sector, ...] = derived(
        lambda c: c.sensor.masks,
        description="[°] directions in which the sensor sees the robot itself",
    )
    segments: SegmentationParameters = derived(SegmentationParameters.of)
    max_gap: float = derived(
        lambda c: c.mapping.max_gap, gt=0, description="[m] within a generalized polyline"
    )
    spacing: float = derived(
        lambda c: 2 * c.mapping.resolution,
        gt=0,
        description="[m] between points on walls, at the most",
    )
    sight: float = derived(
        lambda c: c.mapping.far_range,
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
        The scan itself, without readings that the sensor cannot have made.
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
    scan = _measured(scan, parameters)
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


def _measured(scan: Scan, parameters: ObservationParameters) -> Scan:
    """Return `scan` with no return for each reading that is none of what is around the robot."""
    p = parameters
    with np.errstate(invalid="ignore"):
        left_out = (scan.ranges >= p.max_range) | (scan.ranges < p.min_range)
    if p.masks:
        left_out |= within(scan.angles, p.masks) & scan.hits
    if not left_out.any():
        return scan
    return replace(scan, ranges=np.where(left_out, np.nan, scan.ranges))
