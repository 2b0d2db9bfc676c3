"""Where a submap departs from what was mapped before: a jump that tracking did not notice.

Carried off into a look-alike, a robot follows what it sees as if nothing had happened. What it maps
from there on contradicts the older submaps of the place where it believes to be, at every pose
within the drift. Tracking that is right contradicts next to nothing.
"""

from collections.abc import Sequence

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave import se2
from mapweave.arrays import FloatArray
from mapweave.map_raster import MapRaster
from mapweave.surface import Surface
from mapweave.verification import Verdict


class DepartureParameters(BaseModel):
    """How much contradiction is a departure."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    contradicted: float = Field(
        12.0,
        gt=0,
        description="[m] of wall contradicted, of a submap and the older ones together; rightly"
        " tracked ones of the Intel, CSAIL and Freiburg logs have 5 m at most, after a jump"
        " 26-79 m",
    )
    share: float = Field(
        0.2, gt=0, lt=1, description="of the wall that both looked at, contradicted"
    )
    closeness: float = Field(0.25, gt=0, description="[m] from a wall that explains a return")
    clearance: float = Field(0.3, gt=0, description="[m] inside seen free space that refutes one")
    sight: float = Field(12.0, gt=0, description="[m] up to which returns count")
    doubtful: float = Field(
        0.08, gt=0, lt=1, description="share of a scan's returns refuted, from which it departs"
    )


def departs(verdicts: Sequence[Verdict], parameters: DepartureParameters) -> bool:
    """Whether what older submaps say of a new one, each at its best, is that it is not there."""
    common = sum(max(v.common, 0.0) for v in verdicts)
    contradicted = sum(v.contradicted for v in verdicts)
    share = contradicted / max(common + contradicted, 1e-9)
    return contradicted > parameters.contradicted and share > parameters.share


def departure(
    surfaces: Sequence[Surface],
    poses: FloatArray,
    older: Sequence[tuple[MapRaster, FloatArray]],
    parameters: DepartureParameters,
) -> int:
    """Return the first of n scans that departs, so that those before are refuted least; n if none.

    Parameters
    ----------
    surfaces
        Oriented points of each scan, sensor frame.
    poses
        (n, 3) where they were tracked to, in any frame.
    older
        What was mapped before, each with the (3,) pose of that frame in its own.
    """
    p = parameters
    refuted = [_refuted(s, pose, older, p) for s, pose in zip(surfaces, poses, strict=True)]
    doubt = np.concatenate([[0.0], np.cumsum(np.array(refuted) - p.doubtful)])
    return int(np.argmin(doubt))


def _refuted(
    surface: Surface,
    pose: FloatArray,
    older: Sequence[tuple[MapRaster, FloatArray]],
    p: DepartureParameters,
) -> float:
    """Return the share of a scan's returns that lie where others saw through, and on no wall."""
    near = surface.points[np.hypot(*surface.points.T) < p.sight]
    if len(near) == 0:
        return 0.0
    points = se2.transform_points(pose, near)
    explained, free = np.zeros((2, len(points)), dtype=np.bool_)
    for raster, frame in older:
        _, distance, depth = raster.look_up(se2.transform_points(frame, points))
        explained |= distance < p.closeness
        free |= depth > p.clearance
    return float((free & ~explained).mean())
