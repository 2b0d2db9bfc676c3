"""What a robot saw over the last metres, as a rigid piece of map to be found in another one."""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.submap_builder import SubmapBuilder, SubmapParameters
from mapweave.mapping.tracking.observation import Observation
from mapweave.maps import LineMap
from mapweave.parameters import StageParameters, derived
from mapweave.scan.scan import Scan


class RecentScansParameters(StageParameters):
    """How much of its path a robot looks back on."""

    step: float = derived(
        lambda c: c.mapping.keyframe_step, gt=0, description="[m] between scans that are kept"
    )
    turn: float = derived(
        lambda c: c.mapping.keyframe_turn, gt=0, description="[rad] between those as well"
    )
    kept: int = Field(30, ge=2, description="scans: some 9 m of path, which tracking keeps rigid")
    submap: SubmapParameters = derived(SubmapParameters.of)


class KeptScan(NamedTuple):
    """A scan, its (n, 4) segments [m] in its own frame, and its pose (3,) in the tracker's."""

    scan: Scan
    segments: FloatArray
    pose: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class RecentScans:
    """The scans kept, the oldest first."""

    kept: tuple[KeptScan, ...]

    @property
    def pose(self) -> FloatArray:
        """(3,) of the newest [m, m, rad]."""
        return self.kept[-1].pose

    def lines(self, p: RecentScansParameters) -> LineMap:
        """Return the map that they make, in the frame that their poses are in."""
        builder = SubmapBuilder(p.submap)
        for each in self.kept:
            builder.add(each.scan, each.segments, each.pose)
        return builder.line_map()


class Recollection:
    """Keeps a scan whenever the robot came on, and forgets what is long ago."""

    def __init__(self, parameters: RecentScansParameters) -> None:
        self._p = parameters
        self._kept: deque[KeptScan] = deque(maxlen=parameters.kept)
        self.count = 0  # kept so far, since it was made or cleared

    def add(self, seen: Observation, pose: FloatArray) -> bool:
        """Take a scan at `pose` (3,); return whether it is kept."""
        if self._kept:
            x, y, turn = se2.between(self._kept[-1].pose, pose).tolist()
            if np.hypot(x, y) < self._p.step and abs(turn) < self._p.turn:
                return False
        self._kept.append(KeptScan(seen.scan, seen.segments, pose))
        self.count += 1
        return True

    def clear(self) -> None:
        """Forget all, as where the robot lost track."""
        self._kept.clear()
        self.count = 0

    def last(self, count: int) -> RecentScans:
        """Return the newest `count` scans, or those there are."""
        return RecentScans(tuple(_last(self._kept, count)))


def _last(kept: Iterable[KeptScan], count: int) -> list[KeptScan]:
    return list(kept)[-count:]
