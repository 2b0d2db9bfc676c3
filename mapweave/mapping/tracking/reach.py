"""How far from the last scan the next one is looked for: as time allows, and as the robot's pace.

What a robot can do bounds where it is believed to be; what it usually does, how far is searched.
"""

import math
from typing import NamedTuple

from mapweave.mapping.tracking.drift import Pace
from mapweave.mapping.tracking.motion_model import MotionModel
from mapweave.mapping.tracking.reachability import Reachability
from mapweave.scan.scan import Scan

LEAST = 1e-3  # [m], [rad] that no step is known better than


class Reach(NamedTuple):
    """Distances from the last scan that was placed [m].

    Attributes
    ----------
    far
        No robot can have come farther.
    paced
        Nor has this one, if it went on as ever; infinite as long as its pace is not known.
    """

    far: float
    paced: float

    def window(self, least: float, widest: float) -> float:
        """Return how far [m] to search, each way: half of its way, which is predicted.

        All of it as long as nothing is; never less than `least`, nor more than `widest` [m].
        """
        wide = self.far if math.isinf(self.paced) else min(self.far, self.paced) / 2
        return max(min(wide, widest), least)


def reach(
    scan: Scan, missed: int, max_step: float, motion: MotionModel, reachability: Reachability
) -> Reach:
    """Return how far the robot can have come by `scan`, with so many `missed` before it.

    Where stamps tell time, it bounds the way, and the pace does so once scans were missed; where
    they do not, the pace is all there is. Up to `max_step` [m] a scan need no time be told.
    """
    steps, since, usual = 1.0 + missed, reachability.since_placed(scan), reachability.interval
    untold, paced = max_step * (1 + steps) / 2, math.inf
    timed = usual is not None and math.isfinite(since)
    if motion.is_paced or missed:
        paced = motion.reach(max(steps, since / usual) if usual is not None and timed else steps)
    if not timed:
        return Reach(min(untold, paced), paced)
    return Reach(min(reachability.way(since), paced if missed else max(untold, paced)), paced)


def pace(scan: Scan, turn: float, motion: MotionModel, reachability: Reachability) -> Pace:
    """Return what is not known of a step with a `turn` [rad] where nothing seen holds it."""
    since = reachability.since_placed(scan)
    far, turned = reachability.most(since)
    way, turning = motion.unknown(turn)
    return Pace(max(min(way, far), LEAST), max(min(turning, turned), LEAST))
