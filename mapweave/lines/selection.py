"""The fewest segments that explain what was seen: always the one next that explains the most.

Merging (paper, VI) leaves one segment for each surface, and one for each crumb besides; averaging
also moves a few off what they stand for. So a map is chosen: among the merged segments and those
they were merged from, the one that explains most of the evidence left comes next, until none is
worth its price. This greedy choice is the classic approximation of set cover. A segment that lies
close in front of or behind a chosen one, seen from the same side, is the same wall: it explains
nothing more, which is why no wall is doubled.
"""

import numpy as np
from pydantic import Field

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.kernels.lines.evidence import take_greedily
from mapweave.lines.sightings import Nearness, Sightings
from mapweave.parameters import StageParameters, derived


class SelectionParameters(StageParameters):
    """What a segment explains, and what it must be worth."""

    tolerance: float = derived(
        lambda c: 4.5 * c.sensor.range_sigma,
        gt=0,
        description="[m] within which a segment explains what was seen",
    )
    min_cosine: float = Field(
        -0.5,
        ge=-1,
        le=1,
        description="of directions: a segment explains the steps across it, as a face's roughness,"
        " but never the opposite face",
    )
    shadow: float = Field(
        0.3, ge=0, description="[m] in front of and behind a wall, where the same face is no other"
    )
    parallel: float = Field(
        np.deg2rad(20.0), gt=0, description="[rad] within which faces are the same in its shadow"
    )
    price: float = Field(
        0.11,
        ge=0,
        description="[m] of wall, seen as often as the map's wall is on average, that a segment"
        " must explain beyond what the others do",
    )


def bearing(
    candidates: FloatArray, evidence: Sightings, parameters: SelectionParameters
) -> Nearness:
    """Pair (n, 4) `candidates` [m] with the evidence that each of them explains or denies."""
    reach = max(parameters.tolerance, parameters.shadow)
    return Nearness.of(candidates, evidence.points, evidence.directions, reach)


def select(
    count: int, near: Nearness, evidence: Sightings, price: float, parameters: SelectionParameters
) -> IntArray:
    """Return which of `count` candidates to keep, the one that explains most first.

    Parameters
    ----------
    near
        What bears on each candidate, as of `bearing`.
    evidence
        What was seen.
    price
        The weight of evidence [m] below which none is kept.
    parameters
        What a segment explains.

    Returns
    -------
    IntArray
        (k,) indices of candidates, in the order in which they were chosen.
    """
    explains = explained(near, parameters)
    # What a segment denies, being close in front of or behind it, counts against it.
    settled = explains | shadowed(near, parameters)
    return take_greedily(
        count,
        near.segment[settled],
        near.sample[settled],
        explains[settled],
        evidence.weights,
        price,
    )


def unsettled(known: FloatArray, evidence: Sightings, parameters: SelectionParameters) -> Sightings:
    """Return what of the `evidence` none of the (n, 4) `known` walls [m] explains or denies."""
    if not len(known):
        return evidence
    near = bearing(known, evidence, parameters)
    left = np.ones(len(evidence), dtype=np.bool_)
    left[near.sample[explained(near, parameters) | shadowed(near, parameters)]] = False
    return evidence.those(left)


def explained(near: Nearness, parameters: SelectionParameters) -> BoolArray:
    """Return (k,) which pairs are of a segment and what it explains."""
    return np.asarray(
        (near.distance <= parameters.tolerance) & (near.cosine >= parameters.min_cosine)
    )


def shadowed(near: Nearness, parameters: SelectionParameters) -> BoolArray:
    """Return (k,) which pairs are of a segment and the same face close before or behind it."""
    inside = near.distance <= np.abs(near.across) + 1e-9
    same = near.cosine >= np.cos(parameters.parallel)
    return np.asarray(inside & same & (np.abs(near.across) <= parameters.shadow))
