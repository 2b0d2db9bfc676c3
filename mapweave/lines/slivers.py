"""Slivers: short segments that lie along or across a longer one, within the noise of its line.

Merging compares pairs by how well they agree, and a short step across a rough wall agrees with
nothing. It tells no more about the wall than that it is rough, so the wall takes it over. This
goes beyond the paper, for its own aim: the fewest segments that represent what was seen.
"""

import numpy as np
from pydantic import Field

from mapweave.geometry.arrays import FloatArray
from mapweave.geometry.segments import lengths
from mapweave.lines.merging import Evolution
from mapweave.parameters import StageParameters, derived


class SliverParameters(StageParameters):
    """What a sliver is."""

    max_length: float = Field(
        default=0.4, gt=0, description="longer segments are no slivers [m]; half a door"
    )
    max_distance: float = derived(
        lambda c: 7.5 * c.sensor.range_sigma,
        gt=0,
        description="how far a sliver reaches away from the longer segment at most [m]; laser"
        " noise and the tolerance of segments, on both sides of a rough wall",
    )
    max_angle: float = Field(
        default=np.deg2rad(120.0),
        gt=0,
        description="between both, directed [rad]: the face across a step is a right angle away,"
        " the opposite face of a thin wall 180°",
    )


def absorb_slivers(
    segments: FloatArray, weights: FloatArray, parameters: SliverParameters | None = None
) -> Evolution:
    """Give each sliver to the nearest longer segment that it lies along.

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], the visible side on the left.
    weights
        (n,) total length observed of each [m].
    parameters
        What a sliver is.

    Returns
    -------
    Evolution
        The segments that are no slivers, unmoved, in their order; with the weights of the slivers
        that each took over, and where every input went.
    """
    chosen = parameters or SliverParameters()
    length = lengths(segments)
    owner = np.arange(len(segments))
    for number in np.flatnonzero(length <= chosen.max_length):
        longer = np.flatnonzero(length > length[number])  # so no two own each other
        distance = _distance(segments[number], segments[longer], chosen.max_angle)
        if len(longer) and distance.min() <= chosen.max_distance:
            owner[number] = longer[np.argmin(distance)]
    while (owner != owner[owner]).any():  # a sliver of a sliver
        owner = owner[owner]
    left, labels = np.unique(owner, return_inverse=True)
    total = np.bincount(labels, weights, minlength=len(left)).astype(np.float64)
    return Evolution(segments[left], total, labels.astype(np.int64))


def _distance(sliver: FloatArray, segments: FloatArray, max_angle: float) -> FloatArray:
    """Return how far `sliver` (4,) reaches away from each (k, 4) segment [m], as (k,).

    Infinite where their directions differ by more than `max_angle` [rad].
    """
    start = segments[:, :2]
    along = segments[:, 2:] - start
    squared = (along**2).sum(axis=1)
    reach = np.zeros(len(segments))
    for end in (sliver[:2], sliver[2:]):
        share = np.clip(((end - start) * along).sum(axis=1) / squared, 0.0, 1.0)
        reach = np.maximum(reach, np.hypot(*(end - start - share[:, None] * along).T))
    own = sliver[2:] - sliver[:2]
    cosine = along @ own / (np.sqrt(squared) * max(float(np.hypot(*own)), 1e-12))
    return np.where(cosine >= np.cos(max_angle), reach, np.inf)
