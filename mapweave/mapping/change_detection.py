"""What moved away: walls that were seen once, and seen through ever since (a person, a door).

A segment loses confidence with every place from which a later scan sees through it, and goes when
those are enough. The paper's world stands still; this goes beyond it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydantic import Field

from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.kernels.denials import Witnesses
from mapweave.parameters import StageParameters, derived
from mapweave.scan.scan import Scan
from mapweave.scan.visibility import clear_ranges


class ChangeDetectionParameters(StageParameters):
    """When a segment counts as seen through, and how often it must be."""

    spacing: float = derived(
        lambda c: c.mapping.resolution, gt=0, description="[m] between the points asked"
    )
    clearance: float = derived(
        lambda c: c.mapping.clearance,
        gt=0,
        description="[m] by which seeing through must be certain, as in tracking",
    )
    sight: float = derived(
        lambda c: c.mapping.free_range,
        gt=0,
        description="[m] up to which it counts, as for free space",
    )
    incidence: float = Field(
        0.26,
        ge=0,
        description="[rad] at which a beam must meet the segment at least: 15°; along a wall, an"
        " error of centimetres across it lets beams through",
    )
    share: float = Field(
        0.8, gt=0, le=1, description="of its points that must be seen through: all but its ends"
    )
    places: int = Field(
        3, ge=1, description="seen through from so many after the last sighting, it has vanished"
    )


@dataclass(frozen=True, slots=True, eq=False)
class Viewpoint:
    """A scan and where it was taken: (3,) `pose`, in the frame of the segments asked about."""

    scan: Scan
    pose: FloatArray


def still_there(
    segments: FloatArray,
    support: IntArray,
    last_seen: IntArray,
    witnesses: Sequence[Viewpoint],
    parameters: ChangeDetectionParameters,
) -> tuple[IntArray, IntArray]:
    """Tell which segments have not vanished, and what is left of their support.

    Parameters
    ----------
    segments
        (n, 4) x1 y1 x2 y2 [m].
    support
        (n,) how many scans saw each.
    last_seen
        (n,) index of the last scan that did.
    witnesses
        Scans from different places, or they say the same.

    Returns
    -------
    left
        (k,) which segments, ascending.
    support
        (k,) of theirs: less one for each place from which it was seen through since, but not 0.
    """
    return not_vanished(support, denials(segments, last_seen, witnesses, parameters), parameters)


def not_vanished(
    support: IntArray, denied: IntArray, parameters: ChangeDetectionParameters
) -> tuple[IntArray, IntArray]:
    """Return the same as `still_there`, given (n,) from how many places each was seen through."""
    left = np.flatnonzero(denied < parameters.places)
    return left, np.maximum(support - denied, 1)[left]


def last_sightings(labels: IntArray, scans: IntArray) -> IntArray:
    """Return (n,) the last of the scans that saw each segment.

    Parameters
    ----------
    labels
        (m,) the segment that each sighting belongs to: 0 to n - 1.
    scans
        (m,) index of the scan that each sighting is from.
    """
    last = np.full(int(labels.max(initial=-1)) + 1, -1, dtype=np.int64)
    np.maximum.at(last, labels, scans)
    return last


def denials(
    segments: FloatArray,
    last_seen: IntArray,
    witnesses: Sequence[Viewpoint],
    parameters: ChangeDetectionParameters,
) -> IntArray:
    """Return (n,) how many `witnesses` saw through each segment after it was seen last."""
    kernel = no_witnesses(parameters)
    for witness in witnesses:
        add_witness(kernel, witness, parameters)
    return kernel.count(
        np.ascontiguousarray(segments, dtype=np.float64),
        np.ascontiguousarray(last_seen, dtype=np.int64),
    )


def no_witnesses(parameters: ChangeDetectionParameters) -> Witnesses:
    """Return where witnesses can be added."""
    p = parameters
    return Witnesses(p.spacing, p.clearance, p.incidence, p.share)


def add_witness(
    witnesses: Witnesses, viewpoint: Viewpoint, parameters: ChangeDetectionParameters
) -> None:
    """Add what the scan at `viewpoint` saw through."""
    angles = viewpoint.scan.angles
    step = float(angles[-1] - angles[0]) / max(len(angles) - 1, 1)
    clear = clear_ranges(viewpoint.scan, parameters.sight)
    pose = np.ascontiguousarray(viewpoint.pose, dtype=np.float64)
    witnesses.add(viewpoint.scan.index, clear, float(angles[0]), step, pose)
