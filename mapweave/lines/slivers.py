"""Slivers: short segments that lie along or across a longer one, within the noise of its line.

Merging compares pairs by how well they agree, and a short step across a rough wall agrees with
nothing. It tells no more about the wall than that it is rough, so the wall takes it over. This
goes beyond the paper, for its own aim: the fewest segments that represent what was seen.
"""

import numpy as np
from pydantic import Field

from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.kernels.lines.slivers import sliver_owners
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


def owners(segments: FloatArray, parameters: SliverParameters | None = None) -> IntArray:
    """Return (n,) which of the (n, 4) `segments` [m] takes each over: itself if it is no sliver."""
    chosen = parameters or SliverParameters()
    return sliver_owners(
        np.ascontiguousarray(segments, dtype=np.float64),
        chosen.max_length,
        chosen.max_distance,
        chosen.max_angle,
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
    owner = owners(segments, parameters)
    left, labels = np.unique(owner, return_inverse=True)
    total = np.bincount(labels, weights, minlength=len(left)).astype(np.float64)
    return Evolution(segments[left], total, labels.astype(np.int64))
