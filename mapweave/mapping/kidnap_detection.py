"""Where a submap departs from what was mapped before: a jump that tracking did not notice.

Carried off into a look-alike, a robot follows what it sees as if nothing had happened. What it maps
from there on contradicts the older submaps of the place where it believes to be, at every pose
within the drift. Tracking that is right contradicts next to nothing.

In a corridor that is like another one, it takes more than one submap until that is certain; then
those before it are asked as well from where on they are refuted.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.loops.loop_closing import SubmapMatch
from mapweave.maps import Submap
from mapweave.matching.distance_field import DistanceField
from mapweave.matching.verification import Verdict
from mapweave.parameters import StageParameters, derived
from mapweave.scan.points import OrientedPoints


class KidnapDetectionParameters(StageParameters):
    """How much contradiction is a departure."""

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
    closeness: float = derived(
        lambda c: c.mapping.closeness, gt=0, description="[m] from a wall that explains a return"
    )
    clearance: float = derived(
        lambda c: c.mapping.clearance,
        gt=0,
        description="[m] inside seen free space that refutes one",
    )
    sight: float = derived(
        lambda c: 1.2 * c.mapping.free_range, gt=0, description="[m] up to which returns count"
    )
    doubtful: float = Field(
        0.06,
        gt=0,
        lt=1,
        description="share of a scan's returns refuted, from which it departs: of rightly tracked"
        " ones 1 % are, of departed ones 15 to 20 %, and between these a scan is as likely either",
    )
    recent: int = Field(3, ge=1, description="submaps in a row that are asked, the last ones")


@dataclass(frozen=True, slots=True)
class Kidnapping:
    """From which scan on, of which submap, by its id, a robot is not where tracking has it."""

    submap: int
    scan: int


@dataclass(frozen=True, slots=True, eq=False)
class _Asked:
    """The scans of a submap, and the older submaps that looked at what they saw."""

    id: int
    oriented: list[OrientedPoints]
    older: list[tuple[int, DistanceField]]


class KidnapDetector:
    """Remembers the last submaps that were tracked from one another."""

    def __init__(self, parameters: KidnapDetectionParameters) -> None:
        self._p = parameters
        self._recent: deque[_Asked] = deque(maxlen=parameters.recent)

    def find(
        self,
        submaps: Sequence[Submap],
        oriented: Sequence[OrientedPoints],
        compared: Sequence[SubmapMatch],
        follows: bool,
    ) -> Kidnapping | None:
        """Return where the robot departed from what it mapped before, if it did.

        Parameters
        ----------
        submaps
            All; the last one is new.
        surfaces
            Oriented points of its scans, sensor frame.
        compared
            What comparing it with the older ones came to.
        follows
            Whether it was tracked from the one before.
        """
        if not follows:
            self.forget()
        older = [(c.older.id, c.raster) for c in compared]
        self._recent.append(_Asked(submaps[-1].id, list(oriented), older))
        # Those of which it is asked whether they departed do not testify for each other.
        verdicts = [c.verdict for c in compared if c.older.id < self._recent[0].id]
        if not (follows and departs(verdicts, self._p)):
            return None
        return self._first(submaps)

    def forget(self) -> None:
        """Ask none of the submaps so far again, as when others have come to hang on them."""
        self._recent.clear()

    def _first(self, submaps: Sequence[Submap]) -> Kidnapping | None:
        """Return the scan that departs, if any; of an earlier submap than the newest, its first."""
        shares = [self._shares(asked, submaps) for asked in self._recent]
        starts = np.cumsum([0, *map(len, shares[:-1])])
        newest = starts[-1] + np.arange(1, len(shares[-1]) + 1)
        doubt = contradictions(np.concatenate(shares), self._p)
        at = min([*starts.tolist(), *newest.tolist()], key=lambda k: doubt[k])
        if at == len(doubt) - 1:
            return None
        k = int(np.searchsorted(starts, at, side="right")) - 1
        return Kidnapping(self._recent[k].id, at - int(starts[k]))

    def _shares(self, asked: _Asked, submaps: Sequence[Submap]) -> FloatArray:
        """(n,) share of the returns of each scan refuted by submaps older than all asked."""
        submap, first = submaps[asked.id], self._recent[0].id
        older = [
            (raster, se2.between(submaps[k].pose, submap.pose))
            for k, raster in asked.older
            if k < first
        ]
        return refuted(asked.oriented, submap.trajectory.pose, older, self._p)


def departs(verdicts: Sequence[Verdict], parameters: KidnapDetectionParameters) -> bool:
    """Whether what older submaps say of a new one, each at its best, is that it is not there."""
    common = sum(max(v.common, 0.0) for v in verdicts)
    contradicted = sum(v.contradicted for v in verdicts)
    share = contradicted / max(common + contradicted, 1e-9)
    return contradicted > parameters.contradicted and share > parameters.share


def contradictions(shares: FloatArray, parameters: KidnapDetectionParameters) -> FloatArray:
    """(n + 1,) how much speaks against departing at each of n scans, or after them: least is best.

    Parameters
    ----------
    shares
        (n,) of the returns of each scan that are refuted.
    """
    return np.concatenate([[0.0], np.cumsum(shares - parameters.doubtful)])


def refuted(
    oriented: Sequence[OrientedPoints],
    poses: FloatArray,
    older: Sequence[tuple[DistanceField, FloatArray]],
    parameters: KidnapDetectionParameters,
) -> FloatArray:
    """(n,) share of the returns of each scan that lie where older maps saw through.

    Parameters
    ----------
    surfaces
        Oriented points of each scan, sensor frame.
    poses
        (n, 3) where they were tracked to, in any frame.
    older
        What was mapped before, each with the (3,) pose of that frame in its own.
    """
    shares = [
        _refuted_share(s, pose, older, parameters) for s, pose in zip(oriented, poses, strict=True)
    ]
    return np.array(shares)


def _refuted_share(
    oriented: OrientedPoints,
    pose: FloatArray,
    older: Sequence[tuple[DistanceField, FloatArray]],
    p: KidnapDetectionParameters,
) -> float:
    """Return the share of a scan's returns that lie where others saw through, and on no wall."""
    near = oriented.points[np.hypot(*oriented.points.T) < p.sight]
    if len(near) == 0:
        return 0.0
    points = se2.transform_points(pose, near)
    explained, free = np.zeros((2, len(points)), dtype=np.bool_)
    for raster, frame in older:
        _, distance, depth = raster.look_up(se2.transform_points(frame, points))
        explained |= distance < p.closeness
        free |= depth > p.clearance
    return float((free & ~explained).mean())
