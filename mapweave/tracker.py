"""Tracking: each scan against what was seen lately, from scans alone.

Predict, align, and judge by all that both sides saw: returns that lie on known surfaces speak
for a pose; returns inside what earlier scans saw through, and known surfaces that the new scan
sees through, speak against it. Where the predicted pose does not convince, every motion in a
window is searched; where that does not convince either, the scan is not placed.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave import se2
from mapweave.arrays import BoolArray, FloatArray
from mapweave.icp import Fit, IcpParameters, Target, align, partners
from mapweave.scan import Scan
from mapweave.search import NearnessRaster, SearchParameters, search
from mapweave.surface import Surface, join_surfaces
from mapweave.visibility import seen_through


class TrackerParameters(BaseModel):
    """What the tracker remembers, expects and accepts."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    icp: IcpParameters = IcpParameters()
    search: SearchParameters = SearchParameters()
    keyframes: int = Field(60, ge=1, description="how many are remembered: some 15-20 m of path")
    keyframe_step: float = Field(0.3, gt=0, description="[m] of motion that makes a new one")
    keyframe_turn: float = Field(0.26, gt=0, description="[rad] of rotation that makes one: 15°")
    max_points: int = Field(180, ge=10, description="of a scan, in the alignment")
    witnesses: int = Field(12, ge=1, description="nearest keyframes asked what they saw through")
    overlap: float = Field(0.15, gt=0, description="[m] within which a return is explained")
    clearance: float = Field(0.3, gt=0, description="[m] by which seeing through must be certain")
    sight: float = Field(12.0, gt=0, description="[m] up to which seeing through counts")
    motion_sigma: float = Field(0.5, gt=0, description="[m] of a step against constant velocity")
    turn_sigma: float = Field(0.35, gt=0, description="[rad] the same for the turn")
    surprise: float = Field(0.05, ge=0, description="share of returns that one sigma² is worth")
    convincing: float = Field(0.75, description="score above which no search is made")
    acceptable: float = Field(0.45, description="score below which a scan is not placed")
    first_window: float = Field(1.15, gt=0, description="[rad] half the rotation searched first")
    min_points: int = Field(20, ge=3, description="a scan with fewer oriented points is blind")


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """What speaks for and against the pose of a scan, as shares in [0, 1].

    Attributes
    ----------
    explained
        Of the returns: on known surfaces.
    contradicted
        Of the returns: where earlier scans saw free space.
    seen_through
        Of the known surface points in sight: where this scan saw free space.
    """

    explained: float
    contradicted: float
    seen_through: float

    @property
    def score(self) -> float:
        """For minus against."""
        return self.explained - self.contradicted - self.seen_through


@dataclass(frozen=True, slots=True, eq=False)
class Tracked:
    """A pose found for a scan: where, how sure, and which directions are held."""

    pose: FloatArray
    evidence: Evidence
    information: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Keyframe:
    """A remembered scan at its pose (3,), with its surface in the tracking frame."""

    scan: Scan
    pose: FloatArray
    surface: Surface


class Tracker:
    """Follows one sensor through consecutive scans; its frame is that of its first scan."""

    def __init__(self, parameters: TrackerParameters | None = None) -> None:
        self.parameters = parameters or TrackerParameters()
        self.pose: FloatArray = se2.IDENTITY
        self._motion: FloatArray = se2.IDENTITY
        self._keyframes: deque[Keyframe] = deque(maxlen=self.parameters.keyframes)
        self._target: Target | None = None
        self._raster: NearnessRaster | None = None

    def place(self, scan: Scan, surface: Surface) -> Tracked | None:
        """Find the pose of `scan` with its oriented points `surface`; None where nothing fits."""
        if len(surface) < self.parameters.min_points:
            return None
        tracked = self._locate(scan, surface) if self._keyframes else _first()
        if tracked is None:
            return None
        self._motion = se2.between(self.pose, tracked.pose) if self._keyframes else se2.IDENTITY
        self.pose = tracked.pose
        if self._is_news(tracked.pose):
            self._remember(Keyframe(scan, tracked.pose, surface.moved(tracked.pose)))
        return tracked

    def revisit(self, scan: Scan, surface: Surface, near: FloatArray) -> Tracked | None:
        """Find the pose of an older scan about `near` (3,), leaving the track as it is."""
        p = self.parameters
        starts = search(surface.points, self._nearness(near), near, np.pi, p.search)
        best = max(
            (self._aligned(scan, surface, s) for s in np.vstack([near, starts])),
            key=lambda tracked: tracked.evidence.score,
        )
        return best if best.evidence.score >= p.acceptable else None

    def forget_motion(self) -> None:
        """Expect the next scan where the last was: what moved in between is unknown."""
        self._motion = se2.IDENTITY

    def _locate(self, scan: Scan, surface: Surface) -> Tracked | None:
        p = self.parameters
        predicted = se2.compose(self.pose, self._motion)
        best = self._best(scan, surface, np.stack([predicted, self.pose]))
        for window in (p.first_window, np.pi):
            threshold = p.convincing if window < np.pi else p.acceptable
            if best.evidence.score >= threshold:
                break
            raster = self._nearness(predicted)
            found = search(surface.points, raster, predicted, window, p.search)
            best = max(
                best, self._best(scan, surface, found), key=lambda t: self._value(t, predicted)
            )
        return best if best.evidence.score >= p.acceptable else None

    def _best(self, scan: Scan, surface: Surface, starts: FloatArray) -> Tracked:
        """Align from each start (k, 3) and return what convinces most."""
        predicted = se2.compose(self.pose, self._motion)
        found = [self._aligned(scan, surface, start) for start in starts]
        return max(found, key=lambda tracked: self._value(tracked, predicted))

    def _aligned(self, scan: Scan, surface: Surface, start: FloatArray) -> Tracked:
        p = self.parameters
        stride = 1 + (len(surface) - 1) // p.max_points
        prior = np.diag([p.motion_sigma**-2, p.motion_sigma**-2, p.turn_sigma**-2])
        assert self._target is not None
        fit: Fit = align(surface.at(slice(None, None, stride)), self._target, start, p.icp, prior)
        return Tracked(fit.pose, self._evidence(scan, surface, fit.pose), fit.information)

    def _value(self, tracked: Tracked, predicted: FloatArray) -> float:
        """Evidence less surprise: corridors leave a direction open, and speed is bounded."""
        p = self.parameters
        x, y, turn = se2.between(predicted, tracked.pose)
        surprise = (x * x + y * y) / p.motion_sigma**2 + (turn / p.turn_sigma) ** 2
        return tracked.evidence.score - p.surprise * min(4.0, float(surprise))

    def _evidence(self, scan: Scan, surface: Surface, pose: FloatArray) -> Evidence:
        p = self.parameters
        assert self._target is not None
        placed = surface.moved(pose)
        distance, _ = partners(placed, self._target, p.icp, p.overlap)
        explained = np.isfinite(distance)
        contradicted = ~explained
        open_points = placed.points[~explained]
        contradicted[~explained] = self._free_before(open_points, pose)
        known = se2.transform_points(se2.inverse(pose), self._target.surface.points[::3])
        in_sight = np.hypot(*known.T) < p.sight
        through = seen_through(scan, known[in_sight], p.clearance, p.sight)
        return Evidence(
            float(explained.mean()),
            float(contradicted.mean()),
            float(through.mean()) if len(through) else 0.0,
        )

    def _free_before(self, points: FloatArray, pose: FloatArray) -> BoolArray:
        """(n,) which `points`, tracking frame, the keyframes around `pose` saw through."""
        p = self.parameters
        near = sorted(self._keyframes, key=lambda k: float(np.hypot(*(k.pose - pose)[:2])))
        free = np.zeros(len(points), dtype=np.bool_)
        for keyframe in near[: p.witnesses]:
            local = se2.transform_points(se2.inverse(keyframe.pose), points)
            free |= seen_through(keyframe.scan, local, p.clearance, p.sight)
        return free

    def _is_news(self, pose: FloatArray) -> bool:
        if not self._keyframes:
            return True
        x, y, turn = se2.between(self._keyframes[-1].pose, pose)
        p = self.parameters
        return bool(np.hypot(x, y) > p.keyframe_step or abs(turn) > p.keyframe_turn)

    def _remember(self, keyframe: Keyframe) -> None:
        self._keyframes.append(keyframe)
        surface = join_surfaces([k.surface for k in self._keyframes])
        self._target = Target.of(surface, self.parameters.icp)
        self._raster = None

    def _nearness(self, centre: FloatArray) -> NearnessRaster:
        p = self.parameters.search
        if self._raster is None or np.abs(self._raster.centre - centre[:2]).max() > p.reach:
            assert self._target is not None
            self._raster = NearnessRaster.of(self._target.surface.points, centre[:2], p)
        return self._raster


def _first() -> Tracked:
    """The first scan defines the frame."""
    return Tracked(se2.IDENTITY, Evidence(1.0, 0.0, 0.0), np.zeros((3, 3)))
