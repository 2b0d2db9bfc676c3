"""A submap while it grows: G_t from G_(t-1) and S_t (paper, V and VI)."""

import math
from dataclasses import dataclass, replace

import numpy as np
from pydantic import Field
from shapely.geometry.base import BaseGeometry

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.lines.fitting import FittingParameters
from mapweave.lines.merging import MergingParameters, count_support, evolving_map
from mapweave.lines.polylines import group_polylines
from mapweave.lines.selection import SelectionParameters
from mapweave.lines.simplification import SimplificationParameters, simplify, sources
from mapweave.lines.slivers import SliverParameters, owners
from mapweave.mapping.change_detection import (
    ChangeDetectionParameters,
    Viewpoint,
    add_witness,
    last_sightings,
    no_witnesses,
    not_vanished,
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


@dataclass(frozen=True, slots=True, eq=False)
class _Standing:
    """What has not vanished of the merged segments, slivers absorbed.

    Attributes
    ----------
    segments
        (m, 4) all that are merged, slivers too [m].
    owner
        (m,) which of them takes each over.
    left
        (k,) which of them are left, ascending.
    support
        (k,) how many scans saw each, less those that saw through it.
    """

    segments: FloatArray
    owner: IntArray
    left: IntArray
    support: IntArray


class SubmapBuilder:
    """Takes placed scans and merges them into lines; its frame is that of its first scan."""

    def __init__(self, parameters: SubmapParameters) -> None:
        self._parameters = parameters
        self._map = evolving_map(np.empty((0, 4)), np.empty(0), parameters.merging)
        self._sightings: list[FloatArray] = []  # of each scan, in the submap's frame
        self._cleared: list[BaseGeometry] = []
        self._witnesses = no_witnesses(parameters.change_detection)  # the scans that cleared it
        self._witness_pose: FloatArray | None = None  # of the last
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
            step, turn = _motion(self._poses[-1], pose)
            self._path += step
            self._turned += turn
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
        p = self._parameters
        free = unite(self._cleared, p.free_space)
        standing = self._standing()
        kept = np.flatnonzero(np.isin(standing.owner[self._map.labels()], standing.left))
        counts = [len(segments) for segments in self._sightings]
        sightings = np.concatenate([np.empty((0, 4)), *self._sightings])[kept]
        scans = np.repeat(np.array(self._indices, dtype=np.int64), counts)[kept]
        once = np.ones(len(kept), dtype=np.int64)
        walls = simplify(standing.segments[standing.left], sightings, once, free, p.simplification)
        wall, source = sources(walls, sightings, p.simplification)
        found, labels = np.unique(wall, return_inverse=True)
        lines = self._grouped(walls[found], *self._still_there(walls[found], labels, scans[source]))
        return replace(lines, free_space=rings(free))

    def lines(self) -> LineMap:
        """Return the lines alone, not simplified: fast enough for every scan."""
        standing = self._standing()
        return self._grouped(standing.segments, standing.left, standing.support)

    def _standing(self) -> _Standing:
        segments = self._map.segments()
        owner = owners(segments, self._parameters.slivers)
        whole = np.flatnonzero(owner == np.arange(len(owner)))
        support, last = self._map.seen(owner)
        numbers = self._map.numbers()[whole]
        denied = self._witnesses.count_numbered(numbers, segments[whole], last[whole])
        left, remaining = not_vanished(support[whole], denied, self._parameters.change_detection)
        return _Standing(segments, owner, whole[left], remaining)

    def _still_there(
        self, segments: FloatArray, labels: IntArray, scans: IntArray
    ) -> tuple[IntArray, IntArray]:
        """Return which segments were not seen through since they were seen, and their support."""
        denied = self._witnesses.count(segments, last_sightings(labels, scans))
        support = count_support(labels, scans)
        return not_vanished(support, denied, self._parameters.change_detection)

    def _grouped(self, segments: FloatArray, left: IntArray, support: IntArray) -> LineMap:
        order, polyline = group_polylines(segments[left], self._parameters.max_gap)
        return LineMap(segments[left[order]], polyline, support[order])

    def _merge(self, scan: int, segments: FloatArray) -> None:
        self._map.merge_scan(np.ascontiguousarray(segments), scan)
        self._sightings.append(segments)

    def _clear(self, scan: Scan, pose: FloatArray) -> None:
        """Note what `scan` saw through, unless a scan from about here did already."""
        p = self._parameters
        if self._witness_pose is not None:
            step, turn = _motion(self._witness_pose, pose)
            if step < p.free_space_step and turn < p.free_space_turn:
                return
        self._cleared.append(scan_free_space(scan, pose, p.free_space))
        self._witness_pose = pose
        add_witness(self._witnesses, Viewpoint(scan, pose), p.change_detection)


def _motion(start: FloatArray, end: FloatArray) -> tuple[float, float]:
    """Return how far a pose is from another [m], and how much it is turned [rad]."""
    x, y, turn = (end - start).tolist()
    return math.hypot(x, y), abs(math.remainder(turn, 2 * math.pi))
