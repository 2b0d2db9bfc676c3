"""Where two robots met: how far off an alignment is, for scans that were taken near each other."""

import numpy as np

from benchmarks.stretches import Part
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment, RobotMap

NEAR, FARTHER = 6.0, 2.0  # [m] between scans that met; beyond the nearest two, where none did
LOOKED_AT = 300  # scans of a map, evenly spread


def meeting_error(
    first: Part, second: Part, maps: tuple[RobotMap, RobotMap], alignment: Alignment
) -> tuple[float, float]:
    """Return how far off `alignment` is where robots met: [m] and [rad], at the median.

    Of all pairs of scans of the two that were truly taken within 6 m of each other; of each what
    the place of the alignment says that is nearest. NaN where the truth of either is unknown.
    """
    (here, true), (there, other) = (_spread(part) for part in (first, second))
    if len(here) == 0 or len(there) == 0:
        return np.nan, np.nan
    apart = np.hypot(*(true[:, None, :2] - other[None, :, :2]).transpose(2, 0, 1))
    i, j = np.nonzero(apart < max(NEAR, float(apart.min()) + FARTHER))
    at, transforms = _told(maps, alignment)
    nearest = np.hypot(*(here[i, None, :2] - at[None]).transpose(2, 0, 1)).argmin(axis=1)
    found = se2.between(here[i], se2.compose(transforms[nearest], there[j]))
    off = se2.between(se2.between(true[i], other[j]), found)
    return (
        float(np.median(np.hypot(off[:, 0], off[:, 1]))),
        float(np.median(np.abs(se2.wrap(off[:, 2])))),
    )


def _spread(part: Part) -> tuple[FloatArray, FloatArray]:
    """Return (m, 3) poses of scans in the component and in truth, of those of known truth."""
    known = np.flatnonzero(np.isfinite(part.true[:, 0]))
    known = known[:: 1 + len(known) // LOOKED_AT]
    return part.seen[known], part.true[known]


def _told(maps: tuple[RobotMap, RobotMap], alignment: Alignment) -> tuple[FloatArray, FloatArray]:
    """Return (k, 2) where an alignment holds, and (k, 3) what it says of the components there."""
    if not alignment.places:
        return np.zeros((1, 2)), alignment.transform[None]
    ours, theirs = ({s.id: s.pose for s in robot_map.submaps} for robot_map in maps)
    told = [
        se2.compose(se2.compose(ours[p.reference], p.transform), se2.inverse(theirs[p.other]))
        for p in alignment.places
    ]
    return np.array([p.at for p in alignment.places]), np.array(told)
