"""What a part of fusion is good for: the same without it."""

from collections.abc import Callable
from itertools import product

import numpy as np

from mapweave.fusion.align import FusionParameters, align, compare, prepare
from mapweave.fusion.confidence import ConfidenceParameters
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment, RobotMap, component_name
from mapweave.matching.place_index import PlaceIndex

NEVER = 1e9  # [m] that no place scores, no wall has; [bits] that nothing is worth
WITHOUT = ("words", "correlation", "similarity")
PLACES = 5  # of each submap
# Fitted to the same pairs before rarity was known: rarity left out of what was fitted with it
# would make all of it look worse than it is.
WITHOUT_RARITY = ConfidenceParameters(
    intercept=-19.9, score=2.83, held=2.02, overlap=8.58, lead=1.98, rarity=0.0
)
Aligning = Callable[[RobotMap, RobotMap, FusionParameters], list[Alignment]]


def parameters_without(what: str | None) -> FusionParameters:
    """Return the default parameters, or those with a part of `WITHOUT` left out."""
    p = FusionParameters()
    if what == "words":
        places = p.places.model_copy(update={"min_score": NEVER})
        decision = p.decision.model_copy(update={"min_rarity": NEVER})
        left = {"places": places, "decision": decision, "confidence": WITHOUT_RARITY}
        return p.model_copy(update=left)
    if what == "similarity":
        crossings = p.wings.crossings.model_copy(update={"door": NEVER})
        return p.model_copy(update={"wings": p.wings.model_copy(update={"crossings": crossings})})
    return p


def aligning_without(what: str | None) -> Aligning:
    """Return what compares two robots' maps, as the program does or by shapes alone."""
    return align_by_shapes if what == "correlation" else align


def align_by_shapes(
    reference: RobotMap, other: RobotMap, parameters: FusionParameters
) -> list[Alignment]:
    """Compare every pair of components by what words of their submaps propose, and nothing else.

    No shift of parallel walls is tried, and no place of bent maps is asked about apart.
    """
    return [
        _aligned(reference, a, other, b, parameters)
        for a, b in product(reference.components, other.components)
    ]


def _aligned(
    reference: RobotMap, a: int, other: RobotMap, b: int, p: FusionParameters
) -> Alignment:
    names = component_name(reference.robot, a), component_name(other.robot, b)
    possible = _proposed(reference, a, other, b)
    shapes = [
        prepare(m.lines(c), p) if len(possible) else None for m, c in ((reference, a), (other, b))
    ]
    return compare(names[0], shapes[0], names[1], shapes[1], p, possible)


def _proposed(reference: RobotMap, a: int, other: RobotMap, b: int) -> FloatArray:
    """(n, 3) transforms from a component to another where a submap of it may be in one of that."""
    index: PlaceIndex[int] = PlaceIndex()
    known = [s for s in reference.submaps if s.component == a and len(s.map.segments)]
    for k, submap in enumerate(known):
        index.add(k, index.prepare(submap.map))
    found = [
        se2.compose(se2.compose(known[place.key].pose, place.transform), se2.inverse(submap.pose))
        for submap in other.submaps
        if submap.component == b and len(submap.map.segments)
        for place in index.query(index.prepare(submap.map), PLACES)
    ]
    return np.array(found).reshape(-1, 3)
