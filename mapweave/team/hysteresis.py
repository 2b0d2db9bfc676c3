"""Joins that are kept: robots that met do not come apart because their maps have grown.

They go on exploring, and the farther their maps reach from what they share, the less sure an
alignment is right for the maps as wholes. That the places are one is as sure as it was. So once
robots have met, the place is proof enough, and the join has the confidence that is left.
"""

from collections.abc import Sequence
from dataclasses import replace

from mapweave.maps import Alignment
from mapweave.reasons import Reason, ReasonKind


def keep_joined(found: Sequence[Alignment]) -> tuple[Alignment, ...]:
    """Return what was `found` of two robots that met, each join accepted whose place is proven."""
    return tuple(
        _keep(a) if a.decision == "ambiguous" and a.evidence.place is not None else a for a in found
    )


def joins(found: Sequence[Alignment]) -> bool:
    """Tell whether any of these joins two robots."""
    return any(alignment.decision == "accepted" for alignment in found)


def _keep(alignment: Alignment) -> Alignment:
    cause = Reason(ReasonKind.MET_BEFORE, found=alignment.cause)
    return replace(alignment, decision="accepted", cause=cause)
