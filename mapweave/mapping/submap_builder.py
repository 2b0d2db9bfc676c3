"""A submap while it grows: G_t from G_(t-1) and S_t (paper, V and VI)."""

from dataclasses import dataclass, replace

import numpy as np
from pydantic import Field
from shapely.geometry.base import BaseGeometry

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.lines.fitting import FittingParameters
from mapweave.lines.merging import MergingParameters, count_support, merge_scan
from mapweave.lines.polylines import group_polylines
from mapweave.lines.selection import SelectionParameters
from mapweave.lines.simplification import SimplificationParameters, simplify, sources
from mapweave.lines.slivers import SliverParameters, absorb_slivers
from mapweave.mapping.change_detection import (
    ChangeDetectionParameters,
    Viewpoint,
    last_sightings,
    still_there,
)
from mapweave.mapping.tracking.pose_covariance import EXACT
from mapweave.maps import LineMap, Trajectory
from mapweave.parameters import StageParameters, derived
from mapweave.scan.free_space import FreeSpaceParameters, rings, scan_free_space, unite
from mapweave.scan.scan import Scan


class SubmapParameters(StageParameters):
    """What goes into a submap and when it is finished."""

    length: float = derived(
        lambda c: c.mapping.submap_length,
        gt=0,
        description="[m] of path that finish a submap; drift inside is negligible",
    )
    max_turn: float = Field(25.0, gt=0, description="[rad] of turning that finish one")
    max_scans: int = derived(
        lambda c: c.mapping.submap_scans, ge=1, description="placed scans that finish one"
    )
    max_gap: float = derived(
        lambda c: c.mapping.max_gap, gt=0, description="[m] within a generalized polyline"
    )
    free_space_step: float = Field(0.2, gt=0, description="[m] of motion between free-space scans")
    free_space_turn: float = derived(
        lambda c: c.mapping.keyframe_turn, gt=0, description="[rad] of rotation between them: 15°"
    )
    merging: MergingParameters = derived(MergingParameters.of)
    free_space: FreeSpaceParameters = derived(FreeSpaceParameters.of)
    change_detection: ChangeDetectionParameters = derived(ChangeDetectionParameters.of)
    slivers: SliverParameters = derived(SliverParameters.of)
    # Poses err less here than among submaps; and what is little here may be much together.
    simplification: SimplificationParameters = derived(
        lambda c: SimplificationParameters.of(
            c,
            placement=FittingParameters.of(c, tolerance=3.5 * c.sensor.range_sigma),
            selection=SelectionParameters.of(c, tolerance=3.5 * c.sensor.range_sigma, price=0.03),
        )
    )


@dataclass(slots=True)
class _Seen:
    """Segments as scans saw them, (n, 4) [m]; which scan, and which merged segment they are in."""

    segments: FloatArray
    labels: IntArray
    scans: IntArray

    @classmethod
    def none(cls) -> "_Seen":
        return cls(np.empty((0, 4)), np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))


class SubmapBuilder:
    """Takes placed scans and merges them into lines; its frame is that of its first scan."""

    def __init__(self, parameters: SubmapParameters) -> None:
        self._parameters = parameters
        self._segments: FloatArray = np.empty((0, 4))
        self._weights: FloatArray = np.empty(0)
        self._sightings = _Seen.none()
        self._cleared: list[BaseGeometry] = []
        self._witnesses: list[Viewpoint] = []
        self._indices: list[int] = []
        self._stamps: list[float] = []
        self._poses: list[FloatArray] = []
        self._uncertainties: list[FloatArray] = []
        self._path = 0.0
        self._turned = 0.0

    @property
    def is_empty(self) -> bool:
        """Whether no scan was added yet."""
        return not self._poses

    @property
    def is_full(self) -> bool:
        """Whether the next scan belongs into another submap."""
        p = self._parameters
        return (
            self._path >= p.length or self._turned >= p.max_turn or len(self._poses) >= p.max_scans
        )

    def add(
        self,
        scan: Scan,
        segments: FloatArray,
        pose: FloatArray,
        uncertainty: FloatArray = EXACT,
    ) -> None:
        """Merge `scan` with its (k, 4) `segments` [m], sensor frame, taken at `pose` (3,).

        The (4,) `uncertainty` of the pose, as of a `Trajectory`, is kept with it.
        """
        if self._poses:
            step = se2.between(self._poses[-1], pose)
            self._path += float(np.hypot(step[0], step[1]))
            self._turned += abs(float(step[2]))
        self._indices.append(scan.index)
        self._stamps.append(scan.stamp)
        self._poses.append(pose)
        self._uncertainties.append(uncertainty)
        self._merge(scan.index, se2.transform_segments(pose, segments))
        self._clear(scan, pose)

    def trajectory(self) -> Trajectory:
        """Return the poses of the scans added, in order of their index."""
        order = np.argsort(self._indices)
        return Trajectory(
            np.array(self._indices, dtype=np.int64)[order],
            np.array(self._stamps)[order],
            np.array(self._poses).reshape(-1, 3)[order],
            np.array(self._uncertainties).reshape(-1, 4)[order],
        )

    def line_map(self) -> LineMap:
        """Return the lines, simplified, and the free space seen so far."""
        p, seen = self._parameters, self._sightings
        free = unite(self._cleared, p.free_space)
        merged, labels, left, _ = self._standing()
        kept = np.flatnonzero(np.isin(labels, left))
        sightings, scans = seen.segments[kept], seen.scans[kept]
        once = np.ones(len(kept), dtype=np.int64)
        walls = simplify(merged[left], sightings, once, free, p.simplification)
        wall, source = sources(walls, sightings, p.simplification)
        found, labels = np.unique(wall, return_inverse=True)
        lines = self._grouped(walls[found], *self._still_there(walls[found], labels, scans[source]))
        return replace(lines, free_space=rings(free))

    def lines(self) -> LineMap:
        """Return the lines alone, not simplified: fast enough for every scan."""
        merged, _, left, support = self._standing()
        return self._grouped(merged, left, support)

    def _standing(self) -> tuple[FloatArray, IntArray, IntArray, IntArray]:
        """Return merged segments, whose each sighting is, which are left, and their support."""
        whole = absorb_slivers(self._segments, self._weights, self._parameters.slivers)
        labels = whole.labels[self._sightings.labels]
        left, support = self._still_there(whole.segments, labels, self._sightings.scans)
        return whole.segments, labels, left, support

    def _still_there(
        self, segments: FloatArray, labels: IntArray, scans: IntArray
    ) -> tuple[IntArray, IntArray]:
        """Return which segments were not seen through since they were seen, and their support."""
        support, last = count_support(labels, scans), last_sightings(labels, scans)
        return still_there(
            segments, support, last, self._witnesses, self._parameters.change_detection
        )

    def _grouped(self, segments: FloatArray, left: IntArray, support: IntArray) -> LineMap:
        order, polyline = group_polylines(segments[left], self._parameters.max_gap)
        return LineMap(segments[left][order], polyline, support[order])

    def _merge(self, scan: int, segments: FloatArray) -> None:
        evolution = merge_scan(self._segments, self._weights, segments, self._parameters.merging)
        known = evolution.labels[: len(self._segments)]
        fresh = evolution.labels[len(self._segments) :]
        self._sightings = _Seen(
            np.concatenate([self._sightings.segments, segments]),
            np.concatenate([known[self._sightings.labels], fresh]),
            np.concatenate([self._sightings.scans, np.full(len(fresh), scan)]),
        )
        self._segments, self._weights = evolution.segments, evolution.weights

    def _clear(self, scan: Scan, pose: FloatArray) -> None:
        """Note what `scan` saw through, unless a scan from about here did already."""
        p = self._parameters
        if self._witnesses:
            x, y, turn = se2.between(self._witnesses[-1].pose, pose)
            if np.hypot(x, y) < p.free_space_step and abs(turn) < p.free_space_turn:
                return
        self._cleared.append(scan_free_space(scan, pose, p.free_space))
        self._witnesses.append(Viewpoint(scan, pose))
