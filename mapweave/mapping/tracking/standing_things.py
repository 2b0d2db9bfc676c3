"""Whether things that may move do, and which of them are known to stand.

People who walk along with a robot keep their place beside it: taken for landmarks they hold it
back, the more so the fewer walls it sees. So what is seen of things is looked for again a while
later, where the robot's pose is held in every direction. Only where most were found standing are
things landmarks at once, as furniture is; elsewhere those that stood for a while.
"""

import math
from collections import deque
from itertools import islice
from typing import NamedTuple, Self

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.kernels.matching.nearness import nearest_distances
from mapweave.parameters import StageParameters, derived
from mapweave.scan.points import OrientedPoints
from mapweave.scan.scan import Scan
from mapweave.scan.visibility import seen_through


class StandingThingsParameters(StageParameters):
    """When a thing stands, and when things are trusted."""

    settled: float = Field(
        2.0, ge=0, description="[s] after which things are looked for again; who walks is gone then"
    )
    near: float = derived(
        lambda c: 0.6 * c.mapping.closeness, gt=0, description="[m] from where it was: the same"
    )
    clearance: float = derived(
        lambda c: c.mapping.clearance, gt=0, description="[m] by which seeing through is certain"
    )
    sight: float = derived(
        lambda c: 1.2 * c.mapping.free_range, gt=0, description="[m] up to which it counts"
    )
    judged: int = Field(100, ge=1, description="points of things, the least to judge things by")
    lately: int = Field(300, ge=1, description="the last points, by which trust is lost")
    remembered: int = Field(3000, ge=1, description="the last points, by which it is won")
    moving: float = Field(0.25, gt=0, le=1, description="share of them gone, to lose trust")
    standing: float = Field(0.05, ge=0, le=1, description="share of them gone, to win it: no more")
    waiting: int = Field(60, ge=1, description="sightings that are still to be looked for")


class _Sighting(NamedTuple):
    """What was seen of things, tracking frame."""

    stamp: float
    things: OrientedPoints


class StandingThings:
    """Looks for things again, and trusts them by how many were there.

    Attributes
    ----------
    are_distrusted
        Whether too few were found standing so far, or too many of late were gone.
    """

    def __init__(self, parameters: StandingThingsParameters) -> None:
        self.are_distrusted = True
        self._p = parameters
        self._waiting: deque[_Sighting] = deque(maxlen=parameters.waiting)
        self._gone: deque[bool] = deque(maxlen=parameters.remembered)

    def copy(self) -> Self:
        """Return one that goes on by itself from here."""
        other = type(self)(self._p)
        other.are_distrusted = self.are_distrusted
        other._waiting, other._gone = self._waiting.copy(), self._gone.copy()
        return other

    def forget(self) -> None:
        """Let go of what waits: how far the robot went since is not known well enough to tell."""
        self._waiting.clear()

    def look(
        self, scan: Scan, pose: FloatArray, seen: FloatArray, things: OrientedPoints
    ) -> list[OrientedPoints]:
        """Look for the things of a while ago, and note those of now; return what stood meanwhile.

        Parameters
        ----------
        scan, pose
            Now: one sweep, and where it was taken (3,), tracking frame. Where stamps tell no time,
            what was seen before is a while ago.
        seen
            (n, 2) its returns [m], tracking frame.
        things
            Those of them that are on things that may move.
        """
        stood = []
        while self._waiting and not self._is_recent(self._waiting[0].stamp, scan.stamp):
            then = self._waiting.popleft().things
            there = nearest_distances(seen, then.points) <= self._p.near
            view = se2.transform_points(se2.inverse(pose), then.points)
            gone = seen_through(scan, view, self._p.clearance, self._p.sight) & ~there
            self._gone.extend(gone[gone | there].tolist())
            stood.append(then.at(np.flatnonzero(there)))
        if len(things):
            self._waiting.append(_Sighting(scan.stamp, things))
        self._judge()
        return stood

    def _judge(self) -> None:
        """Trust things, or no longer, by those that were looked for."""
        p = self._p
        if len(self._gone) < p.judged:
            return
        lately = min(p.lately, len(self._gone))
        if sum(islice(reversed(self._gone), lately)) / lately > p.moving:
            self.are_distrusted = True
        elif sum(self._gone) / len(self._gone) <= p.standing:
            self.are_distrusted = False

    def _is_recent(self, stamp: float, now: float) -> bool:
        passed = abs(now - stamp)
        return math.isfinite(passed) and passed < self._p.settled
