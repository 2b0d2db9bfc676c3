"""Wings: whether two maps tell one place, or one kind of place.

Floors and wings of a building are built alike, or mirrored. Two maps that are nearly the same,
with nothing beyond in either, were made in one place or in two that are built alike; walls do not
tell. Nor do they where the doors of one are walls of the other, or where much more fits once one
of the maps is mirrored. What people put there does: it stands at odd angles to the walls, and no
two wings have it alike.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import BoolArray, FloatArray
from mapweave.geometry.segments import lengths
from mapweave.lines.directions import main_directions
from mapweave.maps import Alignment, LineMap
from mapweave.matching.crossings import CrossingParameters, crossed
from mapweave.matching.distance_field import DistanceField
from mapweave.matching.hypotheses import PreparedMap
from mapweave.matching.verification import VerificationParameters, coinciding
from mapweave.reasons import Reason, ReasonKind


class WingParameters(BaseModel):
    """When two maps are nearly the same, and what tells that it is one place."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    shared: float = Field(
        0.85,
        gt=0,
        le=1,
        description="of the wall of either map, in common, from which they are nearly the same;"
        " of 367 right joins of stretches of logs one has as much",
    )
    odd: float = Field(
        1.0,
        ge=0,
        description="[m] of wall in common at odd angles, which prove one place: right joins of"
        " stretches that share three quarters and more have 1.5 m at least, equal wings hardly any",
    )
    unique: float = Field(
        0.8, gt=0, le=1, description="probability that a bare wing has no twin within reach"
    )
    crossings: CrossingParameters = CrossingParameters()
    dissimilar: float = Field(
        0.1,
        gt=0,
        description="wall across passages of the other map, as a share of the wall in common, from"
        " which alignments at places of bent maps are dissimilar; of 371 right joins of six logs"
        " none has 0.061, a wrong one across buildings has 0.16",
    )
    mirrored: float = Field(
        1.25,
        gt=1,
        description="score of mirrored maps, as a share of that of the maps as they are, from which"
        " bare ones are of two wings, one the mirror image of the other",
    )
    turn: float = Field(0.14, gt=0, description="[rad] from all main directions, of such wall: 8°")
    across: float = Field(
        0.1, gt=0, description="[m] that its ends are apart across them: noise has less"
    )


def unless_one_kind(
    found: Alignment,
    reference: PreparedMap,
    other: PreparedMap,
    verification: VerificationParameters,
    parameters: WingParameters,
    *,
    rigid: bool,
) -> Alignment:
    """Return `found`, of two maps; ambiguous where they tell a kind of place, not which it is.

    Parameters
    ----------
    rigid
        Whether the transform is right for maps as wholes; else it is of a place of bent ones.
    """
    if found.decision == "refused":
        return found
    asked = reference, other, found.transform, verification, parameters
    return of_one_kind(found, parameters) if told_by_kind(*asked, rigid=rigid) else found


def of_one_kind(found: Alignment, parameters: WingParameters) -> Alignment:
    """Return `found` as that of two places built alike, as it may be."""
    sure = found.confidence * parameters.unique
    if found.decision == "ambiguous":
        return replace(found, confidence=sure)
    e = found.evidence
    match = {"common": e.common or 0.0, "contradicted": e.contradicted or 0.0}
    cause = Reason(ReasonKind.ONE_KIND, {**match, "confidence": sure})
    return replace(found, decision="ambiguous", confidence=sure, cause=cause)


def told_by_kind(
    reference: PreparedMap,
    other: PreparedMap,
    transform: FloatArray,
    verification: VerificationParameters,
    parameters: WingParameters,
    *,
    rigid: bool = True,
) -> bool:
    """Tell whether two maps are so bare, and so alike or unlike, that there may be two places.

    Alike: nearly the same, and nothing beyond. Unlike: what is a door of one is none of the other.

    Parameters
    ----------
    transform
        (3,) from `other` to `reference` [m, m, rad].
    verification, parameters
        When walls coincide, and when maps are nearly the same.
    rigid
        Whether the transform is right for maps as wholes. Of bent ones other doors may be crossed,
        and only much wall across them tells, whatever stands at odd angles.
    """
    a, b, p = reference.raster, other.raster, parameters
    metres = _shared(reference, other, transform, verification)
    if not rigid and _dissimilar(a, b, transform, metres, verification, p):
        return True
    if not _is_bare(metres, p):
        return False
    if all(m.sum() >= p.shared * shape.raster.weight.sum() for shape, m in metres):
        return True
    return rigid and crossed(a, b, transform, verification, p.crossings) >= p.crossings.door


def is_bare(
    reference: PreparedMap,
    other: PreparedMap,
    transform: FloatArray,
    verification: VerificationParameters,
    parameters: WingParameters,
) -> bool:
    """Tell whether hardly any of the wall in common stands at odd angles; as of `told_by_kind`."""
    return _is_bare(_shared(reference, other, transform, verification), parameters)


def _shared(
    reference: PreparedMap,
    other: PreparedMap,
    transform: FloatArray,
    verification: VerificationParameters,
) -> list[tuple[PreparedMap, FloatArray]]:
    """Return both maps, each with the metres of wall in common that its samples stand for."""
    a, b = reference.raster, other.raster
    ways = (
        (other, coinciding(a, b, transform, verification)),
        (reference, coinciding(b, a, se2.inverse(transform), verification)),
    )
    return [(shape, shape.raster.weight * on) for shape, on in ways]


def _is_bare(metres: Sequence[tuple[PreparedMap, FloatArray]], p: WingParameters) -> bool:
    odd = [m[_is_odd(shape.lines, p)[shape.raster.segment]].sum() for shape, m in metres]
    return bool(min(odd) < p.odd)


def _dissimilar(
    a: DistanceField,
    b: DistanceField,
    transform: FloatArray,
    metres: Sequence[tuple[PreparedMap, FloatArray]],
    verification: VerificationParameters,
    p: WingParameters,
) -> bool:
    """Tell whether much of the wall near that in common lies across passages (paper, VIII)."""
    common = float(np.mean([m.sum() for _, m in metres]))
    across = crossed(a, b, transform, verification, p.crossings)
    return across >= max(p.crossings.door, p.dissimilar * common)


def _is_odd(lines: LineMap, p: WingParameters) -> BoolArray:
    """(n,) which segments run in none of the main directions."""
    main = main_directions(lines.segments)
    steps = lines.segments[:, 2:] - lines.segments[:, :2]
    angle = np.arctan2(steps[:, 1], steps[:, 0])
    across = np.abs(np.sin(angle[:, None] - main)).min(axis=1, initial=1.0)
    odd: BoolArray = (across > np.sin(p.turn)) & (across * lengths(lines.segments) > p.across)
    return odd
