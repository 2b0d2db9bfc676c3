"""What a robot saw lately: what the next scan is aligned to and judged by.

Returns that lie on known surfaces speak for a pose; returns inside what earlier scans saw through,
and known surfaces that the new scan sees through, speak against it.
"""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.kernels.point_map import make_point_map
from mapweave.kernels.pose_evidence import (
    EvidenceSettings,
    evidence_settings,
    pose_evidence,
)
from mapweave.kernels.viewpoints import make_viewpoints
from mapweave.mapping.tracking.standing_things import StandingThings, StandingThingsParameters
from mapweave.matching.correlative import CorrelativeParameters, LikelihoodField, search
from mapweave.matching.icp import CELL, IcpParameters, Target
from mapweave.parameters import StageParameters, derived
from mapweave.scan.points import OrientedPoints, join_points
from mapweave.scan.scan import Scan
from mapweave.scan.visibility import beam_spacing, beams_through, clear_ranges


class LocalMapParameters(StageParameters):
    """What is remembered, and when it speaks for or against a pose."""

    icp: IcpParameters = derived(IcpParameters.of)
    search: CorrelativeParameters = derived(CorrelativeParameters.of)
    things: StandingThingsParameters = derived(StandingThingsParameters.of)
    keyframes: int = Field(60, ge=1, description="how many are remembered: some 15-20 m of path")
    keyframe_step: float = derived(
        lambda c: c.mapping.keyframe_step, gt=0, description="[m] of motion that makes a new one"
    )
    keyframe_turn: float = derived(
        lambda c: c.mapping.keyframe_turn, gt=0, description="[rad] of rotation that makes one: 15°"
    )
    thin: float = derived(
        lambda c: c.sensor.range_sigma,
        ge=0,
        description="[m] within which a point is one that was seen before: a laser's noise",
    )
    sample: int = Field(
        3, ge=1, description="one in so many known points tells what was seen through"
    )
    witnesses: int = Field(12, ge=1, description="nearest keyframes asked what they saw through")
    overlap: float = derived(
        lambda c: 0.6 * c.mapping.closeness,
        gt=0,
        description="[m] within which a return is explained",
    )
    clearance: float = derived(
        lambda c: c.mapping.clearance,
        gt=0,
        description="[m] by which seeing through must be certain",
    )
    sight: float = derived(
        lambda c: 1.2 * c.mapping.free_range,
        gt=0,
        description="[m] up to which seeing through counts",
    )
    far_sight: float = derived(
        lambda c: c.mapping.far_range,
        gt=0,
        description="[m] the same for a surface that faces the sensor: a corridor's end",
    )
    facing: float = Field(
        0.7,
        gt=0,
        lt=1,
        description="cosine between a beam and the normal of a surface that faces it; far away,"
        " a small turn moves a beam along such a surface, not before or behind it",
    )


@dataclass(frozen=True, slots=True, eq=False)
class ScanEvidence:
    """What speaks for and against the pose of a scan, as shares in [0, 1].

    Attributes
    ----------
    explained
        Of the returns: on known surfaces.
    contradicted
        Of the returns: where earlier scans saw free space.
    seen_through
        Of the known surface points in sight: where this scan saw free space.
    excused
        Of the returns: those contradicted that are on things that may have come since.
    """

    explained: float
    contradicted: float
    seen_through: float
    excused: float = 0.0

    @property
    def novel(self) -> float:
        """Of the returns: where nobody looked before; they speak neither for nor against."""
        return 1.0 - self.explained - self.contradicted

    @property
    def score(self) -> float:
        """For minus against."""
        return self.explained - self.contradicted - self.seen_through

    @property
    def disputed(self) -> float:
        """What speaks against, as a share of all that speaks."""
        against = self.contradicted + self.seen_through
        return against / max(self.explained + against, 1e-9)

    @property
    def without_excused(self) -> "ScanEvidence":
        """The same of the other returns: what may have come since neither is seen nor hides."""
        others = 1.0 - self.excused
        against = self.contradicted - self.excused
        return ScanEvidence(self.explained / others, against / others, self.seen_through)


class LocalMap:
    """The last keyframes; empty until the first is remembered."""

    def __init__(self, parameters: LocalMapParameters) -> None:
        p = self._parameters = parameters
        self._known = make_point_map(p.icp.normal_weight, CELL, p.thin, p.keyframes)
        self._viewpoints = make_viewpoints(p.keyframes)
        self._settings = evidence_settings(_settings(p))
        self._things = StandingThings(p.things)
        self._solid: deque[OrientedPoints] = deque(maxlen=p.keyframes)
        self._last: FloatArray | None = None
        self._raster: LikelihoodField | None = None
        self._asked: tuple[Scan, tuple[FloatArray, float, float]] | None = None

    def copy(self) -> "LocalMap":
        """Return one that remembers by itself from now on."""
        other = LocalMap(self._parameters)
        other._known, other._viewpoints = self._known.copy(), self._viewpoints.copy()
        other._things, other._solid = self._things.copy(), self._solid.copy()
        other._last, other._raster = self._last, self._raster
        return other

    @property
    def is_empty(self) -> bool:
        """Whether nothing was remembered yet."""
        return self._last is None

    @property
    def newest(self) -> int:
        """The number of the newest point; -1 while there is none."""
        return self._known.newest

    @property
    def target(self) -> Target:
        """What scans are aligned to; there is none while the map is empty."""
        return Target(self._known)

    @property
    def distrusts_things(self) -> bool:
        """Whether of things that may move only those are landmarks that stood for a while."""
        return self._things.are_distrusted

    def trust_things(self) -> None:
        """Take things that may move for landmarks until they are known to move."""
        self._things.are_distrusted = False

    def remember(
        self,
        scan: Scan,
        oriented: OrientedPoints,
        loose: BoolArray,
        pose: FloatArray,
        *,
        spared: bool,
        held: bool,
    ) -> None:
        """Add a scan taken at `pose` (3,), unless it was taken about where the last one was.

        Parameters
        ----------
        oriented
            Its oriented points, sensor frame.
        loose
            (n,) which of them are on things that may move.
        spared
            Whether these are not needed as landmarks.
        held
            Whether the pose is held in every direction: from elsewhere nobody knows what moved.
        """
        if not self._is_news(pose):
            return
        placed = oriented.moved(pose)
        landmarks = self._landmarks(scan, placed, loose & spared, pose, held=held)
        self._known.add(landmarks.points, landmarks.normals)
        self._solid.append(placed.at(np.flatnonzero(~loose)))
        self._viewpoints.add(*self._view(scan), pose)
        self._last, self._raster = pose, None

    def _landmarks(
        self, scan: Scan, placed: OrientedPoints, loose: BoolArray, pose: FloatArray, *, held: bool
    ) -> OrientedPoints:
        """Return what of a scan, `placed` where it was taken, is to be aligned to."""
        standing: list[OrientedPoints] = []
        distrusted = self.distrusts_things  # as the scan was placed by
        if held:
            things = placed.at(np.flatnonzero(loose))
            standing = self._things.look(scan, pose, placed.points, things)
        else:
            self._things.forget()
        if not distrusted:
            return placed
        return join_points([placed.at(np.flatnonzero(~loose)), *standing])

    def search(
        self, points: FloatArray, centre: FloatArray, max_turn: float, reach: float | None = None
    ) -> FloatArray:
        """Return the (k, 3) best poses for (n, 2) `points` in a window about `centre` (3,).

        Its half width is `reach` [m], or the usual one.
        """
        p = self._parameters.search
        if reach is not None and reach != p.reach:
            p = p.model_copy(update={"reach": reach, "candidates": p.candidates_in(reach)})
        return search(points, self._nearness(centre), centre, max_turn, p)

    def _nearness(self, centre: FloatArray) -> LikelihoodField:
        """Return a raster about `centre`, made anew only where it has moved away."""
        p = self._parameters.search
        if self._raster is None or np.abs(self._raster.centre - centre[:2]).max() > p.reach:
            self._raster = LikelihoodField.of(self._known.content()[0], centre[:2], p)
        return self._raster

    def explained(self, points: OrientedPoints, poses: FloatArray, reach: float) -> BoolArray:
        """(k, n) which `points` lie within `reach` [m] of surfaces, at each of `poses` (k, 3)."""
        return self._known.explains(points.points, points.normals, poses, reach)

    def explaining(self, points: OrientedPoints, poses: FloatArray, reach: float) -> IntArray:
        """(k, n) the numbers of the known points that they lie within `reach` [m] of; or -1."""
        placed = [points.moved(pose) for pose in poses]
        return np.array([self._known.find(at.points, at.normals, reach)[1] for at in placed])

    def lies_on(self, points: OrientedPoints, pose: FloatArray) -> BoolArray:
        """(n,) which `points`, seen from `pose` (3,), lie on known surfaces."""
        reach = self._parameters.overlap
        return np.asarray(self.explained(points, pose[None], reach)[0])

    def evidence(
        self, scan: Scan, oriented: OrientedPoints, loose: BoolArray, poses: FloatArray
    ) -> list[ScanEvidence]:
        """Return what speaks for and against `scan` at each of `poses` (k, 3).

        Parameters
        ----------
        oriented
            The oriented points of `scan`, sensor frame.
        loose
            (n,) which of them are on things that may have come since: where nothing was before, no
            proof against a pose; of half of the returns at the most.
        """
        p, count = self._parameters, max(len(oriented), 1)
        asked = oriented.points, oriented.normals, loose, poses
        counts = pose_evidence(self._known, self._viewpoints, *asked, self._settings)
        sight = p.clearance, p.sight, p.far_sight, p.facing
        through = self._known.seen_through(*self._view(scan), poses, *sight, p.sample)
        return [
            _evidence((explained, contradicted, excusable), share, count)
            for (explained, contradicted, excusable), share in zip(
                counts.tolist(), through.tolist(), strict=True
            )
        ]

    def looked_through(self, scan: Scan, pose: FloatArray) -> int:
        """Return how many beams of `scan` at `pose` (3,) go through what cannot move.

        All of these should have ended before. Of the surfaces near, of which `seen_through` is a
        share, most are behind a robot that turned, or behind walls.
        """
        p = self._parameters
        solid = join_points(list(self._solid)).moved(se2.inverse(pose))
        return beams_through(scan, solid.points, solid.normals, p.clearance, p.far_sight)

    def _view(self, scan: Scan) -> tuple[FloatArray, float, float]:
        """Return how far each beam saw nothing [m], the first one's angle, their spacing [rad].

        A scan is asked about at many poses, and then remembered.
        """
        if self._asked is None or self._asked[0] is not scan:
            clear = clear_ranges(scan, self._parameters.far_sight)
            self._asked = scan, (clear, float(scan.angles[0]), beam_spacing(scan))
        return self._asked[1]

    def _is_news(self, pose: FloatArray) -> bool:
        if self._last is None:
            return True
        x, y, turn = se2.between(self._last, pose).tolist()
        p = self._parameters
        return math.hypot(x, y) > p.keyframe_step or abs(turn) > p.keyframe_turn


def _evidence(counts: tuple[int, int, int], through: float, count: int) -> ScanEvidence:
    explained, contradicted, loose = counts
    excused = min(loose, count // 2)
    against = contradicted + loose
    return ScanEvidence(explained / count, against / count, through, excused / count)


def _settings(p: LocalMapParameters) -> EvidenceSettings:
    sight = p.sight, p.far_sight, p.facing
    return EvidenceSettings(p.overlap, p.clearance, p.witnesses, *sight)
