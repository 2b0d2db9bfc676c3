"""Map fusion: the transform between two maps, or a reason why there is none (paper, VIII).

In the order of the paper: hypothesise (H1, H2: by shape, corners and parallel walls, all at once),
align (V1), verify (V2: by all that both maps saw, free space included), decide. The loop as it is
printed is `mapweave.fusion.reference`; docs/paper.md says what was changed and why. Where whole
maps cannot be joined they are compared about places: maps may be bent.
"""

import itertools
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from mapweave.config import Config
from mapweave.fusion.component import Component
from mapweave.fusion.confidence import confidence, may_be
from mapweave.fusion.decision import Hypothesis, decide, evidence, runner_up
from mapweave.fusion.extrapolation import holds, reach
from mapweave.fusion.mirrored import if_mirrored, told_if_mirrored, unless_mirrored
from mapweave.fusion.parameters import FusionParameters, chosen
from mapweave.fusion.places import compare_at_places, is_one_place, located
from mapweave.fusion.ranking import Fields, find_alignments, rated
from mapweave.fusion.rivals import without_its_room
from mapweave.fusion.rooms import outside, rooms_of
from mapweave.fusion.wings import unless_one_kind
from mapweave.geometry import se2
from mapweave.geometry.arguments import check_kind
from mapweave.geometry.arrays import FloatArray
from mapweave.geometry.segments import lengths
from mapweave.maps import Alignment, Decision, LineMap, RobotMap
from mapweave.matching.coarse_places import coarse_places
from mapweave.matching.hypotheses import (
    PreparedMap,
    different,
    propose_all,
    propose_by_walls,
)
from mapweave.matching.verification import verify
from mapweave.reasons import Reason, ReasonKind

__all__ = ["FusionParameters", "align", "align_maps", "compare", "prepare"]


def align(
    reference: RobotMap,
    other: RobotMap,
    parameters: FusionParameters | None = None,
    config: Config | None = None,
) -> list[Alignment]:
    """Compare every component of `reference` with every one of `other` (paper, VIII).

    Parameters
    ----------
    reference, other
        Maps of two robots, which need share nothing.
    parameters
        Of each stage; those that derive from `config` by default.
    config
        What both maps were made with; by default the default one.

    Returns
    -------
    list of Alignment
        One for each pair of components, accepted, ambiguous or refused: each says how sure it is,
        and why.

    Raises
    ------
    ArgumentError
        If one of them is no such thing.

    Examples
    --------
    >>> align(RobotMap("a", "0", 0, ()), RobotMap("b", "0", 0, ()))  # nothing in them
    []
    """
    for name, value in (("reference", reference), ("other", other)):
        check_kind(name, value, RobotMap)
    p = chosen(parameters, config)
    ours, theirs = (
        [Component(m, c, lambda lines: prepare(lines, p)) for c in m.components]
        for m in (reference, other)
    )
    pairs = list(itertools.product(ours, theirs))
    found = [_align(a, b, p) for a, b in pairs]
    sizes = [min(a.size, b.size) for a, b in pairs]
    return told_if_mirrored(found, sizes, p.mirrored_wall, lambda k: _mirrored(*pairs[k], p))


def _align(first: Component, second: Component, p: FusionParameters) -> Alignment:
    """Compare two components; at places, where as wholes they cannot be joined: they may be bent.

    What fits as wholes that may be bent may be a look-alike: then places must agree as well.
    """
    ours, theirs = first.whole, second.whole
    if ours is None or theirs is None:
        return compare(first.name, first.shape, second.name, second.shape, p)
    pair = first.name, ours.shape, second.name, theirs.shape, p
    told = _told_coarsely(*pair)
    if told is not None and told.decision == "refused" and is_one_place(ours, theirs, p.places):
        return told
    whole = told or compare(*pair, closely=True)
    if whole.decision == "accepted" and _is_rigid(whole, ours.shape, theirs.shape, p):
        return _at_place(located(whole, ours, theirs, p.places), ours.shape, theirs.shape, p)
    found = compare_at_places(
        first,
        second,
        None if whole.evidence.is_empty or whole.decision == "refused" else whole,
        p.places,
        lambda a, b: compare(first.name, a.shape, second.name, b.shape, p),
    )
    best = found or whole
    return _at_place(best, ours.shape, theirs.shape, p, whole=best is whole)


def _mirrored(first: Component, second: Component, p: FusionParameters) -> Alignment | None:
    """Compare two components, the second one mirrored, by parallel walls alone."""
    if first.shape is None or second.shape is None:
        return None
    look = partial(_by_shifts, (first.name, first.shape), second.name, p)
    return if_mirrored(first.shape, second.shape, p.mirrored_wall, p, look)


def _by_shifts(
    first: tuple[str, PreparedMap], b: str, p: FusionParameters, second: PreparedMap
) -> Alignment | None:
    """Return what shifts of parallel walls alone tell of two maps, where they do."""
    pair = *first, b, second, p
    return _told_coarsely(*pair) or _by_walls(*pair)[0]


def _is_rigid(whole: Alignment, a: PreparedMap, b: PreparedMap, p: FusionParameters) -> bool:
    """Whether maps are right as wholes where they are right at the place, as far as they reach."""
    far = reach(a.raster, b.raster, whole.transform, p.verification)
    return whole.confidence * holds(far, p.reach) >= p.decision.min_confidence


def _at_place(
    found: Alignment,
    a: PreparedMap | None,
    b: PreparedMap | None,
    p: FusionParameters,
    *,
    whole: bool = True,
) -> Alignment:
    """Return `found` with how far the maps go on from there: what is off beyond is others' matter.

    Where the place was proven, its evidence tells how sure that is. What is refused is asked no
    further. `whole`: it is of the maps as wholes.
    """
    if a is None or b is None or found.decision == "refused" or found.evidence.is_empty:
        return found
    found = unless_one_kind(found, a, b, p.verification, p.wings, rigid=whole)
    look = partial(_by_shifts, (found.reference, a), found.other, p)
    found = unless_mirrored(found, a, b, p, look)
    far = reach(a.raster, b.raster, found.transform, p.verification)
    place = found.confidence if found.decision == "accepted" else None
    return replace(found, evidence=replace(found.evidence, reach=far, place=place))


def align_maps(
    reference: tuple[str, LineMap],
    other: tuple[str, LineMap],
    parameters: FusionParameters | None = None,
) -> Alignment:
    """Find the transform from `other` to `reference`, each a component's name and its lines."""
    p = parameters or FusionParameters()
    (a, first), (b, second) = reference, other
    prepared = prepare(first, p), prepare(second, p)
    return _at_place(compare(a, prepared[0], b, prepared[1], p), *prepared, p)


def prepare(lines: LineMap, p: FusionParameters) -> PreparedMap | None:
    """Return what comparing `lines` takes; None where there is too little wall to compare."""
    wall = lengths(lines.segments).sum()
    if wall < p.min_wall:
        return None
    return PreparedMap(lines, p.hypotheses, p.raster, p.verification)


def compare(
    a: str,
    first: PreparedMap | None,
    b: str,
    second: PreparedMap | None,
    p: FusionParameters,
    possible: FloatArray | None = None,
    *,
    closely: bool = False,
) -> Alignment:
    """Find the transform from `second`, called `b`, to `first`, called `a`, both prepared.

    Decision and confidence are of the place: what maps are bent by elsewhere is not asked.

    Parameters
    ----------
    possible
        (n, 3) transforms of which one is near the right one, if that is known; without it, the
        two maps propose.
    closely
        Whether to look for the best place even where a coarse look tells that none will do.
    """
    if first is None or second is None:
        poor = ReasonKind.SMALL_REFERENCE if first is None else ReasonKind.SMALL_OTHER
        return _no_alignment(a, b, Reason(poor, {"min_wall": p.min_wall}))
    if possible is None:
        told = None if closely else _told_coarsely(a, first, b, second, p)
        if told is not None:
            return told
        found, shifted = _by_walls(a, first, b, second, p)
        if found is not None:
            return found
        possible = propose_all(first, second, shifted, p.hypotheses)
    ranked = find_alignments(first, second, p, possible)
    return _decided(a, first, b, second, ranked, p)


def _told_coarsely(
    a: str, first: PreparedMap, b: str, second: PreparedMap, p: FusionParameters
) -> Alignment | None:
    """Return what a coarse look tells, where it does.

    Refused where no place counts as much, coarsely, as must be in common; accepted where the best
    convinces when it is judged finely, its rivals among the other shifts.
    """
    places = coarse_places(first.coarse, second.coarse, p.hypotheses.coarse, p.verification)
    if len(places.scores) == 0:
        return None
    fields = first.coarse.field, second.coarse.field
    middle = fields[1].middle
    leaders = different(places.aligned, places.scores, middle, p.hypotheses)[:2]
    if places.scores.max() < p.decision.min_common:
        found = _decided(a, first, b, second, _as_hypotheses(places.aligned[leaders], fields, p), p)
        return found if found.decision == "refused" else None
    weight, least = p.verification.contradiction_weight, p.decision.min_confidence
    if may_be(places.scores[leaders].tolist(), weight, p.confidence) < least:
        return None
    ranked = find_alignments(first, second, p, places.shifted)
    found = _decided(a, first, b, second, ranked, p)
    return found if found.decision == "accepted" else None


def _as_hypotheses(places: FloatArray, fields: Fields, p: FusionParameters) -> list[Hypothesis]:
    """Judge (k, 3) `places` by `fields`; how complex what is shared is, is not asked."""
    middle = fields[1].middle
    there = se2.transform_points
    return [Hypothesis(t, there(t, middle), verify(*fields, t, p.verification)) for t in places]


def _by_walls(
    a: str, first: PreparedMap, b: str, second: PreparedMap, p: FusionParameters
) -> tuple[Alignment | None, FloatArray]:
    """Return the alignment that parallel walls alone prove, if any; what they propose (n, 3).

    Its rivals are among what was proposed. Not tried where cells tell that none will convince.
    """
    shifted, scores = propose_by_walls(first, second, p.hypotheses, p.verification)
    middle = second.raster.middle
    leaders = different(shifted, scores, middle, p.hypotheses)
    weight, least = p.verification.contradiction_weight, p.decision.min_confidence
    if may_be(scores[leaders[:2]].tolist(), weight, p.confidence) < least:
        return None, shifted
    ranked = find_alignments(first, second, p, shifted)
    found = _decided(a, first, b, second, ranked, p)
    return found if found.decision == "accepted" else None, shifted


def _decided(
    a: str,
    first: PreparedMap,
    b: str,
    second: PreparedMap,
    ranked: Sequence[Hypothesis],
    p: FusionParameters,
) -> Alignment:
    """Return the alignment that the best of hypotheses is, and what is decided about it."""
    if not ranked:
        return _no_alignment(a, b, Reason(ReasonKind.NO_SHAPE))
    best, rival = ranked[0], ranked[1] if len(ranked) > 1 else None
    sure = confidence(best.verdict, rival.verdict if rival else None, p.confidence)
    decision, cause = decide(best, rival, sure, p.decision)
    if decision != "refused":
        words = first.words.plus(second.words)
        best = rated(best, first, second, words, p)
        rival = rival and rated(rival, first, second, words, p)
        decision, sure, cause = _whichever_room(best, rival, (first.raster, second.raster), p)
    if decision == "refused" or cause.kind is ReasonKind.RIVAL:
        sure = min(sure, p.rooms.unique)
    other = None if rival is None else runner_up(best, rival)
    return Alignment(a, b, best.transform, decision, sure, cause, evidence(best), other)


def _whichever_room(
    best: Hypothesis, rival: Hypothesis | None, fields: Fields, p: FusionParameters
) -> tuple[Decision, float, Reason]:
    """Decide about what is not refused, how sure it is, and why: rooms may exist twice."""
    rooms = rooms_of(fields[0], p.rooms), rooms_of(fields[1], p.rooms)
    beyond = outside(*fields, best.transform, p.verification, p.rooms, rooms)
    one_room = beyond < p.rooms.min_outside
    asked = p.verification, p.rooms, p.wings.crossings
    counted = without_its_room(best, rival, beyond, fields, rooms, *asked)
    against = counted.verdict if counted else None
    sure = confidence(best.verdict, against, p.confidence, best.rarity or 0.0)
    sure *= p.rooms.unique if one_room else 1.0
    decision, cause = decide(best, counted, sure, p.decision, beyond if one_room else None)
    return decision, sure, cause


def _no_alignment(a: str, b: str, cause: Reason) -> Alignment:
    return Alignment(a, b, np.zeros(3), "refused", 0.0, cause)
