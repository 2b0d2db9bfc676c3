"""Which submaps of two components saw the same walls: where an alignment between them holds."""

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave.fusion.component import Window
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.maps import SharedPlace
from mapweave.matching.verification import VerificationParameters, coinciding


class SharedPlaceParameters(BaseModel):
    """What is named of what two components share."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    min_common: float = Field(2.0, gt=0, description="[m] of wall that two submaps have in common")
    apart: float = Field(8.0, gt=0, description="[m] between places: a submap is as long")
    count: int = Field(8, ge=1, description="places named, those with the most wall in common")


def shared_places(
    ours: Window,
    theirs: Window,
    transform: FloatArray,
    verification: VerificationParameters,
    parameters: SharedPlaceParameters,
) -> tuple[SharedPlace, ...]:
    """Return where `transform` (3,), from `theirs` to `ours`, lays submaps on each other.

    That with the most wall in common first; of several near each other only that.
    """
    p = parameters
    on, i, j = shared_samples(ours, theirs, transform, verification)
    weight = theirs.shape.raster.weight[on]
    points = se2.transform_points(transform, theirs.shape.raster.oriented.points[on])
    metres = np.zeros((len(ours.submaps), len(theirs.submaps)))
    np.add.at(metres, (i, j), weight)
    found: list[SharedPlace] = []
    for pair in np.argsort(-metres, axis=None, kind="stable").tolist():
        first, second = divmod(pair, len(theirs.submaps))
        least = p.min_common if found else 0.0
        if metres[first, second] <= least or len(found) == p.count:
            break
        here = (i == first) & (j == second)
        at = np.average(points[here], axis=0, weights=weight[here])
        if all(np.hypot(*(at - other.at)) >= p.apart for other in found):
            found.append(_tie(ours, theirs, transform, (first, second), at))
    return tuple(found)


def shared_samples(
    ours: Window, theirs: Window, transform: FloatArray, verification: VerificationParameters
) -> tuple[IntArray, IntArray, IntArray]:
    """Return (n,) the samples of `theirs` on walls of `ours`, and of which submaps both are."""
    first, second = ours.shape.raster, theirs.shape.raster
    on: IntArray = np.flatnonzero(coinciding(first, second, transform, verification))
    nearest, _, _ = first.look_up(se2.transform_points(transform, second.oriented.points[on]))
    return on, ours.owner[nearest], theirs.owner[on]


def _tie(
    ours: Window, theirs: Window, transform: FloatArray, pair: tuple[int, int], at: FloatArray
) -> SharedPlace:
    one, other = ours.submaps[pair[0]], theirs.submaps[pair[1]]
    between = se2.between(one.pose, se2.compose(transform, other.pose))
    return SharedPlace(one.id, other.id, between, at)
