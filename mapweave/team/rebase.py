"""An alignment found between earlier states of two robot maps, carried over to their present ones.

An alignment says how two components lie to each other; what was compared are walls in their
submaps. When a robot corrects its map, by a loop that it closes, the submaps move within the
component. What they have in common moves with them, so the alignment is kept there. When a robot
finds that a submap is elsewhere, what was aligned by way of it is open again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeAlias

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment, RobotMap, Submap, parse_component
from mapweave.reasons import Reason, ReasonKind

ThenAndNow: TypeAlias = tuple["SubmapPlace", Submap]
Known: TypeAlias = dict[int, ThenAndNow]


class SubmapPlace(NamedTuple):
    """Where a submap was: (3,) `pose` [m, m, rad] in component number `component`.

    The index of its `first` scan tells which one it is, as ids move on where one before is cut;
    that of its `last` scan whether it was cut itself.
    """

    component: int
    pose: FloatArray
    first: int | None
    last: int | None


@dataclass(frozen=True, slots=True, eq=False)
class Change:
    """What became of a robot map: where its submaps were `then`, by id, and the map `now`."""

    then: Mapping[int, SubmapPlace]
    now: RobotMap


def places_of(robot_map: RobotMap) -> dict[int, SubmapPlace]:
    """Return where each submap is, by its id."""
    return {s.id: SubmapPlace(s.component, s.pose, *_span(s)) for s in robot_map.submaps}


def carry(alignment: Alignment, reference: Change, other: Change) -> Alignment:
    """Return `alignment`, found between the maps as they were then, for the maps as they are now.

    It holds on to the submaps of its places, the first that is left, and where none are told, to
    the two submaps that it brings nearest to each other; where all of these have left their
    component, what was accepted is ambiguous until the maps are compared again.
    """
    ours = _then(reference, alignment.reference)
    theirs = _then(other, alignment.other)
    if not ours or not theirs:
        return alignment
    if alignment.places:
        return _carried_at_places(alignment, ours, theirs)
    return _carried_at_nearest(alignment, list(ours.values()), list(theirs.values()))


def _carried_at_places(alignment: Alignment, ours: Known, theirs: Known) -> Alignment:
    """Return `alignment` as its places have it now: those of submaps that are where they were."""
    held = []
    for place in alignment.places:
        one, other = ours.get(place.reference), theirs.get(place.other)
        if one and other and not (_has_left(*one) or _has_left(*other)):
            at = se2.transform_points(_motion(*one), place.at)
            held.append((one, other, replace(place, reference=one[1].id, other=other[1].id, at=at)))
    if not held:
        return _opened(alignment)
    moved = alignment.transform
    one, other, first = held[0]
    if _motion(*one).any() or _motion(*other).any():
        there = se2.compose(one[1].pose, first.transform)
        moved = se2.compose(there, se2.inverse(other[1].pose))
    return replace(alignment, transform=moved, places=tuple(place for _, _, place in held))


def _carried_at_nearest(
    alignment: Alignment, ours: Sequence[ThenAndNow], theirs: Sequence[ThenAndNow]
) -> Alignment:
    here = np.array([_middle_then(*each) for each in ours])
    there = np.array([_middle_then(*each) for each in theirs])
    there = se2.transform_points(alignment.transform, there)
    apart = np.hypot(*(here[:, None] - there[None]).transpose(2, 0, 1))
    i, j = (int(k) for k in np.unravel_index(int(apart.argmin()), apart.shape))
    if _has_left(*ours[i]) or _has_left(*theirs[j]):
        return _opened(alignment)
    first, second = _motion(*ours[i]), _motion(*theirs[j])
    if not (first.any() or second.any()):
        return alignment
    moved = se2.compose(first, se2.compose(alignment.transform, se2.inverse(second)))
    return replace(alignment, transform=moved)


def _opened(alignment: Alignment) -> Alignment:
    if alignment.decision != "accepted":
        return alignment
    return replace(alignment, decision="ambiguous", cause=Reason(ReasonKind.REBASED))


def _then(change: Change, component: str) -> Known:
    """Return where submaps were in this component then, and what they are now, by their id then."""
    _, number = parse_component(component)
    now = {s.id if _span(s)[0] is None else ("scan", _span(s)[0]): s for s in change.now.submaps}
    found: Known = {}
    for identity, place in change.then.items():
        submap = now.get(identity if place.first is None else ("scan", place.first))
        if submap is not None and place.component == number:
            found[identity] = place, submap
    return found


def _has_left(then: SubmapPlace, now: Submap) -> bool:
    """Whether a submap, or its last scans, are in another component."""
    last = _span(now)[1]
    cut = last is not None and then.last is not None and last < then.last
    return now.component != then.component or cut


def _span(submap: Submap) -> tuple[int | None, int | None]:
    """Return the indices of a submap's first and last scan; None where it has none."""
    indices = submap.trajectory.scan_index
    return (int(indices[0]), int(indices[-1])) if len(indices) else (None, None)


def _middle_then(then: SubmapPlace, now: Submap) -> FloatArray:
    """(2,) middle of a submap's wall [m], where it was then in its component."""
    ends = now.map.segments.reshape(-1, 2)
    middle = ends.mean(axis=0) if len(ends) else np.zeros(2)
    return se2.transform_points(then.pose, middle)


def _motion(then: SubmapPlace, now: Submap) -> FloatArray:
    """(3,) by which a submap has moved in its component's frame since then; zeros if not at all."""
    if np.array_equal(then.pose, now.pose):
        return np.zeros(3)
    return se2.compose(now.pose, se2.inverse(then.pose))
