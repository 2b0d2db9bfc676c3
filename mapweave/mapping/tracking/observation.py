"""A scan, prepared: its lines, grouped into generalized polylines, and its oriented points."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from pydantic import Field

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.geometry.sectors import Sector, within
from mapweave.lines.polylines import group_polylines
from mapweave.maps import LineMap
from mapweave.parameters import StageParameters, derived
from mapweave.scan.loose_things import loose_things
from mapweave.scan.points import OrientedPoints, join_points, scan_points
from mapweave.scan.scan import Scan
from mapweave.scan.segmentation import ScanSegments, SegmentationParameters, extract_segments
from mapweave.scan.visibility import beams_at


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
    loose_width: float = Field(
        1.0, ge=0, description="[m] what stands free and is no wider may move, or have been moved"
    )
    loose_gap: float = derived(
        lambda c: c.mapping.closeness, gt=0, description="[m] that it is before all beside it"
    )
    sight: float = derived(
        lambda c: c.mapping.far_range,
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
        The scan itself, without readings that the sensor cannot have made.
    found
        Its segments, in beam order.
    oriented
        The oriented points of its returns; `polyline` names the segment of each.
    walls
        The same with points between them where they lie on one segment: what to remember.
    loose
        (m,) which of `walls` are on things that may move; first come those of `oriented`.
    max_gap
        [m] within a generalized polyline.
    """

    scan: Scan
    found: ScanSegments
    oriented: OrientedPoints
    walls: OrientedPoints
    loose: BoolArray
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
    def is_loose(self) -> BoolArray:
        """Which of `oriented` are on things that may move."""
        return self.loose[: len(self.oriented)]

    def has_walls(self, least: int, share: float) -> bool:
        """Whether `least` of its returns, and that `share` of them, are on what cannot move."""
        solid = np.count_nonzero(~self.is_loose)
        return bool(solid >= max(least, share * len(self.oriented)))

    def relying_on(self, known: BoolArray) -> "Observation":
        """Return what it shows of what cannot move, and of things those that are `known` (n,)."""
        kept = np.flatnonzero(~self.is_loose | known)
        some = self.oriented.at(kept)
        return replace(self, oriented=some, walls=some, loose=self.loose[kept])

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
    scan = measured(scan, p)
    found = extract_segments(scan, p.segments)
    oriented, between = scan_points(scan, found, p.sight, p.spacing)
    walls = join_points([oriented, between])
    loose = loose_things(scan, p.loose_width, p.loose_gap)[beams_at(scan, walls.points)] >= 0
    return Observation(scan, found, oriented, walls, loose, p.max_gap)


def measured(scan: Scan, parameters: ObservationParameters) -> Scan:
    """Return `scan` with no return for each reading that is none of what is around the robot."""
    p = parameters
    with np.errstate(invalid="ignore"):
        left_out = (scan.ranges >= p.max_range) | (scan.ranges < p.min_range)
    if p.masks:
        left_out |= within(scan.angles, p.masks) & scan.hits
    if not left_out.any():
        return scan
    return replace(scan, ranges=np.where(left_out, np.nan, scan.ranges))
