"""A submap while it grows: G_t from G_(t-1) and S_t (paper, V and VI)."""

import copy
import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from pydantic import Field
from shapely.geometry.base import BaseGeometry

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.geometry.segments import lengths
from mapweave.lines.fitting import FittingParameters
from mapweave.lines.merging import MergingParameters, count_support, evolve, evolving_map
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
from mapweave.scan.faint_surfaces import FaintSurfaceParameters, up_to_faint_surfaces
from mapweave.scan.free_space import FreeSpaceParameters, rings, seen_free
from mapweave.scan.scan import Scan
from mapweave.scan.visibility import sights_of


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
    faint: FaintSurfaceParameters = derived(FaintSurfaceParameters.of)
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


class _Merged(NamedTuple):
    """(m, 4) merged segments [m], their (m,) weights, and (n,) in which each sighting is."""

    segments: FloatArray
    weights: FloatArray
    labels: IntArray


class SubmapBuilder:
    """Takes placed scans and merges them into lines; its frame is that of its first scan."""

    def __init__(self, parameters: SubmapParameters) -> None:
        self._parameters = parameters
        self._map = evolving_map(np.empty((0, 4)), np.empty(0), parameters.merging)
        self._moved: _Merged | None = None  # once its scans were moved, or it was sent
        self._sightings: list[FloatArray] = []  # of each scan, in the submap's frame
        self._viewpoints: list[Viewpoint] = []  # where scans cleared space
        self._witnesses = no_witnesses(parameters.change_detection)  # the same for segments
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

    def moved_to(self, poses: FloatArray) -> "SubmapBuilder":
        """Return the same scans at other poses; it takes no more scans.

        What was merged stays merged, moves with what it was merged from, and is merged with what
        now lies on it. The lines are placed anew in any case, on all that was seen.

        Parameters
        ----------
        poses
            (n, 3) [m, m, rad], in the order of the trajectory.
        """
        at = poses[np.argsort(np.argsort(self._indices))]
        moves = se2.compose(at, se2.inverse(np.array(self._poses).reshape(-1, 3)))
        moved = SubmapBuilder(self._parameters)
        moved._moved = self._merged_again(moves)
        moved._sightings = [
            _each_moved(np.tile(move, (len(seen), 1)), seen)
            for move, seen in zip(moves, self._sightings, strict=True)
        ]
        moved._indices, moved._stamps = self._indices, self._stamps
        moved._poses, moved._uncertainties = list(at), self._uncertainties
        moved._path, moved._turned = self._path, self._turned
        pose_of = dict(zip(self._indices, at, strict=True))
        for viewpoint in self._viewpoints:
            moved._see(replace(viewpoint, pose=pose_of[viewpoint.scan.index]))
        return moved

    def _merged_again(self, moves: FloatArray) -> _Merged:
        """Return the merged segments, each moved as its sightings are, by their lengths."""
        segments, weights, labels = self._merged()
        move = np.repeat(moves, [len(seen) for seen in self._sightings], axis=0)
        weight = lengths(np.concatenate([np.empty((0, 4)), *self._sightings]))
        ends = _each_moved(move, segments[labels]) * weight[:, None]
        total = np.bincount(labels, weight, minlength=len(segments))
        sums = [np.bincount(labels, values, minlength=len(segments)) for values in ends.T]
        placed = np.column_stack(sums) / total[:, None]
        again = evolve(placed, weights, self._parameters.merging)
        return _Merged(again.segments, again.weights, again.labels[labels])

    def _merged(self) -> _Merged:
        if self._moved is not None:
            return self._moved
        return _Merged(self._map.segments(), self._map.weights(), self._map.labels())

    def __deepcopy__(self, memo: dict[int, object]) -> "SubmapBuilder":
        """Return one that goes on by itself; it is not sent, so it still takes scans."""
        other = object.__new__(SubmapBuilder)
        other.__dict__ = copy.deepcopy(self.__dict__, memo)
        return other

    def __getstate__(self) -> dict[str, object]:
        """Return what another process needs: it takes no more scans there."""
        state = {**self.__dict__, "_moved": self._merged()}
        del state["_map"], state["_witnesses"]  # compiled; the one is spent, the other made anew
        return state

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self._witnesses = no_witnesses(self._parameters.change_detection)
        for viewpoint in self._viewpoints:
            add_witness(self._witnesses, viewpoint, self._parameters.change_detection)

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
        free = self._free_space()
        standing = self._standing()
        kept = np.flatnonzero(np.isin(standing.owner[self._merged().labels], standing.left))
        sightings = np.concatenate([np.empty((0, 4)), *self._sightings])[kept]
        scans = self._scans()[kept]
        once = np.ones(len(kept), dtype=np.int64)
        walls = simplify(standing.segments[standing.left], sightings, once, free, p.simplification)
        wall, source = sources(walls, sightings, p.simplification)
        found, labels = np.unique(wall, return_inverse=True)
        lines = self._grouped(walls[found], *self._still_there(walls[found], labels, scans[source]))
        return replace(lines, free_space=rings(free))

    def outline(self) -> LineMap:
        """Return the lines, not simplified, and the free space: what recognising a place takes."""
        return replace(self.lines(), free_space=rings(self._free_space()))

    def _free_space(self) -> BaseGeometry:
        """Return what was seen through so far."""
        p, places = self._parameters.free_space, self._viewpoints
        poses = np.array([w.pose for w in places]).reshape(-1, 3)
        scans = up_to_faint_surfaces([w.scan for w in places], poses, self._parameters.faint)
        return seen_free(sights_of(scans, poses, p.sight), p)

    def lines(self) -> LineMap:
        """Return the lines alone, not simplified: fast enough for every scan."""
        standing = self._standing()
        return self._grouped(standing.segments, standing.left, standing.support)

    def _standing(self) -> _Standing:
        """Return what was merged, whose slivers are, and what was not seen through since."""
        segments, _, labels = self._merged()
        owner = owners(segments, self._parameters.slivers)
        whole = np.flatnonzero(owner == np.arange(len(owner)))
        if self._moved is None:
            support, last = (of_each[whole] for of_each in self._map.seen(owner))
            numbers = self._map.numbers()[whole]
            denied = self._witnesses.count_numbered(numbers, segments[whole], last)
        else:
            place, scans = np.searchsorted(whole, owner[labels]), self._scans()
            support, last = count_support(place, scans), last_sightings(place, scans)
            denied = self._witnesses.count(segments[whole], last)
        left, remaining = not_vanished(support, denied, self._parameters.change_detection)
        return _Standing(segments, owner, whole[left], remaining)

    def _scans(self) -> IntArray:
        """(n,) the scan of each sighting."""
        counts = [len(segments) for segments in self._sightings]
        return np.repeat(np.array(self._indices, dtype=np.int64), counts)

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
        if self._viewpoints:
            step, turn = _motion(self._viewpoints[-1].pose, pose)
            if step < p.free_space_step and turn < p.free_space_turn:
                return
        self._see(Viewpoint(scan, pose))

    def _see(self, viewpoint: Viewpoint) -> None:
        self._viewpoints.append(viewpoint)
        add_witness(self._witnesses, viewpoint, self._parameters.change_detection)


def _motion(start: FloatArray, end: FloatArray) -> tuple[float, float]:
    """Return how far a pose is from another [m], and how much it is turned [rad]."""
    x, y, turn = (end - start).tolist()
    return math.hypot(x, y), abs(math.remainder(turn, 2 * math.pi))


def _each_moved(moves: FloatArray, segments: FloatArray) -> FloatArray:
    """(n, 4) `segments`, each moved by a motion of its own, (n, 3) [m, m, rad]."""
    x, y, turn = moves.T
    c, s = np.cos(turn), np.sin(turn)
    first, second = segments[:, :2].T, segments[:, 2:].T
    ends = [(c * u - s * v + x, s * u + c * v + y) for u, v in (first, second)]
    return np.column_stack([*ends[0], *ends[1]])
