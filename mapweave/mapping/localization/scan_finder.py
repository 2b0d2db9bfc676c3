"""Where one scan alone is in a known map, looked for everywhere in some hundredths of a second.

A scan is a line map of its own, with the free space that it saw: coarse to fine it is laid into
each component, at each turn at which much wall is parallel. Where its returns lie decides: on known
walls, or where the map was seen through; and known walls that the scan sees through. A look-alike
is a rival: by how much a place must be ahead of it grows with what the place leaves unexplained.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import BoolArray, FloatArray
from mapweave.mapping.localization.known_map import KnownMap
from mapweave.mapping.tracking.observation import Observation
from mapweave.maps import LineMap
from mapweave.matching.coarse_places import CoarseMap, CoarsePlaceParameters, coarse_places
from mapweave.matching.common_lines import count_common_lines
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters
from mapweave.matching.hypotheses import HypothesisParameters, different
from mapweave.matching.icp import IcpParameters, Target, align_all
from mapweave.matching.verification import VerificationParameters, verify
from mapweave.parameters import StageParameters, derived
from mapweave.scan.free_space import FreeSpaceParameters, rings, seen_free
from mapweave.scan.points import OrientedPoints
from mapweave.scan.visibility import sights_of


class ScanFinderParameters(StageParameters):
    """How a scan is looked for, and what a place must show to be the one.

    Set on scans of the later parts of fr079, Intel and CSAIL, in maps of the first
    (``python -m benchmarks relocalize``).
    """

    raster: DistanceFieldParameters = derived(DistanceFieldParameters.of)
    coarse: CoarsePlaceParameters = derived(
        lambda c: CoarsePlaceParameters.of(c, shifts=40, aligned=80)
    )
    verification: VerificationParameters = derived(VerificationParameters.of)
    free_space: FreeSpaceParameters = derived(FreeSpaceParameters.of)
    icp: IcpParameters = derived(IcpParameters.of)
    distinct: HypothesisParameters = derived(
        lambda c: HypothesisParameters.of(c, count=12, distance=0.3, turn=0.1)
    )
    points: int = Field(180, ge=10, description="of the scan, in the alignment")
    explained: float = derived(
        lambda c: 0.6 * c.mapping.closeness,
        gt=0,
        description="[m] of a known wall within which a return is explained",
    )
    roughly: float = derived(
        lambda c: 0.8 * c.mapping.closeness, gt=0, description="[m] the same before it is aligned"
    )
    weight: float = Field(
        0.5, ge=0, description="share of the returns that counts as much as all wall contradicted"
    )
    least: float = Field(0.5, gt=0, le=1, description="worth of a place, in shares of the returns")
    least_wall: float = Field(2.0, gt=0, description="[m] of wall that the scan shows, in common")
    least_held: float = Field(0.0, ge=0, description="[m] of it across the weakest direction")
    held_share: float = Field(
        0.0, ge=0, description="[m] of that, for what the place leaves unexplained, besides"
    )
    lead: float = Field(0.03, gt=0, description="share of the returns before the next best place")
    lead_share: float = Field(
        0.3, ge=0, description="of what the place leaves unexplained, that it leads by besides"
    )
    apart: float = Field(0.5, gt=0, description="[m] between rivals")
    apart_turn: float = Field(0.2, gt=0, description="[rad] between rivals")


class ScanPlace(NamedTuple):
    """Where a scan may be: in which component, its pose (3,) there, and what that is worth.

    Of the walls in `common` [m], `held` [m] hold the weakest direction.
    """

    component: int
    pose: FloatArray
    worth: float
    common: float
    held: float


class SeenFrom(NamedTuple):
    """A scan, and its pose (3,) in a frame that some scans share."""

    scan: Observation
    pose: FloatArray


def _worth(place: ScanPlace) -> float:
    return place.worth


def _anywhere(poses: FloatArray) -> BoolArray:
    """All of (k, 3) `poses` can be."""
    return np.ones(len(poses), dtype=np.bool_)


class _Known(NamedTuple):
    """A component as it is looked in."""

    lines: LineMap
    coarse: CoarseMap
    field: DistanceField
    target: Target


class ScanFinder:
    """Looks for single scans in a `known` map."""

    def __init__(self, known: KnownMap, parameters: ScanFinderParameters | None = None) -> None:
        self._p = p = parameters or ScanFinderParameters()
        self._known: dict[int, _Known] = {}
        for number, lines in known.components.items():
            if len(lines.segments):
                field = DistanceField.of(lines, p.raster)
                coarse = CoarseMap.of(lines, p.coarse, p.verification)
                target = Target.of(field.oriented, p.icp)
                self._known[number] = _Known(lines, coarse, field, target)

    def find(self, seen: Observation) -> ScanPlace | None:
        """Return where a scan is, if no other place is about as good."""
        return self.find_together([SeenFrom(seen, se2.IDENTITY)])

    def find_together(
        self,
        seen: Sequence[SeenFrom],
        allows: Callable[[FloatArray], BoolArray] = _anywhere,
    ) -> ScanPlace | None:
        """Return where the first of some scans is, if no other place is about as good for all.

        Each of them proposes places, and all of them judge these.

        Parameters
        ----------
        allows
            Tells which of (k, 3) poses of the first can be. One of the others speaks against all
            of these if it is worth more.
        """
        told = [each for each in seen if len(each.scan.oriented) and len(each.scan.segments)]
        places = [place for k in range(len(told)) for place in self._places_of_first(told, k)]
        if not places:
            return None
        possible = allows(np.array([each.pose for each in places]))
        best = max(
            (t for t, can in zip(places, possible, strict=True) if can), key=_worth, default=None
        )
        return best if best is not None and self._is_proven(best, places, possible) else None

    def common_lines(self, seen: Sequence[SeenFrom], first: ScanPlace) -> int:
        """Return how many straight lines the map shares with one of some scans, at the most."""
        p, known, found = self._p, self._known[first.component], 0
        for each in (each for each in seen if len(each.scan.segments)):
            lines = self._lines(each.scan)
            at = se2.compose(first.pose, se2.between(seen[0].pose, each.pose))
            fields = known.field, DistanceField.of(lines, p.raster)
            found = max(found, count_common_lines(*fields, at, lines, p.verification))
        return found

    def _is_proven(self, best: ScanPlace, places: list[ScanPlace], possible: BoolArray) -> bool:
        """Whether a place is worth much, and more than what may be instead."""
        p = self._p
        rival = elsewhere = -1.0
        for place, can in zip(places, possible.tolist(), strict=True):
            if not can:
                elsewhere = max(elsewhere, place.worth)
            elif self._differs(best, place):
                rival = max(rival, place.worth)
        lead = p.lead + p.lead_share * (1.0 - best.worth)
        least = max(p.least, rival + lead, elsewhere - p.lead)
        held = p.least_held + p.held_share * (1.0 - best.worth)
        return best.worth >= least and best.common >= p.least_wall and best.held >= held

    def _places_of_first(self, seen: Sequence[SeenFrom], k: int) -> Iterable[ScanPlace]:
        """Yield where the first of some scans is by what number `k` proposes, worth to all."""
        own = se2.between(seen[0].pose, seen[k].pose)
        for place in self._places(seen[k].scan):
            first, known = se2.compose(place.pose, se2.inverse(own)), self._known[place.component]
            worth = place.worth
            for other in (each for m, each in enumerate(seen) if m != k):
                at = se2.compose(first, se2.between(seen[0].pose, other.pose))
                worth += float(
                    self._shares(other.scan.oriented, known, at[None], self._p.roughly)[0]
                )
            yield ScanPlace(place.component, first, worth / len(seen), place.common, place.held)

    def _lines(self, seen: Observation) -> LineMap:
        """Return the scan as a line map in its own frame, with the free space that it saw."""
        p, lines = self._p.free_space, seen.lines
        free = seen_free(sights_of([seen.scan], np.zeros((1, 3)), p.sight), p)
        support = np.full(len(lines.segments), self._p.raster.full_support)
        return LineMap(lines.segments, lines.polyline, support, rings(free))

    def _places(self, seen: Observation) -> Iterable[ScanPlace]:
        """Yield the places of a scan in all components that are worth most, aligned."""
        p, oriented, lines = self._p, seen.oriented, self._lines(seen)
        coarse = CoarseMap.of(lines, p.coarse, p.verification)
        field = DistanceField.of(lines, p.raster)
        thinned = oriented.at(slice(None, None, 1 + (len(oriented) - 1) // p.points))
        middle = thinned.points.mean(axis=0)
        for number, known in self._known.items():
            likely = coarse_places(known.coarse, coarse, p.coarse, p.verification).aligned
            if len(likely) == 0:
                continue
            shares = self._shares(thinned, known, likely, p.roughly)
            best = different(likely, shares, middle, p.distinct)
            for fit in align_all(thinned, known.target, likely[best], p.icp):
                verdict = verify(known.field, field, fit.pose, p.verification)
                against = verdict.contradicted / max(verdict.common + verdict.contradicted, 1e-9)
                share = float(self._shares(oriented, known, fit.pose[None], p.explained)[0])
                worth = share - p.weight * against
                yield ScanPlace(number, fit.pose, worth, verdict.common, verdict.held)

    def _shares(
        self, oriented: OrientedPoints, known: _Known, poses: FloatArray, explained: float
    ) -> FloatArray:
        """(k,) share of the returns `explained` [m] by walls, less that where space was free."""
        p = self._p
        placed = np.stack([se2.transform_points(pose, oriented.points) for pose in poses])
        _, distance, depth = known.field.look_up(placed)
        denied = (depth > p.verification.clearance) & (distance > p.verification.closeness)
        return np.asarray((distance < explained).mean(axis=1) - denied.mean(axis=1))

    def _differs(self, best: ScanPlace, other: ScanPlace) -> bool:
        """Whether two places are not one, found twice."""
        if best.component != other.component:
            return True
        x, y, turn = se2.between(best.pose, other.pose).tolist()
        return bool(np.hypot(x, y) > self._p.apart or abs(turn) > self._p.apart_turn)
