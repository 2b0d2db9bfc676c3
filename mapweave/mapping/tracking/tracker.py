"""Tracking: each scan against what was seen lately, from scans alone.

Predict, align, and judge by all that both sides saw. Where the predicted pose does not convince,
every motion in a window is searched; where that does not convince either, the scan is missed. The
first one that fits again is on probation until the next one has confirmed it. A blind scan, with no
or too few returns, is missed as well: the robot went on meanwhile.

Odometry, where a scan has it, is one more prediction beside the present pace: it may say where to
look first, and what would surprise least, but what was seen decides.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.tracking.acceptance import (
    FIRST,
    ScanMatch,
    best_by_sight,
    is_acceptable,
    is_ambiguous,
    is_credible,
    is_open,
    is_unremarkable,
    tell_apart,
    unsettled,
)
from mapweave.mapping.tracking.drift import Drift
from mapweave.mapping.tracking.local_map import LocalMap
from mapweave.mapping.tracking.motion_model import MotionModel
from mapweave.mapping.tracking.observation import Observation
from mapweave.mapping.tracking.reach import Reach, pace, reach
from mapweave.mapping.tracking.reachability import Reachability
from mapweave.mapping.tracking.shape_starts import shape_starts
from mapweave.mapping.tracking.slides import slide_starts
from mapweave.mapping.tracking.sweep_time import SweepJudge
from mapweave.mapping.tracking.tracker_parameters import TrackerParameters
from mapweave.maps import LineMap
from mapweave.matching.icp import align_all
from mapweave.scan.points import OrientedPoints
from mapweave.scan.scan import Scan

__all__ = ["Found", "Tracker", "TrackerParameters"]

Found = list[tuple[Observation, ScanMatch]]
EQUAL = 1e-3  # share of the returns by which worth must differ to matter


class _State(NamedTuple):
    """All that following a scan changes."""

    pose: FloatArray
    missed: list[Observation]
    motion_model: MotionModel
    odometry: FloatArray | None
    local: LocalMap
    reachability: Reachability
    drift: Drift


class Tracker:
    """Follows one sensor through consecutive scans; its frame is that of its first scan.

    Attributes
    ----------
    pose
        (3,) of the last scan that fitted [m, m, rad].
    missed
        The scans since then, which fitted nowhere, were not confirmed by the next one, or were
        blind: these show nothing, but they took their time.
    searched
        Whether the last scan was looked for everywhere within reach: that takes long.
    """

    def __init__(
        self, parameters: TrackerParameters | None = None, sweeps: SweepJudge | None = None
    ) -> None:
        self.parameters = parameters or TrackerParameters()
        self._sweeps = sweeps
        self.pose: FloatArray = se2.IDENTITY
        self.missed: list[Observation] = []
        self.searched = False
        self._motion = MotionModel(self.parameters.motion_model)
        sigma = self.parameters.prior_sigma, self.parameters.prior_sigma, self.parameters.prior_turn
        self._prior = np.diag(np.array(sigma) ** -2)
        self._odometry: FloatArray | None = None
        self._local = LocalMap(self.parameters.local_map)
        self._reachability = Reachability(self.parameters.reachability)
        self._drift = Drift(self.parameters.drift)
        self._before: _State | None = None  # of the scan on probation
        self._probation: Found = []
        self._untried: list[Observation] = []  # missed before that one, the last of them first

    def afresh(self, *, trusting: bool = False) -> "Tracker":
        """Return a tracker of the same robot that knows no place: it moves as it did.

        Parameters
        ----------
        trusting
            Whether things that may move are landmarks to it until they are known to move.
        """
        other = Tracker(self.parameters, self._sweeps)
        if trusting:
            other._local.trust_things()
        other._motion, other._reachability = self._motion.copy(), self._reachability.afresh()
        return other

    def place(self, seen: Observation, known: Callable[[], LineMap]) -> Found:
        """Find the pose of a scan; of those that were missed as well, once it is found again.

        Parameters
        ----------
        seen
            The scan, prepared.
        known
            Makes the map so far, G_(t-1), tracking frame; asked only where motion alone does not
            explain the scan.

        Returns
        -------
        found
            All scans that are placed by now and were not before; nothing where this one fits
            nowhere, or is on probation.
        """
        self._catch_up()
        self.searched = False
        self._reachability.tick(seen.scan)
        if self.is_blind(seen):
            self.missed += [] if self._local.is_empty else [seen]
            return []
        before = self._state() if self.missed else None
        found = self._follow(seen, known)
        if self._before is not None:
            if found:
                return [*self.settle(), *found]
            self.take_back()
        elif found and before is not None:
            self._before, self._probation = before, found
            return []
        return found

    @property
    def drift(self) -> Drift:
        """What is not known of where it is."""
        return self._drift

    def settle(self) -> Found:
        """Believe the scan on probation, and return it with those found with it."""
        self._catch_up()
        found, self._probation, self._before = self._probation, [], None
        return found

    def take_back(self) -> None:
        """Forget the scan on probation, if any: it is missed, as those after it are."""
        if self._before is not None:
            since = [self._probation[0][0], *self.missed]
            self.pose, missed, self._motion, self._odometry, self._local, *_ = before = self._before
            self._reachability, self._drift = before.reachability, before.drift
            self.missed = [*missed, *since]
        self._before, self._probation, self._untried = None, [], []

    @property
    def is_behind(self) -> bool:
        """Whether scans that were missed are still to be tried; `place` tries them all first."""
        return bool(self._untried)

    def try_missed(self) -> None:
        """Try one of the scans that were missed, from the scan on probation backwards."""
        seen, (after, there) = self._untried.pop(0), self._probation[-1]
        reach = self._reachability.between(seen.scan, after.scan)
        tracked = self.revisit(seen, there.pose, reach)
        if tracked is None:
            return
        if self._reachability.joins(seen.scan, tracked.pose, after.scan, there.pose):
            self._probation.append((seen, tracked))

    def _catch_up(self) -> None:
        while self.is_behind:
            self.try_missed()

    def is_blind(self, seen: Observation) -> bool:
        """Whether a scan shows too little to be placed anywhere."""
        return len(seen.oriented) < self.parameters.min_points

    def revisit(self, seen: Observation, near: FloatArray, reach: float) -> ScanMatch | None:
        """Find the pose of an older scan within `reach` [m] of `near` (3,), leaving the track."""
        p = self.parameters.acceptance
        wide = min(max(reach, self.parameters.local_map.search.reach), self.parameters.widest)
        relied = self._relied_on(seen, near)
        starts = self._local.search(relied.oriented.points, near, np.pi, wide)
        found = self._aligned(relied, np.vstack([near, starts]))
        return best_by_sight(found, p, lambda t: self._denied(relied, t))

    def _state(self) -> _State:
        """Return how it is now, to come back to."""
        copies = self._motion.copy(), self._odometry, self._local.copy()
        others = self._reachability.copy(), self._drift.copy()
        return _State(self.pose, self.missed.copy(), *copies, *others)

    def _follow(self, seen: Observation, known: Callable[[], LineMap]) -> Found:
        """Go on to `seen`, where it is; miss it, where that is nowhere."""
        predicted = self._predictions(seen.scan)
        relied = self._relied_on(seen, predicted[0])
        tracked = FIRST if self._local.is_empty else self._locate(relied, predicted, known)
        if tracked is None:
            self.missed.append(seen)
            return []
        if not self._local.is_empty:
            tracked = self._drifted(relied, tracked)
            if self._sweeps is not None and not self.missed:
                self._sweeps.ask(seen, self.pose, tracked.pose, self._reachability, self._local)
        self._odometry = seen.scan.odometry
        self.pose = tracked.pose
        self._reachability.placed(seen.scan, tracked.pose)
        held = not is_open(tracked, self.parameters.acceptance)
        self._local.remember(
            seen.scan,
            seen.walls,
            seen.loose,
            tracked.pose,
            spared=self._spares_things(seen),
            held=held,
        )
        self._untried = [each for each in reversed(self.missed) if not self.is_blind(each)]
        self.missed = []
        return [(seen, tracked)]

    def _relied_on(self, seen: Observation, near: FloatArray) -> Observation:
        """Return what of `seen` tells where it was taken, which is `near` (3,).

        Where things move, those count that are known to stand.
        """
        if not self._local.distrusts_things or not self._spares_things(seen):
            return seen
        return seen.relying_on(self._local.lies_on(seen.oriented, near))

    def _spares_things(self, seen: Observation) -> bool:
        """Whether it can do without things that may move, until they are known to stand.

        Not where there is little else, nor where scans are so far apart that all is needed.
        """
        p, interval = self.parameters, self._reachability.interval
        often = interval is not None and interval <= p.often
        return bool(often and seen.is_loose.any()) and seen.has_walls(p.min_points, p.min_solid)

    def _drifted(self, seen: Observation, tracked: ScanMatch) -> ScanMatch:
        """Note a step, and how far it may be off; return the scan where it ends, with that."""
        step = se2.between(self.pose, tracked.pose)
        is_open = self._drift.follow(
            (tracked.pose - self.pose)[:2],
            tracked.pose,
            tracked.information,
            self._thinned(seen),
            self._local,
            lambda: pace(seen.scan, float(step[2]), self._motion, self._reachability),
            tracked.unsettled,
        )
        if not self.missed:
            self._motion.add(step, np.zeros((3, 3)) if is_open else tracked.information)
        return replace(tracked, drift=self._drift.covariance)

    def _locate(
        self, seen: Observation, predicted: FloatArray, known: Callable[[], LineMap]
    ) -> ScanMatch | None:
        """Try what is likely first, then what shapes propose, then everything within reach.

        What is remarkable is compared with everything, however well it fits.
        """
        a = self.parameters.acceptance
        likely_first: list[Callable[[], FloatArray]] = [
            lambda: predicted,
            lambda: self.pose[None],
            lambda: self._shape_starts(seen, known()),
            lambda: self._searched(seen, predicted[0], self.parameters.first_window),
        ]
        found: list[ScanMatch] = []
        for starts in likely_first:
            found += self._reached(seen, starts())
            best = self._best(seen, found, a.novelty)
            if best is not None and best.evidence.score >= a.convincing and is_credible(best, a):
                best = self._slid(seen, best, found)
                if is_unremarkable(best, self._turn_to(best), a):
                    return self._beside_others(best, found)
                break
        self.searched = True
        found += self._reached(seen, self._searched(seen, predicted[0], np.pi))
        return self._best_of_all(seen, found)

    def _best_of_all(self, seen: Observation, found: list[ScanMatch]) -> ScanMatch | None:
        """Return the best of all within reach, if it is believed and no look-alike."""
        a = self.parameters.acceptance
        best = self._best(seen, found, a.novelty)
        if best is None:
            return None
        if best.evidence.score >= a.acceptable and is_credible(best, a):
            best = self._slid(seen, best, found)
        elif not is_acceptable(best, self._likely(seen, found, a.novelty), a):
            return None
        return (
            None
            if is_ambiguous(best, found, self._turn_to(best), a)
            else self._beside_others(best, found)
        )

    def _turn_to(self, tracked: ScanMatch) -> float:
        """[rad] from the last scan that was placed."""
        return float(se2.wrap(tracked.pose[2] - self.pose[2]))

    def _beside_others(self, best: ScanMatch, found: list[ScanMatch]) -> ScanMatch:
        """Return the best, with how far it may be off where others are worth about as much."""
        p = self.parameters
        return replace(best, unsettled=unsettled(best, found, p.open_novelty, p.acceptance))

    def _slid(self, seen: Observation, best: ScanMatch, found: list[ScanMatch]) -> ScanMatch:
        """Return the best along the direction that is left open, if one is; add it to `found`."""
        slides = self._slides(seen, best)
        found += slides
        return self._best(seen, [best, *slides], self.parameters.open_novelty) or best

    def _likely(self, seen: Observation, found: list[ScanMatch], novelty: float) -> list[ScanMatch]:
        """Those that count: after a miss, where the best can be told from look-alikes."""
        if not self.missed:
            return found
        a = self.parameters.acceptance
        return tell_apart(found, novelty, a, lambda t: self._denied(seen, t))

    def _denied(self, seen: Observation, tracked: ScanMatch) -> float:
        """Return of what share of its returns walls deny that `seen` was taken there.

        They are behind a known wall, or on what cannot have come since.
        """
        through = self._local.looked_through(seen.scan, tracked.pose)
        evidence = tracked.evidence
        return evidence.contradicted - evidence.excused + through / len(seen.oriented)

    def _best(self, seen: Observation, found: list[ScanMatch], novelty: float) -> ScanMatch | None:
        """The one worth most of those that count, the first of equals; None where none does.

        Many starts end within a millimetre of each other: rounding must not choose.
        """
        likely = [(t.value(novelty), t) for t in self._likely(seen, found, novelty)]
        most = max((value for value, _ in likely), default=0.0)
        return next((t for value, t in likely if value >= most - EQUAL), None)

    def _predictions(self, scan: Scan) -> FloatArray:
        """(k, 3) where the robot may be by now."""
        return se2.compose(self.pose, self._motion.guesses(len(self.missed), self._told(scan)))

    def _told(self, scan: Scan) -> FloatArray | None:
        """(3,) the step since the last scan that was placed, by odometry; None without."""
        if scan.odometry is None or self._odometry is None:
            return None
        return se2.between(self._odometry, scan.odometry)

    def _reached(self, seen: Observation, starts: FloatArray) -> list[ScanMatch]:
        """Align from each of `starts` (k, 3); leave out where a robot cannot have got to."""
        far = self._reach(seen.scan).far
        found = [
            t for t in self._aligned(seen, starts) if np.hypot(*(t.pose - self.pose)[:2]) <= far
        ]
        poses = np.array([t.pose for t in found]).reshape(-1, 3)
        possible = self._reachability.allows(seen.scan, poses)
        return [t for t, allowed in zip(found, possible, strict=True) if allowed]

    def _reach(self, scan: Scan) -> Reach:
        """How far it can have come since the last scan that was placed."""
        step = self.parameters.max_step
        return reach(scan, len(self.missed), step, self._motion, self._reachability)

    def _searched(self, seen: Observation, near: FloatArray, max_turn: float) -> FloatArray:
        """Poses (k, 3) about `near` (3,) where most returns lie on what was seen before."""
        return self._local.search(seen.oriented.points, near, max_turn, self._window(seen.scan))

    def _window(self, scan: Scan) -> float:
        """[m] to search, each way."""
        p = self.parameters
        return self._reach(scan).window(p.local_map.search.reach, p.widest)

    def _slides(self, seen: Observation, tracked: ScanMatch) -> list[ScanMatch]:
        """Look along the direction that the walls leave open, if they leave one: a corridor.

        Every place within reach is tried, and where the pace would lead; what both saw decides.
        """
        p = self.parameters
        if not is_open(tracked, p.acceptance):
            return []
        way, reached = self._motion.way(self._turn_to(tracked))[:2], self._window(seen.scan)
        return self._reached(seen, slide_starts(tracked, self.pose, way, reached, p.open_step))

    def _shape_starts(self, seen: Observation, known: LineMap) -> FloatArray:
        """Poses (k, 3) where polylines of the scan lie on corresponding ones of the map (V)."""
        p = self.parameters
        found = shape_starts(seen, known, p.line_spacing, p.local_map.icp, p.correspondence)
        return np.array(list(found)).reshape(-1, 3)

    def _aligned(self, seen: Observation, starts: FloatArray) -> list[ScanMatch]:
        """Align from each of `starts` (k, 3), and judge where that ends."""
        if len(starts) == 0:
            return []
        p, oriented, thinned = self.parameters, seen.oriented, self._thinned(seen)
        fits = align_all(
            thinned, self._local.target, starts, p.local_map.icp, self._prior, share=p.promising
        )
        poses = np.array([fit.pose for fit in fits])
        judged = self._local.evidence(seen.scan, oriented, seen.is_loose, poses)
        since = len(self.missed), self._told(seen.scan)
        steps, drift = se2.between(self.pose, poses), self._drift.covariance
        return [
            ScanMatch(fit.pose, evidence, fit.information, *self._motion.judge(step, *since), drift)
            for fit, evidence, step in zip(fits, judged, steps, strict=True)
        ]

    def _thinned(self, seen: Observation) -> OrientedPoints:
        stride = 1 + (len(seen.oriented) - 1) // self.parameters.max_points
        return seen.oriented.at(slice(None, None, stride))
