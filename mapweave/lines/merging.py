"""Discrete Segment Evolution: many sightings of a surface become one segment (paper, VI).

Always the cheapest pair is merged next, until none is cheap enough;
`mapweave.lines.merging_rules` has the rules, `mapweave.kernels.lines.merging` the steps. Each
segment weighs the total length observed, not its own length as in the paper, so that a well-known
wall stays where it is.

Neither step sees polylines. The paper hands corresponding polylines to both; here any two segments
are a pair that are near, show the same face and are cheap, and polylines are made of the result.
"""

from dataclasses import dataclass

import numpy as np

from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.geometry.segments import lengths
from mapweave.kernels.lines.merging import EvolvingMap
from mapweave.lines.merging_rules import MergingParameters

__all__ = [
    "Evolution",
    "EvolvingMap",
    "MergingParameters",
    "count_support",
    "evolve",
    "evolving_map",
    "merge_scan",
]


@dataclass(frozen=True, slots=True, eq=False)
class Evolution:
    """What n segments evolved into.

    Attributes
    ----------
    segments
        (m, 4) x1 y1 x2 y2 [m], directed as their parents.
    weights
        (m,) total length observed [m].
    labels
        (n,) which of `segments` each input went into.
    """

    segments: FloatArray
    weights: FloatArray
    labels: IntArray


def evolve(
    segments: FloatArray,
    weights: FloatArray | None = None,
    parameters: MergingParameters | None = None,
    settled: int = 0,
) -> Evolution:
    """Merge the cheapest pair again and again until none is cheap enough (simplification, VI).

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m], the visible side on the left.
    weights
        (n,) total length observed of each [m]; by default its length: seen once.
    parameters
        Which pairs are merged.
    settled
        How many of them, the first, are merged among themselves: only pairs with others are
        looked at, and with what comes of these.

    Returns
    -------
    Evolution
        The segments that remain, in the order of their making.
    """
    mass = lengths(segments) if weights is None else weights
    evolving = evolving_map(segments, mass, parameters)
    evolving.simplify(settled)
    return _evolution(evolving)


def merge_scan(
    segments: FloatArray,
    weights: FloatArray,
    scan_segments: FloatArray,
    parameters: MergingParameters | None = None,
) -> Evolution:
    """Return G_t from G_(t-1) and the aligned S_t: pair creation, then simplification (VI).

    Parameters
    ----------
    segments, weights
        (n, 4) [m] and (n,) total length observed [m]: the map G_(t-1), itself simplified; only
        pairs with something new are looked at.
    scan_segments
        (k, 4) [m], map frame: the scan S_t.
    parameters
        Which pairs are merged.

    Returns
    -------
    Evolution
        Its labels are those of the n map segments, then those of the k scan segments.
    """
    evolving = evolving_map(segments, weights, parameters)
    evolving.merge_scan(np.ascontiguousarray(scan_segments, dtype=np.float64), 0)
    return _evolution(evolving)


def evolving_map(
    segments: FloatArray, weights: FloatArray, parameters: MergingParameters | None = None
) -> EvolvingMap:
    """Return a map that scans are merged into, one after the other.

    Parameters
    ----------
    segments, weights
        (n, 4) [m] and (n,) total length observed [m]: what it begins with.
    parameters
        Which pairs are merged.
    """
    return EvolvingMap(
        (parameters or MergingParameters()).rules,
        np.ascontiguousarray(segments, dtype=np.float64),
        np.ascontiguousarray(weights, dtype=np.float64),
    )


def count_support(labels: IntArray, scans: IntArray) -> IntArray:
    """Count the distinct scans that saw each merged segment.

    Parameters
    ----------
    labels
        (n,) which merged segment each sighting went into; all of 0…m-1 occur.
    scans
        (n,) the scan of each sighting.

    Returns
    -------
    IntArray
        (m,)
    """
    sightings = np.unique(np.column_stack([labels, scans]), axis=0)
    return np.bincount(sightings[:, 0]).astype(np.int64)


def _evolution(evolving: EvolvingMap) -> Evolution:
    return Evolution(evolving.segments(), evolving.weights(), evolving.labels())
