"""How far a robot can have come between two scans: no farther than its speed and the time allow.

Stamps are evidence of their own: they jitter, come in batches, repeat and run back. So the time
between two scans is what their stamps say, or what so many scans usually take, whichever is more
(`ScanClock`). Where stamps tell no time at all, nothing is bound here, and the pace of the robot
has to do: `MotionModel.reach`.
"""

import math
from collections import deque
from collections.abc import Collection
from typing import NamedTuple, Self

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import BoolArray, FloatArray
from mapweave.parameters import StageParameters, derived
from mapweave.scan.clock import ScanClock
from mapweave.scan.scan import Scan


class ReachabilityParameters(StageParameters):
    """What a robot can do, and how much of the past tells it."""

    max_speed: float = derived(lambda c: c.robot.max_speed, gt=0, description="[m/s]")
    max_turn_rate: float = derived(lambda c: c.robot.max_turn_rate, gt=0, description="[rad/s]")
    slack: float = derived(
        lambda c: c.mapping.closeness, gt=0, description="[m] more, as poses err"
    )
    turn_slack: float = derived(
        lambda c: c.mapping.keyframe_turn, gt=0, description="[rad] more, as poses err"
    )
    window: float = Field(1.0, gt=0, description="[s] of the way that is bound as a whole, too")
    remembered: int = Field(60, ge=1, description="placed scans, the most, of that way")


class _Stay(NamedTuple):
    """Where a robot was at a scan."""

    number: int
    stamp: float
    pose: FloatArray


class Reachability:
    """Knows when a robot was where of late."""

    def __init__(self, parameters: ReachabilityParameters) -> None:
        self._p = parameters
        self._clock = ScanClock()
        self._way: deque[_Stay] = deque(maxlen=parameters.remembered)

    def copy(self) -> Self:
        """Return one that goes on by itself from here."""
        other = type(self)(self._p)
        other._clock, other._way = self._clock.copy(), self._way.copy()
        return other

    def afresh(self) -> Self:
        """Return one that knows how long scans take, and of no place."""
        other = type(self)(self._p)
        other._clock = self._clock.afresh()
        return other

    @property
    def interval(self) -> float | None:
        """The time [s] that a scan usually takes; None where stamps do not tell."""
        return self._clock.interval

    def tick(self, scan: Scan) -> None:
        """Note that `scan` was taken, be it placed or not."""
        self._clock.tick(scan)

    def placed(self, scan: Scan, pose: FloatArray) -> None:
        """Note that `scan` was taken at `pose` (3,); what lies longer ago is let go."""
        self._way.append(_Stay(scan.index, scan.stamp, pose))
        while len(self._way) > 1 and self._time(self._way[1], scan) >= self._p.window:
            self._way.popleft()

    def since_placed(self, scan: Scan) -> float:
        """Return how long ago [s] a scan was placed; infinite where nothing tells."""
        if self.interval is None or not self._way:
            return math.inf
        return self._time(self._way[-1], scan)

    def between(self, scan: Scan, other: Scan) -> float:
        """Return how far [m] a robot comes between two scans, as far as stamps tell."""
        return self.way(self._time(_Stay(other.index, other.stamp, se2.IDENTITY), scan))

    def way(self, time: float) -> float:
        """Return how far [m] a robot comes in a `time` [s]."""
        return self._p.slack + self._p.max_speed * time

    def most(self, time: float) -> tuple[float, float]:
        """Return how far [m] a robot comes, and turns [rad], in a `time` [s], were poses exact."""
        return self._p.max_speed * time, self._p.max_turn_rate * time

    def allows(self, scan: Scan, poses: FloatArray) -> BoolArray:
        """(k,) whether the robot can have come to each of `poses` (k, 3) by the time of `scan`."""
        return self._within(self._way, scan, poses)

    def joins(self, scan: Scan, pose: FloatArray, other: Scan, there: FloatArray) -> bool:
        """Whether it can have been at `pose` (3,) at `scan`, and at `there` (3,) at `other`."""
        at = _Stay(other.index, other.stamp, there)
        return bool(self._within([at], scan, pose[None])[0])

    def _within(self, way: Collection[_Stay], scan: Scan, poses: FloatArray) -> BoolArray:
        """(k,) which of `poses` (k, 3), of `scan`, are near enough to all that is on a `way`."""
        p = self._p
        if self.interval is None or not way:
            return np.ones(len(poses), dtype=np.bool_)
        time = np.array([self._time(stay, scan) for stay in way])
        apart = np.abs(poses[:, None] - np.array([stay.pose for stay in way]))
        turned = np.abs(se2.wrap(apart[..., 2]))
        near = np.hypot(apart[..., 0], apart[..., 1]) <= p.slack + p.max_speed * time
        possible = near & (turned <= p.turn_slack + p.max_turn_rate * time)
        return np.asarray(possible.all(axis=1))

    def _time(self, stay: _Stay, scan: Scan) -> float:
        return self._clock.since(stay.number, stay.stamp, scan)
