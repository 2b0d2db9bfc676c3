"""Settling: what becomes of a submap once it is finished, beside the tracking of the next.

Its component is joined to an older one where what both saw proves it, loops are closed, its scans
are refined against each other and against the walls that they saw again, and merged once more along
the better poses. The mapper adopts the outcome when the next submap is finished, at a defined
scan, so a log gives the same map however long settling takes and wherever it runs.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.mapping.component_merging import ComponentMerger, ComponentMergingParameters
from mapweave.mapping.drifted_paths import SURE, carried, found_again, is_near
from mapweave.mapping.kidnap_detection import KidnapDetectionParameters, KidnapDetector, Kidnapping
from mapweave.mapping.localization.fragments import FragmentFinder, FragmentParameters
from mapweave.mapping.loops.loop_closing import LoopCloser, LoopParameters
from mapweave.mapping.submap_builder import SubmapBuilder, SubmapParameters
from mapweave.mapping.tracking.observation import Observation
from mapweave.mapping.tracking.pose_covariance import EXACT
from mapweave.maps import LineMap, Submap, Trajectory
from mapweave.matching.multiview_icp import MultiviewIcpParameters, refine
from mapweave.parameters import StageParameters, derived
from mapweave.scan.points import OrientedPoints, join_points, points_on_lines


class BackendParameters(StageParameters):
    """One model for each stage."""

    submap: SubmapParameters = derived(SubmapParameters.of)
    component_merging: ComponentMergingParameters = derived(ComponentMergingParameters.of)
    fragments: FragmentParameters = derived(FragmentParameters.of)
    loops: LoopParameters = derived(LoopParameters.of)
    kidnapping: KidnapDetectionParameters = derived(KidnapDetectionParameters.of)
    refinement: MultiviewIcpParameters = derived(MultiviewIcpParameters.of)
    spacing: float = derived(
        lambda c: c.mapping.resolution, gt=0, description="[m] between points on older walls"
    )


@dataclass(frozen=True, slots=True, eq=False)
class FinishedSubmap:
    """A submap as tracking left it.

    Attributes
    ----------
    submap
        The newest; its id is the count of those before it.
    scans
        The scans of its trajectory, in that order.
    growing
        What it was built by.
    follows
        Whether it was tracked from the submap before it.
    spare
        The number of a component, if another one is needed.
    parameters
        To settle it with: those of all submaps of a run.
    """

    submap: Submap
    scans: tuple[Observation, ...]
    growing: SubmapBuilder
    follows: bool
    spare: int
    parameters: BackendParameters


@dataclass(frozen=True, slots=True, eq=False)
class BackendResult:
    """Where everything is, now that the newest submap is settled.

    Attributes
    ----------
    component
        (n,) of each submap.
    pose
        (n, 3) of each submap in its component's frame [m, m, rad].
    renewed
        The last submap, its scans refined and merged again; in two where it was found that the
        robot jumped meanwhile.
    newest_component
        The highest number of a component that was used, joined since or not.
    is_held
        Whether the newest submap was found again in an older one that had not drifted.
    """

    component: IntArray
    pose: FloatArray
    renewed: tuple[Submap, ...]
    newest_component: int
    is_held: bool = False

    def applied(self, submaps: Sequence[Submap]) -> list[Submap]:
        """Return `submaps`, those settled so far, at their new poses."""
        *older, _ = submaps
        count = len(older)
        placed = [
            replace(s, component=component, pose=pose)
            for s, component, pose in zip(
                older, self.component[:count].tolist(), self.pose[:count], strict=True
            )
        ]
        return [*placed, *self.renewed]


class BackendRunner(Protocol):
    """Settles one submap at a time, here or in another process."""

    def begin(self, finished: FinishedSubmap) -> None:
        """Take the next submap; the outcome of the one before must have been taken."""

    @property
    def is_ready(self) -> bool:
        """Whether `take` returns at once."""

    def take(self) -> BackendResult | None:
        """Wait for the outcome and return it; None if there is none."""


class Backend:
    """Settles at once, where it is called; `known` are submaps to go on from, ids from 0.

    With the parameters of the first submap: by then a lidar may have been found to be noisy.
    """

    def __init__(self, parameters: BackendParameters, known: Sequence[Submap] = ()) -> None:
        self._known = tuple(known)
        self._settled: BackendResult | None = None
        self._begin_with(parameters)

    def _begin_with(self, parameters: BackendParameters) -> None:
        known = self._known
        self._parameters = parameters
        self._submaps = list(known)
        self._component_merger = ComponentMerger(parameters.component_merging, len(known))
        self._fragments = FragmentFinder(parameters.fragments)
        self._loops = LoopCloser(parameters.loops)
        self._loops.graph.take_over(known)
        self._kidnap_detector = KidnapDetector(parameters.kidnapping)
        self._tracked = 0  # how many of the last submaps were tracked from one another

    def begin(self, finished: FinishedSubmap) -> None:
        """Settle the next submap."""
        self._settled = self.settle(finished)

    @property
    def is_ready(self) -> bool:
        """Always: `begin` has settled it."""
        return True

    def take(self) -> BackendResult | None:
        """Return the outcome."""
        return self._settled

    def settle(self, finished: FinishedSubmap) -> BackendResult:
        """Join, close, refine and merge again."""
        if finished.parameters != self._parameters:
            self._begin_with(finished.parameters)
        count = len(self._submaps)
        submaps = [*self._submaps, finished.submap]
        if finished.follows and count:
            self._loops.graph.track(submaps[-2], submaps[-1])
        self._tracked = self._tracked + 1 if finished.follows else 1
        compared = self._loops.compare(submaps)
        oriented = [seen.oriented for seen in finished.scans]
        at = self._kidnap_detector.find(submaps, oriented, compared, finished.follows and count > 0)
        parts = [_Part(finished.submap, finished.scans, finished.growing)]
        if at is not None:
            parts = _cut(finished, at, self._parameters.submap)
            submaps = self._departed(submaps, at, [part.submap for part in parts])
            jumped = submaps[-1] if len(parts) == 2 else submaps[at.submap]
            self._component_merger.note_jump(int(jumped.trajectory.scan_index[0]))
            self._tracked = submaps[-1].id - at.submap + 1 if len(parts) == 1 else 1
        submaps, joints = self._joined(submaps, parts)
        for older, younger in joints:
            self._loops.graph.join(submaps[older], submaps[younger])
        if joints or at is not None:
            self._kidnap_detector.forget()
        submaps = self._loops.close(submaps, compared if at is None and not joints else None)
        is_held = self._is_held(submaps[-1])
        renewed = [self._refined(submaps, submaps[count + k], part) for k, part in enumerate(parts)]
        self._submaps = [*submaps[:count], *renewed]
        component = np.array([s.component for s in self._submaps])
        poses = np.array([s.pose for s in self._submaps])
        newest = finished.submap.component if at is None else finished.spare
        return BackendResult(component, poses, tuple(renewed), newest, is_held)

    def _joined(
        self, submaps: list[Submap], parts: Sequence["_Part"]
    ) -> tuple[list[Submap], list[tuple[int, int]]]:
        """Join components: a fragment where single scans of it are found, others by their shapes.

        Returns the submaps, and for each join the ids of one of the older, one of the younger.
        """
        for part in parts:
            self._fragments.note(part.submap, part.scans)
        taken = self._fragments.take_up(submaps)
        if taken is None:
            return self._component_merger.reunite(submaps, self._tracked)
        self._component_merger.forget()
        submaps, joints = self._component_merger.reunite(taken.submaps, self._tracked)
        return submaps, [taken.joint, *joints]

    def _is_held(self, newest: Submap) -> bool:
        """Whether the newest submap is linked with an older one, not the last, that was sure."""
        p = self._parameters.loops
        older = [k for k in self._loops.graph.neighbours(newest.id) if k < newest.id - 1]
        return is_near(newest.trajectory, p.max_drift, p.max_turn) and any(
            carried(self._submaps[k].trajectory) <= SURE for k in older
        )

    def _departed(
        self, submaps: Sequence[Submap], at: Kidnapping, parts: Sequence[Submap]
    ) -> list[Submap]:
        """Return `submaps`, the last in `parts`: none of those from `at` on is tracked to there."""
        *older, _ = submaps
        if len(parts) == 2:
            return [*self._loops.close([*older, parts[0]]), parts[1]]
        kept = self._loops.graph.part(submaps, at.submap)
        component = parts[0].component
        gone = [replace(s, component=component) for s in older[at.submap :]]
        return [*kept, *gone, *parts]

    def _refined(self, submaps: Sequence[Submap], newest: Submap, part: "_Part") -> Submap:
        """Refine `newest` against those of `submaps` it is linked with."""
        p = self._parameters
        linked = [submaps[k] for k in self._loops.graph.neighbours(newest.id)]
        poses = refine(
            [seen.oriented for seen in part.scans],
            newest.trajectory.pose,
            _walls(linked, newest.pose, p.spacing),
            p.refinement,
        )
        growing = part.growing.moved_to(poses)
        trajectory = growing.trajectory()
        if self._is_held(newest):
            trajectory = found_again(trajectory)
        return replace(newest, map=growing.line_map(), trajectory=trajectory)


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """A finished submap or a part of one, with its scans and what it was built by."""

    submap: Submap
    scans: tuple[Observation, ...]
    growing: SubmapBuilder


def _cut(finished: FinishedSubmap, at: Kidnapping, parameters: SubmapParameters) -> list[_Part]:
    """Return the parts of a submap before and from `at` on.

    The latter is in a component anew; the former is left out where it is empty.
    """
    submap, scans = finished.submap, finished.scans
    if at.submap < submap.id or at.scan == 0:
        return [_Part(replace(submap, component=finished.spare), scans, finished.growing)]
    numbers = (submap.id, submap.component), (submap.id + 1, finished.spare)
    spans = slice(at.scan), slice(at.scan, None)
    parts = []
    for (number, component), span in zip(numbers, spans, strict=True):
        path = _part(submap.trajectory, span)
        growing = _merged(scans[span], path.pose, path.uncertainty, parameters)
        lines = growing.line_map()
        part = replace(submap, id=number, component=component, map=lines, trajectory=path)
        parts.append(_Part(part, scans[span], growing))
    return parts


def _part(trajectory: Trajectory, chosen: slice) -> Trajectory:
    held = trajectory.uncertainty
    return Trajectory(
        trajectory.scan_index[chosen],
        trajectory.stamp[chosen],
        trajectory.pose[chosen],
        None if held is None else held[chosen],
    )


def _merged(
    scans: Sequence[Observation],
    poses: FloatArray,
    uncertainty: FloatArray | None,
    parameters: SubmapParameters,
) -> SubmapBuilder:
    """Merge `scans` at (n, 3) `poses`, of which (n, 4) `uncertainty` is known, or none."""
    growing = SubmapBuilder(parameters)
    known = np.tile(EXACT, (len(poses), 1)) if uncertainty is None else uncertainty
    for seen, pose, each in zip(scans, poses, known, strict=True):
        growing.add(seen.scan, seen.segments, pose, each)
    return growing


def _walls(submaps: Sequence[Submap], frame: FloatArray, spacing: float) -> OrientedPoints:
    """Return points about every `spacing` [m] on the walls of `submaps`, in `frame` (3,)."""
    oriented = [
        points_on_lines(s.map, spacing)[0].moved(se2.between(frame, s.pose)) for s in submaps
    ]
    return join_points([points_on_lines(LineMap.empty(), spacing)[0], *oriented])
