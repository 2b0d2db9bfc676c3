"""Where what a robot saw lately is in a known map: anywhere, or about where it is believed to be.

By the means by which two maps are joined: hypothesise by shape, verify by geometry. One thing is
easier than between two robots: the map is that of the whole building. So what was seen must be
explained by it almost entirely, and look-alikes are all there to be compared with.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from pydantic import Field

from mapweave.fusion.align import FusionParameters, prepare
from mapweave.fusion.decision import Hypothesis
from mapweave.fusion.ranking import find_alignments
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.localization.known_map import KnownMap
from mapweave.mapping.localization.recent_scans import RecentScans, RecentScansParameters
from mapweave.mapping.localization.scan_finder import ScanFinder, ScanFinderParameters
from mapweave.mapping.tracking.observation import ObservationParameters, observe
from mapweave.matching.hypotheses import PreparedMap
from mapweave.matching.verification import coinciding
from mapweave.parameters import StageParameters, derived


class PlaceFinderParameters(StageParameters):
    """What a place must show to be the one.

    Set on starts in the second halves of fr079 and Intel, in maps of the first: right places had
    0.76 and more of their wall explained and were led by no rival of more than 0.72 of the score;
    wrong ones 0.62 at most (``python -m benchmarks localize``).
    """

    fusion: FusionParameters = derived(FusionParameters.of)
    recent: RecentScansParameters = derived(RecentScansParameters.of)
    scan: ScanFinderParameters = derived(ScanFinderParameters.of)
    observation: ObservationParameters = derived(ObservationParameters.of)
    min_common: float = Field(6.0, gt=0, description="[m] of wall in common")
    min_overlap: float = Field(
        0.95, gt=0, le=1, description="of the wall that both looked at, the share in common"
    )
    min_explained: float = Field(
        0.7, gt=0, le=1, description="of the wall seen lately, the share that is in the known map"
    )
    min_scan: float = Field(
        0.9, gt=0, le=1, description="of a single scan, the share that is in the known map"
    )
    min_held: float = Field(2.0, gt=0, description="[m] of it across the weakest direction")
    max_rival: float = Field(0.5, gt=0, lt=1, description="score of the next best, as a share")
    near: float = Field(0.6, gt=0, description="[m] about a believed place, searched")
    near_turn: float = Field(0.09, gt=0, description="[rad] likewise: 5°")
    step: float = Field(0.2, gt=0, description="[m] between the places tried there")
    turn_step: float = Field(0.03, gt=0, description="[rad] likewise")
    kept_overlap: float = Field(
        0.85, gt=0, le=1, description="as `min_overlap`, where the robot is believed to be"
    )
    kept_explained: float = Field(
        0.4, gt=0, le=1, description="as `min_explained`, there: things are moved, doors opened"
    )


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """Where a tracker's frame is in a known map.

    Attributes
    ----------
    component
        Of the known map.
    transform
        (3,) from the tracker's frame to the component's [m, m, rad].
    """

    component: int
    transform: FloatArray

    def differs(self, other: "Place", pose: FloatArray, distance: float, turn: float) -> bool:
        """Whether `pose` (3,), tracker's frame, is elsewhere by `other`: by [m] or [rad] more."""
        here, there = se2.compose(self.transform, pose), se2.compose(other.transform, pose)
        x, y, turned = se2.between(here, there).tolist()
        apart = np.hypot(x, y) > distance or abs(turned) > turn
        return bool(self.component != other.component or apart)


@dataclass(frozen=True, slots=True, eq=False)
class Search:
    """What is looked for.

    Attributes
    ----------
    recent
        What the robot saw lately.
    near
        Where it is believed to be; None where that may be anywhere.
    """

    recent: RecentScans
    near: Place | None


class PlaceSearcher(Protocol):
    """Searches for one place at a time, here or in another process."""

    def begin(self, search: Search) -> None:
        """Take a search; the outcome of the one before must have been taken."""

    @property
    def is_ready(self) -> bool:
        """Whether `take` returns at once."""

    def take(self) -> Place | None:
        """Wait for the outcome, and return it: None if there is no such place."""


class PlaceFinder:
    """Searches a known map at once, where it is called."""

    def __init__(self, known: KnownMap, parameters: PlaceFinderParameters) -> None:
        self._p = p = parameters
        prepared = {k: prepare(lines, p.fusion) for k, lines in known.components.items()}
        self._known = {k: each for k, each in prepared.items() if each is not None}
        self._scans = ScanFinder(known, p.scan)
        self._found: Place | None = None

    def begin(self, search: Search) -> None:
        """Search."""
        self._found = self.find(search)

    @property
    def is_ready(self) -> bool:
        """Always."""
        return True

    def take(self) -> Place | None:
        """Return the outcome."""
        return self._found

    def find(self, search: Search) -> Place | None:
        """Return where what was seen lately is, if what both saw proves it."""
        part = prepare(search.recent.lines(self._p.recent), self._p.fusion)
        if part is None:
            return None
        if search.near is None:
            return self._by_scan(search.recent) or self._anywhere(part)
        return self._about(part, search.near, search.recent.pose)

    def _by_scan(self, recent: RecentScans) -> Place | None:
        """Look for the newest scan alone."""
        found = self._scans.find(observe(recent.kept[-1].scan, self._p.observation))
        p = self._p
        if found is None or found.worth < p.min_scan or found.common < p.min_common:
            return None
        return Place(found.component, se2.compose(found.pose, se2.inverse(recent.pose)))

    def _anywhere(self, part: PreparedMap) -> Place | None:
        """Look in all components: a look-alike in any of them is a rival."""
        found = [
            (number, each)
            for number, known in self._known.items()
            for each in find_alignments(known, part, self._p.fusion)
        ]
        found.sort(key=lambda each: -each[1].verdict.score)
        if not found:
            return None
        number, best = found[0]
        rivals = [each for _, each in found[1:]]
        proven = self._is_proven(number, part, best, rivals)
        return Place(number, best.transform) if proven else None

    def _is_proven(
        self, number: int, part: PreparedMap, best: Hypothesis, rivals: Sequence[Hypothesis]
    ) -> bool:
        p, verdict = self._p, best.verdict
        rival = max((each.verdict.score for each in rivals), default=0.0)
        return (
            verdict.common >= p.min_common
            and verdict.overlap >= p.min_overlap
            and verdict.held >= p.min_held
            and rival <= p.max_rival * verdict.score
            and self._explained(number, part, best) >= p.min_explained
        )

    def _about(self, part: PreparedMap, near: Place, pose: FloatArray) -> Place | None:
        """Correct a place that is believed in; None where what is seen speaks against it."""
        p, known = self._p, self._known.get(near.component)
        if known is None:
            return None
        possible = se2.compose(_about(se2.compose(near.transform, pose), p), se2.inverse(pose))
        best = next(iter(find_alignments(known, part, p.fusion, possible)), None)
        if best is None or best.verdict.overlap < p.kept_overlap:
            return None
        if self._explained(near.component, part, best) < p.kept_explained:
            return None
        corrected = Place(near.component, best.transform)
        far = corrected.differs(near, pose, 2 * p.near, 2 * p.near_turn)
        return None if far else corrected

    def _explained(self, number: int, part: PreparedMap, best: Hypothesis) -> float:
        """Of the wall of `part`, the share that lies on known wall."""
        weight, known = part.raster.weight, self._known[number].raster
        on_wall = coinciding(known, part.raster, best.transform, self._p.fusion.verification)
        return float(weight[on_wall].sum() / max(weight.sum(), 1e-9))


def _about(pose: FloatArray, p: PlaceFinderParameters) -> FloatArray:
    """(n, 3) poses about `pose` (3,), itself among them [m, m, rad]."""
    shifts = np.linspace(-p.near, p.near, 2 * int(np.ceil(p.near / p.step)) + 1)
    turns = np.linspace(-p.near_turn, p.near_turn, 2 * int(np.ceil(p.near_turn / p.turn_step)) + 1)
    x, y, turn = (each.ravel() for each in np.meshgrid(shifts, shifts, turns, indexing="ij"))
    return np.asarray(pose + np.column_stack([x, y, turn]))
