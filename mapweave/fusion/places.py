"""Alignments at places: where two maps are compared about a place that both may have seen.

Whole maps are bent, so that no one transform may lay one on the other; what lies about a place is
not. The index of shapes proposes such places (paper, VIII, H1 and H2), the submaps about each are
compared as wholes are, and what comes of it must agree: with what both maps go on to say, bends
allowed for, and with the other places. Look-alikes that agree with each other less than half as
much as the best are set aside; more than that, and nothing is sure.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from pydantic import Field

from mapweave.fusion.agreement import AgreementParameters, difference
from mapweave.fusion.beyond import contradicted_beyond
from mapweave.fusion.component import Component, Window
from mapweave.fusion.decision import DecisionParameters
from mapweave.fusion.extrapolation import ExtrapolationParameters
from mapweave.fusion.shared_places import SharedPlaceParameters, shared_places, shared_samples
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment, SharedPlace
from mapweave.matching.place_index import PlaceIndex, PlaceIndexParameters
from mapweave.matching.verification import VerificationParameters
from mapweave.parameters import StageParameters, derived
from mapweave.reasons import Reason, ReasonKind

LIKELY = 2.45  # standard deviations along x and y, within which 19 of 20 are
Looking: TypeAlias = Callable[[Window, Window], Alignment]


class PlaceParameters(StageParameters):
    """Which places are compared, and when alignments at places agree."""

    index: PlaceIndexParameters = derived(PlaceIndexParameters.of)
    radius: float = derived(
        lambda c: 1.5 * c.mapping.submap_length,
        gt=0,
        description="[m] about a place within which submaps are rigid",
    )
    one_place: float = derived(
        lambda c: 4 * c.mapping.submap_length,
        gt=0,
        description="[m] of the longer side of a map that is one place: what lies about one",
    )
    proposed: int = Field(5, ge=1, description="places of each submap that the index proposes")
    min_score: float = Field(
        4.0, gt=0, description="[m] in common less contradicted, of a place worth comparing"
    )
    apart: float = Field(4.0, gt=0, description="[m] between places compared, in either map")
    most: int = Field(8, ge=1, description="places compared, those that score best")
    agreement: AgreementParameters = AgreementParameters()
    max_rival: float = Field(
        0.5, gt=0, lt=1, description="wall that speaks for the best others, as a share"
    )
    one_way: float = Field(
        8.0, gt=0, description="metres that count for each that holds the weakest direction"
    )
    verification: VerificationParameters = derived(VerificationParameters.of)
    decision: DecisionParameters = derived(DecisionParameters.of)
    bends: ExtrapolationParameters = ExtrapolationParameters()
    shared: SharedPlaceParameters = SharedPlaceParameters()


@dataclass(frozen=True, slots=True, eq=False)
class PlaceAlignment:
    """What came of comparing two maps about a place, or as wholes.

    Attributes
    ----------
    alignment
        With the places where it holds.
    middle
        (2,) of the wall in common, frame of the other component [m].
    metres
        Of wall in common that tell the place, by the id of the other component's submap.
    """

    alignment: Alignment
    middle: FloatArray
    metres: dict[int, float]


def compare_at_places(
    first: Component, second: Component, whole: Alignment | None, p: PlaceParameters, look: Looking
) -> Alignment | None:
    """Return the alignment that most speaks for at places of two components; None without any.

    Parameters
    ----------
    whole
        What came of comparing them as wholes: one place more, if it was found right there.
    look
        Compares what lies about a place.
    """
    found = [] if whole is None else [_as_wholes(first, second, whole, p)]
    found += [_looked_at(first, second, windows, p, look) for windows in _windows(first, second, p)]
    telling = [each for each in found if each.alignment.decision != "refused" and each.metres]
    groups = sorted(_agreeing(telling, p), key=_support, reverse=True)
    proven = [g for g in groups if any(e.alignment.decision == "accepted" for e in g)]
    if not proven:
        return max((e.alignment for e in telling), key=lambda a: a.confidence, default=None)
    rivals = [group for group in groups if group is not proven[0]]
    return _decided(proven[0], max(rivals, key=_support, default=[]), p)


def is_one_place(ours: Window, theirs: Window, p: PlaceParameters) -> bool:
    """Whether what two maps share lies about one place: they were compared there, as wholes."""
    return min(ours.shape.side, theirs.shape.side) <= p.one_place


def located(found: Alignment, ours: Window, theirs: Window, p: PlaceParameters) -> Alignment:
    """Return `found`, of two windows, with the places where it holds, if there is anything."""
    if found.evidence.is_empty:
        return found
    places = shared_places(ours, theirs, found.transform, p.verification, p.shared)
    return replace(found, places=places)


def _windows(
    first: Component, second: Component, p: PlaceParameters
) -> list[tuple[Window, Window]]:
    """Return what lies about the places that shapes propose, the likeliest first, without wholes.

    Two windows are compared once, however many places are in them.
    """
    found: dict[tuple[int, int], tuple[Window, Window]] = {}
    if len(first.submaps) == len(second.submaps) == 1:
        return []
    for here, there in _proposed(first, second, p):
        ours, theirs = first.about(here, p.radius), second.about(there, p.radius)
        if ours is None or theirs is None:
            continue
        if ours is not first.whole or theirs is not second.whole:
            found.setdefault((id(ours), id(theirs)), (ours, theirs))
    return list(found.values())


def _proposed(
    first: Component, second: Component, p: PlaceParameters
) -> list[tuple[FloatArray, FloatArray]]:
    """Return (2,) places [m] in the frames of both, where a submap of one may be in the other."""
    index: PlaceIndex[int] = PlaceIndex(p.index)
    for k, submap in enumerate(first.submaps):
        if len(submap.map.segments):
            index.add(k, index.prepare(submap.map))
    proposals = []
    for j, submap in enumerate(second.submaps):
        shape = index.prepare(submap.map) if len(submap.map.segments) else None
        for place in index.query(shape, p.proposed) if shape else ():
            pose = se2.compose(first.submaps[place.key].pose, place.transform)
            middle = se2.transform_points(se2.inverse(submap.pose), second.middles[j])
            proposals.append((place.score, se2.transform_points(pose, middle), second.middles[j]))
    proposals = [each for each in proposals if each[0] >= p.min_score]
    proposals.sort(key=lambda each: -each[0])
    kept: list[tuple[FloatArray, FloatArray]] = []
    for _, here, there in proposals:
        if not any(_near(here, a, p) and _near(there, b, p) for a, b in kept):
            kept.append((here, there))
    return kept[: p.most]


def _near(one: FloatArray, other: FloatArray, p: PlaceParameters) -> bool:
    return bool(np.hypot(*(one - other)) < p.apart)


def _as_wholes(
    first: Component, second: Component, whole: Alignment, p: PlaceParameters
) -> PlaceAlignment:
    assert first.whole is not None  # they were compared
    assert second.whole is not None
    return _measured(whole, first.whole, second.whole, p)


def _looked_at(
    first: Component,
    second: Component,
    windows: tuple[Window, Window],
    p: PlaceParameters,
    look: Looking,
) -> PlaceAlignment:
    """Compare two windows, and ask what the maps go on to say; refused where that contradicts."""
    found = look(*windows)
    if found.evidence.is_empty or found.decision == "refused":
        return PlaceAlignment(found, np.zeros(2), {})
    assert first.whole is not None  # a window of it is not empty
    assert second.whole is not None
    rasters = first.whole.shape.raster, second.whole.shape.raster
    on, _, _ = shared_samples(*windows, found.transform, p.verification)
    points = windows[1].shape.raster.oriented.points[on]
    against = contradicted_beyond(*rasters, found.transform, points, p.verification, p.bends)
    common = found.evidence.common or 0.0
    if common < p.decision.min_overlap * (common + against):
        numbers = {"common": common, "contradicted": against}
        cause = Reason(ReasonKind.CONTRADICTED, numbers)
        return PlaceAlignment(replace(found, decision="refused", cause=cause), np.zeros(2), {})
    return _measured(found, *windows, p)


def _measured(found: Alignment, ours: Window, theirs: Window, p: PlaceParameters) -> PlaceAlignment:
    """Tell where `found` holds, and how much wall says so, no more than what holds it there."""
    on, _, owner = shared_samples(ours, theirs, found.transform, p.verification)
    raster = theirs.shape.raster
    common, held = found.evidence.common or 0.0, found.evidence.held or 0.0
    telling = min(1.0, p.one_way * held / max(common, 1e-9))
    each = telling * np.bincount(owner, raster.weight[on], len(theirs.submaps))
    metres = {s.id: float(m) for s, m in zip(theirs.submaps, each, strict=True) if m > 0}
    middle = raster.oriented.points[on].mean(axis=0) if len(on) else np.zeros(2)
    return PlaceAlignment(located(found, ours, theirs, p), middle, metres)


def _agreeing(found: Sequence[PlaceAlignment], p: PlaceParameters) -> list[list[PlaceAlignment]]:
    """Return groups, each of what agrees with the one that most speaks for."""
    groups: list[list[PlaceAlignment]] = []
    for each in sorted(found, key=lambda e: -_support([e])):
        fitting = [group for group in groups if _agree(group[0], each, p)]
        if fitting:
            fitting[0].append(each)
        else:
            groups.append([each])
    return groups


def _agree(one: PlaceAlignment, other: PlaceAlignment, p: PlaceParameters) -> bool:
    """Whether two alignments are the same, but for what maps are bent between their places."""
    apart = float(np.hypot(*(one.middle - other.middle)))
    off, turn = _difference(one, other)
    allowed = p.agreement.distance + LIKELY * p.bends.bend * apart
    return off <= allowed and turn <= p.agreement.turn


def _difference(one: PlaceAlignment, other: PlaceAlignment) -> tuple[float, float]:
    """By how much two differ between their places [m], [rad]."""
    middle = (one.middle + other.middle) / 2
    return difference(one.alignment.transform, other.alignment.transform, middle)


def _support(group: Sequence[PlaceAlignment]) -> float:
    """[m] of wall that speaks for a group: what several places say of one submap counts once."""
    names = {name for each in group for name in each.metres}
    return sum(max(each.metres.get(name, 0.0) for each in group) for name in names)


def _decided(
    group: Sequence[PlaceAlignment], rival: Sequence[PlaceAlignment], p: PlaceParameters
) -> Alignment:
    """Return the best alignment of `group`, with all its places; ambiguous beside such a rival."""
    accepted = [e for e in group if e.alignment.decision == "accepted"]
    accepted.sort(key=lambda e: -_support([e]))
    best = accepted[0].alignment
    best = replace(best, places=_apart([e.alignment.places for e in accepted], p.shared))
    if len(accepted) > 1:
        pairs = itertools.combinations(accepted, 2)
        spread = max(_difference(one, other)[0] for one, other in pairs)
        numbers = {"parts": float(len(accepted)), "spread": spread}
        cause = Reason(ReasonKind.PARTS_AGREE, numbers, best.cause)
        best = replace(best, cause=cause, evidence=replace(best.evidence, **numbers))
    if _support(rival) <= p.max_rival * _support(group):
        return best
    return _beside(best, accepted[0], rival[0], p.decision.min_confidence)


def _beside(
    best: Alignment, place: PlaceAlignment, rival: PlaceAlignment, least: float
) -> Alignment:
    """Return `best` as ambiguous: `rival` lays the maps otherwise, and as much speaks for it."""
    distance, turn = _difference(place, rival)
    other = rival.alignment.evidence
    numbers = {
        "common": best.evidence.common or 0.0,
        "contradicted": best.evidence.contradicted or 0.0,
        "distance": distance,
        "turn": turn,
        "rival_common": other.common or 0.0,
        "rival_contradicted": other.contradicted or 0.0,
    }
    sure = min(best.confidence, least / 2)
    cause = Reason(ReasonKind.RIVAL, numbers)
    return replace(best, decision="ambiguous", confidence=sure, cause=cause)


def _apart(
    places: Sequence[Sequence[SharedPlace]], p: SharedPlaceParameters
) -> tuple[SharedPlace, ...]:
    """Return those of several alignments, the first one's first, that are not near each other."""
    kept: list[SharedPlace] = []
    for place in itertools.chain.from_iterable(places):
        if all(np.hypot(*(place.at - other.at)) >= p.apart for other in kept):
            kept.append(place)
    return tuple(kept[: p.count])
