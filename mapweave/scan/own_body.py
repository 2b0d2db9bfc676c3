"""The robot's own body: returns that keep their place in the sensor's frame while the world moves.

A lidar that is not on top sees the robot that carries it, at the same few beams and the same range
in every scan. Taken for walls, these returns say at each place that the robot never moved. They
are found by that: over some scans between which nearly all else changed, they did not, and they
never looked farther. A wall that the robot drives along keeps its range as well, for a while; the
beams that see it saw other things before, or will: then they are no body.
"""

from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from pydantic import Field

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.parameters import StageParameters, derived
from mapweave.scan.scan import Scan


class OwnBodyParameters(StageParameters):
    """What stands still, what moves, and how long it must."""

    near: float = Field(1.0, gt=0, description="[m] within which a robot sees itself")
    still: float = derived(
        lambda c: 3 * c.sensor.range_sigma,
        gt=0,
        description="[m] by which ranges of the body differ at the most",
    )
    moved: float = derived(
        lambda c: 5 * c.sensor.range_sigma,
        gt=0,
        description="[m] by which a range differs from the scan before, where the robot moved",
    )
    moving: float = Field(
        0.25, gt=0, le=1, description="share of the other ranges that do so if it moved"
    )
    scans: int = Field(6, ge=2, description="between which it moved, and the body stood still")
    changed: float = Field(
        0.85, gt=0, le=1, description="share of the other ranges that changed over these scans"
    )
    witnesses: int = Field(30, ge=1, description="other ranges, at the least")
    edge: float = derived(
        lambda c: c.mapping.closeness,
        gt=0,
        description="[m] by which what is beside it is farther: a wall goes on, a robot ends",
    )
    beyond: float = Field(
        0.02, ge=0, lt=1, description="share of a beam's readings that may go beyond the body"
    )
    often: int = Field(2, ge=1, description="times that it stood still, if more go beyond")
    beyond_often: float = Field(
        0.6, ge=0, lt=1, description="share that may go beyond what stood still so often"
    )
    width: int = Field(5, ge=1, description="beams side by side that see it, at the least")
    max_width: float = Field(1.3, gt=0, description="[m] of what is seen of a robot at a time")
    margin: int = Field(2, ge=0, description="beams beside them that it may reach into")
    depth: float = derived(
        lambda c: 5 * c.sensor.range_sigma, gt=0, description="[m] that it may reach farther"
    )


COUNTED = 64  # scans whose readings are counted together, at the most: it takes less time


class OwnBody:
    """Watches raw scans for what moves with the sensor.

    Attributes
    ----------
    reach
        (n,) [m] up to where each beam sees the robot; 0 where it does not. Empty before a scan.
    """

    def __init__(self, parameters: OwnBodyParameters | None = None) -> None:
        self._p = parameters or OwnBodyParameters()
        self.reach: FloatArray = np.empty(0)
        self._spacing = 0.0  # [rad] between beams
        self._moves = 0  # between scans of the stretch
        self._last: FloatArray = np.empty(0)
        self._begin(0)

    def watch(self, scan: Scan) -> bool:
        """Take a raw scan; return whether it changes what is known of the robot."""
        if len(self.reach) != len(scan.ranges):
            self._begin(len(scan.ranges))
            self._spacing = float(scan.angles[-1] - scan.angles[0]) / max(len(scan.angles) - 1, 1)
        self._count(scan.ranges)
        if self._moves and not self._has_moved(self._last, scan.ranges):
            return False
        self._last, self._moves = scan.ranges, self._moves + 1
        if self._moves < self._p.scans or not self._has_changed():
            return False
        self._remember(self._standing())
        self._look_anew()
        before, self.reach = self.reach, self._reach()
        return bool(((self.reach > 0) != (before > 0)).any())

    @property
    def is_suspected(self) -> bool:
        """Whether near beams stood still so far, and not all else has changed to say why."""
        return not self.reach.any() and bool(self._in_runs(self._near & self._still).any())

    @property
    def extent(self) -> tuple[float, float]:
        """How many degrees of the field of view see the robot, and how far it reaches [m]."""
        wide = float((self.reach > 0).sum() * self._spacing)
        return np.degrees(wide), max(float(self.reach.max(initial=0.0)) - self._p.depth, 0.0)

    def without(self, scan: Scan) -> Scan:
        """Return `scan` with no return where it sees the robot."""
        if len(self.reach) != len(scan.ranges):
            return scan
        with np.errstate(invalid="ignore"):
            own = scan.ranges < self.reach
        return replace(scan, ranges=np.where(own, np.nan, scan.ranges)) if own.any() else scan

    def _begin(self, beams: int) -> None:
        """Know nothing yet of a sensor with so many `beams`."""
        self._bins = round(self._p.near / self._p.still)
        self._readings = np.zeros(
            (self._bins + 1, beams), dtype=np.int64
        )  # by range, far ones last
        self._uncounted: list[FloatArray] = []  # ranges of scans, to be counted together
        self._stood = self.reach = np.zeros(beams)
        self._times = np.zeros(beams, dtype=np.int64)  # that each stood still where it did
        self._look_anew()

    def _look_anew(self) -> None:
        """Begin another stretch of scans: the least and the most that each beam reads in it."""
        beams = len(self.reach)
        self._low, self._high = np.full(beams, np.inf), np.full(beams, -np.inf)
        self._last, self._moves = self.reach, 0

    @property
    def _near(self) -> BoolArray:
        """(n,) which beams returned in the stretch, and never from far."""
        return np.asarray(np.isfinite(self._high) & (self._high < self._p.near))

    @property
    def _still(self) -> BoolArray:
        """(n,) which beams read the same in all scans of the stretch."""
        return np.asarray(self._high - self._low <= self._p.still)

    def _count(self, ranges: FloatArray) -> None:
        """Count what each beam reads."""
        self._low, self._high = np.fmin(self._low, ranges), np.fmax(self._high, ranges)
        self._uncounted.append(ranges)
        if len(self._uncounted) == COUNTED:
            self._add_up()

    def _add_up(self) -> None:
        """Count the readings of scans that were taken since it was done last."""
        if not self._uncounted:
            return
        ranges = np.array(self._uncounted)
        _, beams = np.nonzero(np.isfinite(ranges))
        steps = np.minimum(ranges[np.isfinite(ranges)] / self._p.still, self._bins)
        np.add.at(self._readings, (steps.astype(np.int64), beams), 1)
        self._uncounted = []

    def _has_moved(self, before: FloatArray, now: FloatArray) -> bool:
        """Whether the robot did between two scans, by what is not near."""
        far = (before >= self._p.near) & (now >= self._p.near)
        changed = np.abs(now - before)[far] > self._p.moved
        share = np.count_nonzero(changed) / max(len(changed), 1)
        return bool(len(changed) >= self._p.witnesses and share >= self._p.moving)

    def _has_changed(self) -> bool:
        """Whether nearly all did that is not near: where the robot is looks different now."""
        others = np.isfinite(self._low) & (self._low >= self._p.near)
        changed = others & (self._high - self._low > self._p.moved)
        count = int(others.sum())
        return bool(count >= self._p.witnesses and changed.sum() >= self._p.changed * count)

    def _remember(self, standing: FloatArray) -> None:
        """Note where beams stood still (n,), and forget those that look farther too often."""
        self._add_up()
        p, stood = self._p, standing > 0
        same = stood & (np.abs(standing - self._stood) <= p.still)
        self._times = np.where(same, self._times + 1, np.where(stood, 1, self._times))
        self._stood = np.where(same, np.maximum(standing, self._stood), self._stood)
        self._stood = np.where(stood & ~same, standing, self._stood)
        allowed = np.where(self._times >= p.often, p.beyond_often, p.beyond)
        self._stood[self._goes_beyond(self._stood) > allowed] = 0.0

    def _standing(self) -> FloatArray:
        """(n,) [m] where beams stood still, though all else changed; 0 where they did not."""
        own = self._near & self._still & (self._high > self._p.still)  # nothing is within a lidar
        for beams in _runs(own):
            if self._is_wide(beams) or not self._ends(beams):
                own[beams] = False
        return np.where(own, self._high, 0.0)

    def _is_wide(self, beams: IntArray) -> bool:
        """Whether `beams` (k,) side by side see something too wide for a robot: a wall."""
        first, last = self._high[beams[0]], self._high[beams[-1]]
        angle = self._spacing * (len(beams) - 1)
        squared = first**2 + last**2 - 2 * first * last * np.cos(angle)
        return bool(squared > self._p.max_width**2)

    def _ends(self, beams: IntArray) -> bool:
        """Whether what `beams` (k,) see ends on both sides, or where the field of view does."""
        p, last = self._p, len(self._high) - 1
        sides = ((beams[0], beams[0] - 1 - p.margin), (beams[-1], beams[-1] + 1 + p.margin))
        for inside, beside in sides:
            if 0 <= beside <= last and self._high[beside] < self._high[inside] + p.edge:
                return False
        return True

    def _goes_beyond(self, stood: FloatArray) -> FloatArray:
        """(n,) the share of each beam's readings that is farther than where it `stood`."""
        above = np.minimum(stood / self._p.still + 1, self._bins - 1).astype(np.int64)
        farther = np.arange(self._bins + 1)[:, None] > above
        beyond = np.where(farther, self._readings, 0).sum(axis=0)
        return np.asarray(beyond / np.maximum(self._readings.sum(axis=0), 1))

    def _reach(self) -> FloatArray:
        """(n,) [m] up to where each beam may see the robot, a little beside what stood as well."""
        p = self._p
        reach = np.where(self._in_runs(self._stood > 0), self._stood + p.depth, 0.0)
        beside = np.pad(reach, p.margin)
        return np.asarray(sliding_window_view(beside, 2 * p.margin + 1).max(axis=1))

    def _in_runs(self, chosen: BoolArray) -> BoolArray:
        """(n,) which of the `chosen` beams have enough others side by side."""
        found = np.zeros(len(chosen), dtype=np.bool_)
        for beams in _runs(chosen):
            found[beams] = len(beams) >= self._p.width
        return found


def _runs(chosen: BoolArray) -> list[IntArray]:
    """Return the numbers of the beams that are `chosen` (n,), those side by side together."""
    beams = np.flatnonzero(chosen)
    return np.split(beams, np.flatnonzero(np.diff(beams) > 1) + 1) if len(beams) else []
