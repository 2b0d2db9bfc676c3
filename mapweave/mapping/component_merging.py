"""Lost and found: a robot's components are joined once what both saw proves it (paper, II).

By the means by which two robots' maps are joined: a component is a map like any other. But most
robots that lost track were not carried away. Where the maps leave it open, a component is looked
for where the robot was when it lost track of the one before; what both saw decides as ever.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from heapq import nlargest

import numpy as np
from pydantic import Field

from mapweave.fusion.align import FusionParameters, compare, prepare
from mapweave.fusion.decision import DecisionParameters
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.geometry.segments import lengths
from mapweave.mapping.localization.gaps import GapParameters, between_them
from mapweave.mapping.localization.leaps import LeapJudge, LeapParameters
from mapweave.mapping.place_recognition import PlaceRecognitionParameters, PlaceRecognizer
from mapweave.maps import Alignment, LineMap, Submap, lines_of
from mapweave.matching.common_lines import count_common_lines
from mapweave.matching.hypotheses import PreparedMap
from mapweave.parameters import StageParameters, derived


class ComponentMergingParameters(StageParameters):
    """When components are compared, and where a robot that lost track is looked for."""

    # Nothing undoes a join within a robot's map, so a shape is asked for, not straight walls alone;
    # nor does rarity make up for what else is asked.
    fusion: FusionParameters = derived(
        lambda c: FusionParameters.of(
            c, decision=DecisionParameters.of(c, plain_held=math.inf, min_rarity=math.inf)
        )
    )
    place_recognition: PlaceRecognitionParameters = derived(PlaceRecognitionParameters.of)
    gaps: GapParameters = derived(GapParameters.of)
    leaps: LeapParameters = derived(LeapParameters.of)
    min_lines: int = Field(
        3, ge=1, description="straight lines in common: one corner of a hall is like the next"
    )
    rare: float = Field(
        60.0,
        ge=0,
        description="[bits] of what is shared, as of what tells a place among all of all maps:"
        " bays that a building repeats have metres of wall in common, and little that is rare",
    )
    rare_there: float = Field(
        40.0,
        ge=0,
        description="[bits] of a place where the robot lost track: 20 less, as no pair of maps is"
        " picked there from a million, nor a place from half a million",
    )
    min_confidence: float = Field(
        0.5,
        gt=0,
        lt=1,
        description="of a place where the robot lost track: that it is there needs less proof than"
        " that it is anywhere",
    )
    min_lead: float = Field(
        0.0, ge=0, description="[m] of score before the next best place, there: its share decides"
    )
    growth: float = Field(
        0.15, gt=0, description="share by which either has grown before a pair is compared again"
    )
    comparisons: int = Field(
        4, ge=1, description="of components, when a submap is finished; others wait for the next"
    )
    waiting: int = Field(
        500, ge=1, description="pairs that may wait; more are asked when one of them has grown"
    )
    place: float = Field(2.0, gt=0, description="[m] within which the middles of submaps are alike")
    visits: int = Field(
        3, ge=1, description="submaps of a place that are compared, the last; more tell little more"
    )


class ComponentMerger:
    """Remembers what it compared: a pair that was refused is asked again when it has grown.

    The first `known` submaps are of earlier runs.
    """

    def __init__(
        self, parameters: ComponentMergingParameters | None = None, known: int = 0
    ) -> None:
        self._p = parameters or ComponentMergingParameters()
        self._compared: dict[tuple[int, int], tuple[float, float]] = {}  # [m] of wall, then
        self._walls: dict[int, float] = {}  # [m] in each component, the last time
        self._due: set[tuple[int, int]] = set()
        self._shapes: dict[int, tuple[object, PreparedMap | None]] = {}
        self._place_recognizer = PlaceRecognizer(self._p.place_recognition, self._p.fusion)
        self._leap_judge = LeapJudge(self._p.leaps, known)

    def reunite(
        self, submaps: Sequence[Submap], tracked: int = 1
    ) -> tuple[list[Submap], list[tuple[int, int]]]:
        """Join components where what both saw proves it, the younger one into the older one.

        Parameters
        ----------
        submaps
            In the order in which they were seen.
        tracked
            How many of the last ones were tracked from one another.

        Returns
        -------
        submaps
            In the same order, with their new components and poses.
        joints
            For each join, the ids of a submap of the older and one of the younger component:
            those that are nearest where the shapes were compared, because what tracking did to the
            rest of either component is not the join's.
        """
        joined = list(submaps)
        joints: list[tuple[int, int]] = []
        for _ in range(self._p.comparisons):
            pair = self._next(joined)
            if pair is None:
                break
            after = self._joined(joined, *pair)
            if after is not None:
                of_younger = {s.id for s in joined if s.component == pair[1]}
                joints.append(_nearest(after, pair[0], of_younger))
                joined = after
        if not joints:
            joined, joints = self._recognised(joined, tracked)
        if joints:
            self._place_recognizer.forget()
        return joined, joints

    def forget(self) -> None:
        """Rely on no frame that it remembers, as when components were joined by others."""
        self._place_recognizer.forget()

    def note_jump(self, scan: int) -> None:
        """Note that what was mapped shows a jump: from number `scan` on it was elsewhere."""
        self._leap_judge.note_jump(scan)

    def _recognised(
        self, submaps: list[Submap], tracked: int
    ) -> tuple[list[Submap], list[tuple[int, int]]]:
        """Join the component of the newest submap with another one where it is found in it."""
        part = submaps[-tracked:]
        found = self._place_recognizer.look(submaps, part, lambda c: self._shape(submaps, c))
        if found is None:
            return submaps, []
        newest = submaps[-1]
        here, there = newest.component, found.component
        if self._leap_judge.leaps(submaps, (there, here), found.transform):
            return submaps, []  # where it was carried to is found by its shape
        if here < there:
            joined = self._moved(submaps, here, there, se2.inverse(found.transform))
        else:
            joined = self._moved(submaps, there, here, found.transform)
        of_there = {s.id for s in submaps if s.component == there}
        nearest = _nearest_to(newest.id, joined, of_there)
        return joined, [(newest.id, nearest) if here < there else (nearest, newest.id)]

    def _moved(
        self, submaps: Sequence[Submap], older: int, younger: int, transform: FloatArray
    ) -> list[Submap]:
        """Return `submaps`, those of `younger` in `older`, to which `transform` (3,) takes them."""
        self._shapes.pop(younger, None)
        return [
            replace(s, component=older, pose=se2.compose(transform, s.pose))
            if s.component == younger
            else s
            for s in submaps
        ]

    def _next(self, submaps: Sequence[Submap]) -> tuple[int, int] | None:
        """Return the pair of components, the older first, that is most worth comparing; or none.

        One in which the newest submap is comes before all others, then that with the most wall in
        both. Only so many are compared at once: the others wait, so that a robot that is lost again
        and again does not pay for all its pieces with each of them.
        """
        newest = submaps[-1].component if submaps else 0

        def worth(pair: tuple[int, int]) -> tuple[bool, float, tuple[int, int]]:
            return newest in pair, min(self._walls[c] for c in pair), pair

        self._note_growth(_walls(submaps))
        if len(self._due) > self._p.waiting:
            self._due = set(nlargest(self._p.waiting, self._due, key=worth))
        return max(self._due, key=worth, default=None)

    def _note_growth(self, walls: dict[int, float]) -> None:
        """Note which pairs are due, now that the components have `walls` [m]."""
        known, self._walls = self._walls, walls
        enough = {c for c, wall in walls.items() if wall >= self._p.fusion.min_wall}
        self._due = {pair for pair in self._due if enough.issuperset(pair)}
        for one in (c for c in enough if walls[c] != known.get(c)):
            pairs = [(min(one, other), max(one, other)) for other in enough - {one}]
            self._due.update(pair for pair in pairs if self._is_due(pair))

    def _joined(self, submaps: Sequence[Submap], older: int, younger: int) -> list[Submap] | None:
        """Return `submaps` with two components as one, where what both saw proves it."""
        self._compared[older, younger] = self._walls[older], self._walls[younger]
        self._due.remove((older, younger))
        alignment, rare = self._compare(submaps, older, younger)
        shapes = self._shape(submaps, older), self._shape(submaps, younger)
        if alignment.decision != "accepted" or not self._tells(*shapes, alignment.transform):
            return None
        if (alignment.evidence.rarity or 0.0) < rare:
            return None  # asked again once either has grown
        if self._is_far_fetched(submaps, (older, younger), alignment):
            return None
        return self._moved(submaps, older, younger, alignment.transform)

    def _is_far_fetched(
        self, submaps: Sequence[Submap], pair: tuple[int, int], alignment: Alignment
    ) -> bool:
        """Whether the robot would have leaped, and what it saw since does not say so as well."""
        join, second = alignment.transform, self._shape(submaps, pair[1])
        if second is None or not self._leap_judge.leaps(submaps, pair, join):
            return False
        middle = second.raster.middle
        common = alignment.evidence.common or 0.0
        return not self._leap_judge.is_believed(pair, join, common, middle)

    def _tells(
        self, first: PreparedMap | None, second: PreparedMap | None, transform: FloatArray
    ) -> bool:
        """Whether what two components share is more than a corner."""
        if first is None or second is None:
            return False
        rasters, p = (first.raster, second.raster), self._p
        found = count_common_lines(*rasters, transform, second.lines, p.fusion.verification)
        return found >= p.min_lines

    def _compare(
        self, submaps: Sequence[Submap], older: int, younger: int
    ) -> tuple[Alignment, float]:
        """Compare two components anywhere, and where that leaves it open, where track was lost.

        Returns how rare [bits] what they share must be as well.
        """
        first, second = self._shape(submaps, older), self._shape(submaps, younger)
        names, p = ("older", "younger"), self._p
        anywhere = compare(names[0], first, names[1], second, p.fusion, closely=True)
        accepted = anywhere.decision == "accepted"
        if accepted and not self._leap_judge.leaps(submaps, (older, younger), anywhere.transform):
            return anywhere, p.rare
        possible = between_them(submaps, older, younger, p.gaps)
        if len(possible) == 0:
            return anywhere, p.rare
        proof = {"min_confidence": p.min_confidence, "min_lead": p.min_lead}
        # Where track was lost, the room that is there is the same room.
        expected = p.fusion.model_copy(
            update={
                "decision": p.fusion.decision.model_copy(update=proof),
                "rooms": p.fusion.rooms.model_copy(update={"min_outside": 0.0, "unique": 1.0}),
            }
        )
        here = compare(names[0], first, names[1], second, expected, possible)
        # A better place elsewhere says that it was carried away.
        best = max(anywhere.evidence.score or 0.0, 0.0)
        is_there = (here.evidence.score or 0.0) >= 0.95 * best
        return (here, p.rare_there) if is_there else (anywhere, p.rare)

    def _shape(self, submaps: Sequence[Submap], component: int) -> PreparedMap | None:
        """Prepare a component, unless it is as it was the last time."""
        inside = _covering([s for s in submaps if s.component == component], self._p)
        now = tuple((s.map, s.pose.tobytes()) for s in inside)
        known, shape = self._shapes.get(component, (None, None))
        if known != now:
            shape = prepare(lines_of(inside), self._p.fusion)
            self._shapes[component] = now, shape
        return shape

    def _is_due(self, pair: tuple[int, int]) -> bool:
        """Whether either of a pair has notably more wall than when it was compared, or less."""
        before, grown = self._compared.get(pair), 1 + self._p.growth
        if before is None:
            return True
        now = (self._walls[c] for c in pair)
        return any(not b / grown <= w <= grown * b for w, b in zip(now, before, strict=True))


def _covering(inside: Sequence[Submap], p: ComponentMergingParameters) -> list[Submap]:
    """Return the last submaps of each place: however often it was seen, a building stays as large.

    In the order of `inside`.
    """
    kept: list[tuple[Submap, tuple[float, float]]] = []
    for submap in reversed(inside):
        middle = _middle_of_walls(submap)
        if sum(math.dist(middle, other) < p.place for _, other in kept) < p.visits:
            kept.append((submap, middle))
    return [submap for submap, _ in reversed(kept)]


def _nearest(submaps: Sequence[Submap], component: int, younger: set[int]) -> tuple[int, int]:
    """Return the ids of the nearest two submaps, one in `younger` and one that is not."""
    inside = [(s.id, _middle_of_walls(s)) for s in submaps if s.component == component]
    _, first, second = min(
        (math.dist(a, b), one, other)
        for one, a in inside
        if one not in younger
        for other, b in inside
        if other in younger
    )
    return first, second


def _nearest_to(number: int, submaps: Sequence[Submap], others: set[int]) -> int:
    """Return the id of that of `others` which is nearest to submap `number`."""
    here = _middle_of_walls(submaps[number])
    return min(others, key=lambda other: math.dist(here, _middle_of_walls(submaps[other])))


def _middle_of_walls(submap: Submap) -> tuple[float, float]:
    """Middle of a submap's walls, component frame [m]; of none its frame's origin."""
    points = submap.map.segments.reshape(-1, 2)
    centre = points.mean(axis=0) if len(points) else np.zeros(2)
    x, y = se2.transform_points(submap.pose, centre).tolist()
    return x, y


def _walls(submaps: Sequence[Submap]) -> dict[int, float]:
    """[m] of wall in the submaps of each component."""
    walls: dict[int, float] = {}
    for s in submaps:
        walls[s.component] = walls.get(s.component, 0.0) + _wall(s.map)
    return walls


@lru_cache(1024)
def _wall(lines: LineMap) -> float:
    """[m] of wall; lines are the same object as long as they are the same lines."""
    return float(lengths(lines.segments).sum())
