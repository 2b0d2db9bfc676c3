"""Maps that fit only mirrored: a sensor hangs upside down, or turns the other way round, unsaid.

No log betrays it, and no rigid motion mends it; the maps of others do. It is told, and never
joins. And wings of a building that are mirror images of each other, of which some rooms fit.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from mapweave.fusion.parameters import FusionParameters
from mapweave.fusion.wings import is_bare, of_one_kind
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment, LineMap
from mapweave.matching.coarse_places import most_if_mirrored
from mapweave.matching.hypotheses import PreparedMap
from mapweave.reasons import Reason, ReasonKind

MIRROR: FloatArray = np.array([1.0, -1.0])  # what x and y become

Looking = Callable[[PreparedMap], Alignment | None]
"""Compares the reference with a map that is a mirror image; None where nothing convinces."""
Joined = Callable[[int], Alignment | None]
"""Compares a pair of components again, the second mirrored; None where nothing convinces."""


def mirrored(lines: LineMap) -> LineMap:
    """Return `lines` as a sensor would have seen them that hangs upside down.

    What was on the left of a wall is on its right: walls run the other way, and so do polylines.
    """
    turned = (lines.segments.reshape(-1, 2, 2) * MIRROR)[::-1, ::-1].reshape(-1, 4)
    return LineMap(
        np.ascontiguousarray(turned),
        np.ascontiguousarray(lines.polyline.max(initial=0) - lines.polyline[::-1]),
        np.ascontiguousarray(lines.support[::-1]),
        tuple(ring[::-1] * MIRROR for ring in lines.free_space),
    )


def if_mirrored(
    ours: PreparedMap, theirs: PreparedMap, wall: float, p: FusionParameters, look: Looking
) -> Alignment | None:
    """Return what `look` tells of `theirs` mirrored; None where `wall` [m] cannot be in common."""
    maps = ours.coarse, theirs.coarse
    most = most_if_mirrored(*maps, p.hypotheses.coarse, p.verification)
    if most < p.mirrored_part * wall:
        return None
    return look(replace(theirs, lines=mirrored(theirs.lines)))


def unless_mirrored(
    found: Alignment, ours: PreparedMap, theirs: PreparedMap, p: FusionParameters, look: Looking
) -> Alignment:
    """Return `found`; ambiguous where maps are bare and fit much better if one is mirrored.

    Wings of a building are often mirror images of each other, of which some rooms fit as they are.
    """
    asked = ours, theirs, found.transform, p.verification, p.wings
    if found.decision != "accepted" or not is_bare(*asked):
        return found
    least = p.wings.mirrored * (found.evidence.score or 0.0)
    other = if_mirrored(ours, theirs, least, p, look)
    if other is None or other.decision != "accepted" or (other.evidence.score or 0.0) < least:
        return found
    return of_one_kind(found, p.wings)


def told_if_mirrored(
    found: Sequence[Alignment], sizes: Sequence[float], wall: float, joined: Joined
) -> list[Alignment]:
    """Return `found`, one of them with what it would be if one map were mirrored.

    Asked once for two robots, and only where nothing speaks for any pair of their components: of
    that with the most wall.

    Parameters
    ----------
    found
        Of the pairs of two robots' components.
    sizes
        [m] of wall of the smaller one of each pair.
    wall
        [m] in common that two mirrored maps have at least, to be told of: parts of a building
        are often mirror images of each other.
    joined
        Compares one of the pairs again, the second one mirrored.
    """
    alignments = list(found)
    if any(each.decision != "refused" for each in alignments) or max(sizes, default=0.0) < wall:
        return alignments
    place = int(np.argmax(sizes))
    asked, other = alignments[place], joined(place)
    common = 0.0 if other is None else other.evidence.common or 0.0
    if other is None or other.decision != "accepted" or common < wall:
        return alignments
    numbers = {"common": common, "contradicted": other.evidence.contradicted or 0.0}
    alignments[place] = replace(asked, cause=Reason(ReasonKind.MIRRORED, numbers, asked.cause))
    return alignments
