"""Tracking: each scan against what was seen lately, from scans alone.

Predict, align, and judge by all that both sides saw. Where the predicted pose does not convince,
every motion in a window is searched; where that does not convince either, the scan is not placed.

Odometry, where a scan has it, is one more prediction beside the present pace: it may say where to
look first, and what would surprise least, but what was seen decides.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave import se2
from mapweave.arrays import FloatArray
from mapweave.correspondence import CorrespondenceParameters, correspond
from mapweave.icp import Target, align, align_all
from mapweave.local_map import Evidence, LocalMap, LocalMapParameters
from mapweave.maps import LineMap
from mapweave.observation import Observation
from mapweave.scan import Scan
from mapweave.surface import line_surface


class TrackerParameters(BaseModel):
    """What the tracker remembers, expects and accepts."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    local_map: LocalMapParameters = LocalMapParameters()
    correspondence: CorrespondenceParameters = CorrespondenceParameters()
    line_spacing: float = Field(0.1, gt=0, description="[m] between points on the map's lines")
    max_points: int = Field(180, ge=10, description="of a scan, in the alignment")
    max_step: float = Field(2.5, gt=0, description="[m] between scans that are tracked")
    pace: int = Field(7, ge=1, description="steps whose median is expected next")
    motion_sigma: float = Field(0.5, gt=0, description="[m] of a step against the predicted one")
    turn_sigma: float = Field(0.35, gt=0, description="[rad] the same for the turn")
    surprise: float = Field(
        0.02, ge=0, description="share of returns that a step e sigma² off is worth less"
    )
    turn_surprise: float = Field(0.03, ge=0, description="the same for the turn")
    novelty: float = Field(
        0.5,
        ge=0,
        le=1,
        description="what a return at a new place counts, against an explained one;"
        " at 0 a pose that shows nothing new would always win",
    )
    convincing: float = Field(0.75, description="score above which no search is made")
    acceptable: float = Field(0.5, description="score above which a searched pose is taken")
    plausible: float = Field(0.25, description="score above which one without a rival is taken")
    max_doubt: float = Field(
        0.25, gt=0, description="about a pose that does not convince: its disputed share, its leap"
    )
    leap: float = Field(2.5, ge=0, description="what surprise counts in that doubt")
    margin: float = Field(0.2, gt=0, description="of score to the best different pose, the rival")
    rival_distance: float = Field(0.5, gt=0, description="[m] between rivals")
    rival_turn: float = Field(0.2, gt=0, description="[rad] between rivals")
    open_novelty: float = Field(
        0.8, ge=0, le=1, description="what a return at a new place counts along bare walls"
    )
    open_direction: float = Field(
        0.1, gt=0, lt=1, description="a direction held less than this share of the other is open"
    )
    open_reach: float = Field(1.2, gt=0, description="[m] searched along it, each way")
    open_step: float = Field(0.2, gt=0, description="[m] between places tried")
    first_window: float = Field(1.15, gt=0, description="[rad] half the rotation searched first")
    min_points: int = Field(20, ge=3, description="a scan with fewer oriented points is blind")


@dataclass(frozen=True, slots=True, eq=False)
class Tracked:
    """A pose found for a scan: where, how sure, and which directions are held."""

    pose: FloatArray
    evidence: Evidence
    information: FloatArray


class Tracker:
    """Follows one sensor through consecutive scans; its frame is that of its first scan."""

    def __init__(self, parameters: TrackerParameters | None = None) -> None:
        self.parameters = parameters or TrackerParameters()
        self.pose: FloatArray = se2.IDENTITY
        self._motion: FloatArray = se2.IDENTITY
        self._steps: deque[FloatArray] = deque(maxlen=self.parameters.pace)
        self._odometry: FloatArray | None = None
        self._followed = True
        self._local = LocalMap(self.parameters.local_map)

    def place(self, seen: Observation, known: Callable[[], LineMap]) -> Tracked | None:
        """Find the pose of a scan; None where it fits nowhere.

        Parameters
        ----------
        seen
            The scan, prepared.
        known
            Makes the map so far, G_(t-1), tracking frame; asked only where motion alone does not
            explain the scan.
        """
        if self.is_blind(seen):
            return None
        tracked = _first() if self._local.is_empty else self._locate(seen, known)
        self._followed = tracked is not None
        if tracked is None:
            return None
        self._expect(se2.between(self.pose, tracked.pose))
        self._odometry = seen.scan.odometry
        self.pose = tracked.pose
        self._local.remember(seen.scan, seen.walls, tracked.pose)
        return tracked

    def is_blind(self, seen: Observation) -> bool:
        """Whether a scan shows too little to be placed anywhere."""
        return len(seen.surface) < self.parameters.min_points

    def revisit(self, seen: Observation, near: FloatArray) -> Tracked | None:
        """Find the pose of an older scan about `near` (3,), leaving the track as it is."""
        p = self.parameters
        starts = self._local.search(seen.surface.points, near, np.pi)
        found = self._aligned(seen, np.vstack([near, starts]))
        best = max(found, key=lambda tracked: self._value(tracked, near[None], p.novelty))
        return best if best.evidence.score >= p.acceptable else None

    def forget_motion(self) -> None:
        """Expect the next scan where the last was: what moved in between is unknown."""
        self._motion = se2.IDENTITY
        self._steps.clear()

    def _expect(self, moved: FloatArray) -> None:
        """Expect the turn of the last step, and the pace of the last few: some were misjudged."""
        self._steps.append(moved)
        pace = np.median([step[:2] for step in self._steps], axis=0)
        self._motion = np.append(pace, moved[2])

    def _locate(self, seen: Observation, known: Callable[[], LineMap]) -> Tracked | None:
        """Try what is likely first, then what shapes propose, then everything within reach."""
        p = self.parameters
        # After a scan that fitted nowhere the robot may be anywhere: only what convinces counts.
        enough_at_last = p.acceptable if self._followed else p.convincing
        predicted = self._predictions(seen.scan)
        points = seen.surface.points
        stages: list[tuple[float, Callable[[], FloatArray]]] = [
            (p.convincing, lambda: np.vstack([predicted, self.pose])),
            (p.convincing, lambda: self._shape_starts(seen, known())),
            (p.convincing, lambda: self._local.search(points, predicted[0], p.first_window)),
            (enough_at_last, lambda: self._local.search(points, predicted[0], np.pi)),
        ]
        found: list[Tracked] = []
        for enough, starts in stages:
            found += [t for t in self._aligned(seen, starts()) if self._is_reached(t)]
            best = max(found, key=lambda t: self._value(t, predicted, p.novelty), default=None)
            credible = best is not None and self._is_credible(best, predicted)
            if best is not None and credible and best.evidence.score >= enough:
                return self._slid(seen, best, predicted)
        taken = best is not None and credible and self._followed and self._stands_out(best, found)
        return best if taken else None

    def _is_credible(self, tracked: Tracked, predicted: FloatArray) -> bool:
        """Whether a pose convinces, or is hardly disputed and takes no leap to get to.

        After a jump that nobody told of, look-alikes within reach are neither.
        """
        p = self.parameters
        doubt = tracked.evidence.disputed + p.leap * self._surprise(tracked, predicted)
        return tracked.evidence.score >= p.convincing or doubt <= p.max_doubt

    def _predictions(self, scan: Scan) -> FloatArray:
        """(k, 3) where the robot may be by now: by its odometry, and at its pace."""
        steps = [self._motion]
        if scan.odometry is not None and self._odometry is not None:
            steps.insert(0, se2.between(self._odometry, scan.odometry))
        return se2.compose(self.pose, np.stack(steps))

    def _is_reached(self, tracked: Tracked) -> bool:
        """Whether a robot can have come to a pose since the last one; farther is a new start."""
        return bool(np.hypot(*(tracked.pose - self.pose)[:2]) <= self.parameters.max_step)

    def _slid(self, seen: Observation, tracked: Tracked, predicted: FloatArray) -> Tracked:
        """Look along the direction that the walls leave open, if they leave one: a corridor.

        Every place a bounded speed allows is tried; what both sides saw decides.
        """
        p = self.parameters
        held, directions = np.linalg.eigh(tracked.information[:2, :2])
        if held[0] > p.open_direction * held[1]:
            return tracked
        steps = np.arange(-p.open_reach, p.open_reach + 1e-9, p.open_step)
        starts = np.tile(self.pose, (len(steps), 1))
        starts[:, 2] = tracked.pose[2]
        across = directions[:, 1] * (directions[:, 1] @ (tracked.pose - self.pose)[:2])
        starts[:, :2] += across + steps[:, None] * directions[:, 0]
        found = [t for t in self._aligned(seen, starts) if self._is_reached(t)]
        return max([tracked, *found], key=lambda t: self._value(t, predicted, p.open_novelty))

    def _stands_out(self, best: Tracked, found: list[Tracked]) -> bool:
        """Whether a weak pose, as at the edge of the known, has at least no rival."""
        p = self.parameters
        apart = se2.between(best.pose, np.stack([tracked.pose for tracked in found]))
        different = (np.hypot(*apart[:, :2].T) > p.rival_distance) | (
            np.abs(apart[:, 2]) > p.rival_turn
        )
        rivals = [t.evidence.score for t, other in zip(found, different, strict=True) if other]
        margin = best.evidence.score - max(rivals, default=-1.0)
        return best.evidence.score >= p.plausible and margin >= p.margin

    def _shape_starts(self, seen: Observation, known: LineMap) -> FloatArray:
        """Poses (k, 3) where polylines of the scan lie on corresponding ones of the map (V)."""
        p = self.parameters
        surface, _ = line_surface(known, p.line_spacing)
        starts = []
        for found in correspond(known, seen.lines, p.correspondence):
            partners_of = np.flatnonzero(found.corresponding.any(axis=1))
            target = Target.of(surface.at(np.isin(surface.polyline, partners_of)), p.local_map.icp)
            moving = seen.surface.at(seen.surface.polyline >= 0)
            fit = align(moving, target, found.transform, p.local_map.icp, None, found.corresponding)
            starts.append(fit.pose)
        return np.array(starts).reshape(-1, 3)

    def _aligned(self, seen: Observation, starts: FloatArray) -> list[Tracked]:
        """Align from each of `starts` (k, 3), and judge where that ends."""
        if len(starts) == 0:
            return []
        p = self.parameters
        surface = seen.surface
        stride = 1 + (len(surface) - 1) // p.max_points
        prior = np.diag([p.motion_sigma**-2, p.motion_sigma**-2, p.turn_sigma**-2])
        thinned = surface.at(slice(None, None, stride))
        fits = align_all(thinned, self._local.target, starts, p.local_map.icp, prior)
        poses = np.array([fit.pose for fit in fits])
        evidence = self._local.evidence(seen.scan, surface, poses)
        return [
            Tracked(fit.pose, judged, fit.information)
            for fit, judged in zip(fits, evidence, strict=True)
        ]

    def _value(self, tracked: Tracked, predicted: FloatArray, novelty: float) -> float:
        """Evidence less surprise: corridors leave a direction open, and speed is bounded."""
        evidence = tracked.evidence
        worth = evidence.score + novelty * evidence.novel
        return worth - self._surprise(tracked, predicted)

    def _surprise(self, tracked: Tracked, predicted: FloatArray) -> float:
        """How unlikely a motion is; of several predictions (k, 3) the nearest counts."""
        p = self.parameters
        x, y, turn = se2.between(predicted, tracked.pose).T
        # Heavy-tailed: robots do turn on the spot between two scans, only not often.
        moved = p.surprise * np.log1p((x * x + y * y) / p.motion_sigma**2)
        turned = p.turn_surprise * np.log1p((turn / p.turn_sigma) ** 2)
        return float((moved + turned).min())


def _first() -> Tracked:
    """The first scan defines the frame."""
    return Tracked(se2.IDENTITY, Evidence(1.0, 0.0, 0.0), np.zeros((3, 3)))
