"""What moved away: walls that were seen once, and seen through ever since (a person, a door).

A segment loses confidence with every place from which a later scan sees through it, and goes when
those are enough. The paper's world stands still; this goes beyond it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.parameters import StageParameters, derived
from mapweave.scan.scan import Scan
from mapweave.scan.visibility import seen_through


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
    denied = denials(segments, last_seen, witnesses, parameters)
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
    points, owner, along = _samples(segments, parameters.spacing)
    total = np.bincount(owner, minlength=len(segments))
    counts = np.zeros(len(segments), dtype=np.int64)
    for witness in witnesses:
        asked = last_seen[owner] < witness.scan.index
        if not asked.any():
            continue
        through = _sees_through(witness, points[asked], along[asked], parameters)
        seen = np.bincount(owner[asked], weights=through, minlength=len(segments))
        counts += (seen > 0) & (seen >= parameters.share * total)
    return counts


def _samples(segments: FloatArray, spacing: float) -> tuple[FloatArray, IntArray, FloatArray]:
    """(m, 2) points on the segments, (m,) whose each is, and (m, 2) the direction there."""
    run = segments[:, 2:] - segments[:, :2]
    length = np.hypot(*run.T)
    count = np.ceil(length / spacing).astype(np.int64) + 1
    owner = np.repeat(np.arange(len(segments)), count)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    share = (number + 0.5) / count[owner]
    points = segments[owner, :2] + share[:, None] * run[owner]
    return points, owner, (run / np.maximum(length, 1e-12)[:, None])[owner]


def _sees_through(
    witness: Viewpoint, points: FloatArray, along: FloatArray, p: ChangeDetectionParameters
) -> BoolArray:
    """(m,) which points `witness` sees through, its beams not running along the segment there."""
    local = se2.transform_points(se2.inverse(witness.pose), points)
    beam = points - witness.pose[:2]
    across = np.abs(beam[:, 0] * along[:, 1] - beam[:, 1] * along[:, 0])
    steep: BoolArray = across >= np.sin(p.incidence) * np.hypot(*beam.T)
    return steep & seen_through(witness.scan, local, p.clearance, p.sight)
