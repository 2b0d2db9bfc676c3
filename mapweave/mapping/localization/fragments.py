"""Fragments: what a robot mapped while it was lost, taken up once what it saw is mapped.

Where scans are few or a crowd is about, a robot loses track again and again, and leaves components
of one or a few scans, which show too little to be compared as maps. But the robot was where it can
have come in the time. Single scans of a fragment are looked for in the largest component: a place
there must explain all of them, as no other within reach does, nor much better one elsewhere.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.localization.known_map import KnownMap
from mapweave.mapping.localization.scan_finder import ScanFinder, ScanFinderParameters, SeenFrom
from mapweave.mapping.localization.whereabouts import Path, Whereabouts, WhereaboutsParameters
from mapweave.mapping.tracking.observation import Observation
from mapweave.maps import Submap
from mapweave.parameters import StageParameters, derived


class FragmentParameters(StageParameters):
    """What a fragment is, and how many are looked for."""

    # Nothing undoes a join: more is asked than of a robot that is only followed. On every third
    # and fourth scan of four recordings no wrong place of 68 shows this, and 43 of 65 right ones.
    finder: ScanFinderParameters = derived(
        lambda c: ScanFinderParameters.of(
            c, least=0.6, least_wall=3.0, least_held=0.5, held_share=3.0
        )
    )
    whereabouts: WhereaboutsParameters = derived(WhereaboutsParameters.of)
    submaps: int = Field(3, ge=1, description="of a component, the most; larger ones are compared")
    probes: int = Field(3, ge=1, description="scans of a submap that are looked for")
    kept: int = Field(40, ge=1, description="submaps that wait to be taken up, the newest")
    unseen_lines: int = Field(
        3,
        ge=1,
        description="straight lines in common, after scans that showed nothing: what is where it"
        " went unseen is not mapped, and one corner of a hall is like the next",
    )
    asked: int = Field(2, ge=1, description="of them, when a submap is finished")
    growth: float = Field(
        0.15, gt=0, description="share by which more scans were mapped there before one is asked"
    )


class _Waiting(NamedTuple):
    """Scans of a submap, (k, 3) their poses in its frame, and how much was mapped when asked."""

    scans: tuple[Observation, ...]
    poses: FloatArray
    mapped: int


class TakenUp(NamedTuple):
    """All `submaps`, with their new components and poses, and the ids of two that were joined.

    The first of these is of the older component.
    """

    submaps: list[Submap]
    joint: tuple[int, int]


class FragmentFinder:
    """Keeps scans of components of few submaps until these are found in the largest one."""

    def __init__(self, parameters: FragmentParameters | None = None) -> None:
        self._p = parameters or FragmentParameters()
        self._waiting: dict[int, _Waiting] = {}  # by submap
        self._known: tuple[object, ScanFinder] | None = None

    def note(self, submap: Submap, scans: Sequence[Observation]) -> None:
        """Keep some `scans` of a submap: those of its trajectory, in that order."""
        few = np.unique(np.linspace(0, len(scans) - 1, self._p.probes).round().astype(int))
        chosen = tuple(scans[k] for k in few.tolist())
        self._waiting[submap.id] = _Waiting(chosen, submap.trajectory.pose[few], 0)
        for old in list(self._waiting)[: -self._p.kept]:
            del self._waiting[old]

    def take_up(self, submaps: Sequence[Submap]) -> TakenUp | None:
        """Find a fragment in the largest component, if one is there.

        The newest is asked first, then those that wait longest: only so many at once, and only
        where more is mapped by now than when they were asked last.
        """
        sizes = Counter[int]()
        for submap in submaps:
            sizes[submap.component] += len(submap.trajectory.scan_index)
        largest = max(sizes, key=lambda c: (sizes[c], -c))
        self._forget(submaps)
        if len(sizes) == 1 or not self._waiting:
            return None
        known, asked = Path.of(submaps, largest), 0
        for number in sorted(self._waiting, key=lambda k: (k != submaps[-1].id, k)):
            if submaps[number].component == largest or asked >= self._p.asked:
                continue
            where = self._whereabouts(submaps[number], submaps, known)
            if where is None:
                continue
            asked += 1
            transform = self._found(submaps, number, largest, where)
            if transform is not None:
                return _taken_up(submaps, number, largest, transform)
        return None

    def _forget(self, submaps: Sequence[Submap]) -> None:
        """Keep no scans of components that are no fragments any more."""
        counts = Counter(s.component for s in submaps)
        for number in list(self._waiting):
            if counts[submaps[number].component] > self._p.submaps:
                del self._waiting[number]

    def _whereabouts(
        self, submap: Submap, submaps: Sequence[Submap], known: Path
    ) -> Whereabouts | None:
        """Return where a fragment may be, if more is mapped there than when it was asked last."""
        lost = Path.of(submaps, submap.component)
        mapped = np.concatenate([s.trajectory.scan_index for s in submaps])
        where = Whereabouts(lost, known, mapped, self._p.whereabouts)
        waiting, count = self._waiting[submap.id], where.mapped(known)
        if count <= (1 + self._p.growth) * waiting.mapped:
            return None
        self._waiting[submap.id] = waiting._replace(mapped=count)
        return where

    def _found(
        self, submaps: Sequence[Submap], number: int, largest: int, where: Whereabouts
    ) -> FloatArray | None:
        """(3,) transform by which the component of a submap is found in the `largest` one."""
        waiting = self._waiting[number]
        poses = se2.compose(submaps[number].pose, waiting.poses)
        seen = [SeenFrom(*each) for each in zip(waiting.scans, poses, strict=True)]
        back = se2.inverse(poses[0])
        finder = self._finder(submaps, largest)
        found = finder.find_together(seen, lambda firsts: where.allows(se2.compose(firsts, back)))
        if found is None:
            return None
        if where.went_unseen and finder.common_lines(seen, found) < self._p.unseen_lines:
            return None
        return se2.compose(found.pose, back)

    def _finder(self, submaps: Sequence[Submap], component: int) -> ScanFinder:
        """Prepare a component, unless it is as it was the last time."""
        inside = tuple(s for s in submaps if s.component == component)
        now = [(s.map, s.pose.tobytes()) for s in inside]
        if self._known is None or self._known[0] != now:
            self._known = now, ScanFinder(KnownMap(inside), self._p.finder)
        return self._known[1]


def _taken_up(
    submaps: Sequence[Submap], number: int, largest: int, transform: FloatArray
) -> TakenUp:
    """Join the component of submap `number`, to which `transform` (3,) belongs, with another."""
    fragment = submaps[number].component
    older, younger = min(fragment, largest), max(fragment, largest)
    moved = transform if fragment == younger else se2.inverse(transform)
    here = se2.compose(transform, submaps[number].pose)[:2]
    beside = min(
        (s for s in submaps if s.component == largest),
        key=lambda s: (np.hypot(*(_middle(s) - here)), s.id),
    )
    joined = [
        replace(s, component=older, pose=se2.compose(moved, s.pose))
        if s.component == younger
        else s
        for s in submaps
    ]
    joint = (beside.id, number) if fragment == younger else (number, beside.id)
    return TakenUp(joined, joint)


def _middle(submap: Submap) -> FloatArray:
    """(2,) of where a submap's scans were taken, component frame [m]."""
    poses = se2.compose(submap.pose, submap.trajectory.pose)
    return np.asarray(poses[:, :2].mean(axis=0))
