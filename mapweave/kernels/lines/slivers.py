"""Which longer segment each sliver lies along."""

from typing import TYPE_CHECKING

import numpy as np

from mapweave.kernels.arrays import FloatArray, IntArray
from mapweave.kernels.loading import COMPILED


def numpy_sliver_owners(
    segments: FloatArray, max_length: float, max_distance: float, max_angle: float
) -> IntArray:
    """Return (n,) which of the (n, 4) `segments` [m] takes each over: itself if it is no sliver.

    Parameters
    ----------
    segments
        x1 y1 x2 y2 [m].
    max_length
        [m] of a sliver.
    max_distance
        [m] that it reaches away from its owner at most.
    max_angle
        [rad] between both, directed.
    """
    lengths = np.hypot(*(segments[:, 2:] - segments[:, :2]).T)
    owner = np.arange(len(segments))
    for number in np.flatnonzero(lengths <= max_length):
        longer = np.flatnonzero(lengths > lengths[number])  # so no two own each other
        distance = _distance(segments[number], segments[longer], max_angle)
        if len(longer) and distance.min() <= max_distance:
            owner[number] = longer[np.argmin(distance)]
    while (owner != owner[owner]).any():  # a sliver of a sliver
        owner = owner[owner]
    return owner.astype(np.int64)


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


if TYPE_CHECKING or COMPILED is None:  # noqa: SIM108 (an alias for types, too)
    sliver_owners = numpy_sliver_owners
else:
    sliver_owners = COMPILED.sliver_owners
