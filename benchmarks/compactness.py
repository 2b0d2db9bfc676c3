"""How compact a line map is: doubled walls, slivers, ends that meet."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from mapweave.geometry.arrays import FloatArray
from mapweave.geometry.segments import units
from mapweave.kernels.lines.sampling import sample_parts
from mapweave.lines.sightings import Nearness

DOUBLE = (0.03, 0.3)  # [m] between the two of a doubled wall
PARALLEL = np.deg2rad(15.0)
SLIVER = 0.3  # [m]
STEP = 0.05  # [m] between the points of a segment that are looked at
MEETING = 1e-4  # [m] within which ends meet; maps are kept to a tenth of a millimetre


@dataclass(frozen=True, slots=True)
class Compactness:
    """What is superfluous in a line map.

    Attributes
    ----------
    segments
        How many.
    length
        [m] of all.
    doubled
        Share of the length with a parallel segment, same face, 3 to 30 cm in front or behind. The
        two faces of a thin wall are seen from opposite sides: they are not doubled.
    slivers
        Segments under 0.3 m.
    meeting
        Share of the ends that another segment's end coincides with.
    """

    segments: int
    length: float
    doubled: float
    slivers: int
    meeting: float


def compactness(segments: FloatArray) -> Compactness:
    """Return how compact (n, 4) directed `segments` [m] are."""
    _, lengths = units(segments)
    return Compactness(
        segments=len(segments),
        length=float(lengths.sum()),
        doubled=doubled_share(segments),
        slivers=int((lengths < SLIVER).sum()),
        meeting=_meeting_share(segments),
    )


def doubled_share(segments: FloatArray) -> float:
    """Return the share of the length of (n, 4) `segments` [m] that is drawn twice."""
    points, directions, parts, owner = sample_parts(segments, STEP)
    near = Nearness.of(segments, points, directions, DOUBLE[1])
    _, lengths = units(segments)
    beside = (near.along >= 0) & (near.along <= lengths[near.segment])
    apart = (np.abs(near.across) >= DOUBLE[0]) & (np.abs(near.across) <= DOUBLE[1])
    other = near.segment != owner[near.sample]
    twice = np.zeros(len(points), dtype=np.bool_)
    twice[near.sample[beside & apart & other & (near.cosine >= np.cos(PARALLEL))]] = True
    return float(parts[twice].sum() / max(parts.sum(), 1e-9))


def _meeting_share(segments: FloatArray) -> float:
    """Return the share of ends that coincide with an end of another segment."""
    if len(segments) < 2:
        return 0.0
    ends = segments.reshape(-1, 2)
    distance = np.asarray(KDTree(ends).query(ends, k=2)[0])
    return float((distance[:, 1] <= MEETING).mean())
