"""Where a robot can have been while it was lost: near where it was before, and after.

Stamps and the usual time of a scan say how long it was lost, its speed and turn rate how far it
came meanwhile at the most. Most robots are slower than that: where they were tracked, their steps
from scan to scan tell how far they usually come.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
from pydantic import Field

from mapweave.geometry import se2
from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.maps import Submap
from mapweave.parameters import StageParameters, derived


class WhereaboutsParameters(StageParameters):
    """What a robot can do, and what is nearby."""

    max_speed: float = derived(lambda c: c.robot.max_speed, gt=0, description="[m/s]")
    max_turn_rate: float = derived(lambda c: c.robot.max_turn_rate, gt=0, description="[rad/s]")
    slack: float = derived(
        lambda c: 2 * c.mapping.closeness, gt=0, description="[m] more, as poses err"
    )
    turn_slack: float = derived(
        lambda c: c.mapping.keyframe_turn, gt=0, description="[rad] more, as poses err"
    )
    paced: float = Field(
        1.5, ge=1, description="times the longer steps from scan to scan, of what was tracked"
    )
    longer: float = Field(
        0.95, gt=0, le=1, description="share of the steps that is shorter than those"
    )
    few: int = Field(10, ge=1, description="steps, of which nothing is concluded")
    untold: float = derived(
        lambda c: 1.5 * c.robot.max_speed,
        gt=0,
        description="[m] from scan to scan, where nothing else is known",
    )
    farthest: float = derived(
        lambda c: 7.5 * c.robot.max_speed,
        gt=0,
        description="[m] it may have come, at the most: beyond, nothing is known",
    )


class Path(NamedTuple):
    """The scans of a component.

    Attributes
    ----------
    number, stamp, pose
        (n,) their numbers, ascending, (n,) stamps [s], and (n, 3) poses in the component.
    interval
        The usual time from a scan to the next [s]; 0 where stamps do not tell.
    """

    number: IntArray
    stamp: FloatArray
    pose: FloatArray
    interval: float

    @classmethod
    def of(cls, submaps: Sequence[Submap], component: int) -> Self:
        """Return that of one of the components of `submaps`."""
        inside = [s for s in submaps if s.component == component and len(s.trajectory.pose)]
        number = np.concatenate([s.trajectory.scan_index for s in inside])
        stamp = np.concatenate([s.trajectory.stamp for s in inside])
        pose = np.concatenate([se2.compose(s.pose, s.trajectory.pose) for s in inside])
        order = np.argsort(number, kind="stable")
        number, stamp = number[order], stamp[order]
        between = np.diff(stamp) / np.maximum(np.diff(number), 1)
        told = between[np.isfinite(between)]
        usual = max(float(np.median(told)), 0.0) if len(told) else 0.0
        return cls(number, stamp, pose[order], usual)


class _End(NamedTuple):
    """A (3,) pose in the component, the (3,) pose of what was lost next to it, and how far apart.

    At most `way` [m] and `turn` [rad] lie between them, and `unseen` scans that are in no map.
    """

    at: FloatArray
    own: FloatArray
    way: float
    turn: float
    unseen: int


class Whereabouts:
    """Where a robot can have been on a path that was `lost`, by the `known` one.

    A pose is that of the lost path's frame in the known one's. All scans that are in any map have
    the numbers `mapped`.
    """

    def __init__(
        self, lost: Path, known: Path, mapped: IntArray, parameters: WhereaboutsParameters
    ) -> None:
        self._p = parameters
        self._ends: list[_End] = []
        first, last = (int(np.searchsorted(known.number, lost.number[k])) for k in (0, -1))
        for theirs, own in ((first - 1, 0), (last, -1)):
            if 0 <= theirs < len(known.number):
                way, turn = self._most(lost, own, known, theirs)
                numbers = sorted((int(known.number[theirs]), int(lost.number[own])))
                seen = np.isin(np.arange(numbers[0] + 1, numbers[1]), mapped)
                end = _End(known.pose[theirs], lost.pose[own], way, turn, int((~seen).sum()))
                self._ends += [end] if way <= parameters.farthest else []

    @property
    def went_unseen(self) -> bool:
        """Whether scans are in no map between it and all that is known: where it went, none saw."""
        return all(end.unseen > 0 for end in self._ends)

    def mapped(self, known: Path) -> int:
        """Return how many scans of the `known` path lie about there."""
        near = np.zeros(len(known.pose), dtype=np.bool_)
        for end in self._ends:
            near |= np.hypot(*(known.pose - end.at)[:, :2].T) <= self._p.farthest
        return int(near.sum())

    def allows(self, transforms: FloatArray) -> BoolArray:
        """(k,) by which of (k, 3) `transforms` it did not leap; by none where nothing is known."""
        possible = np.full(len(transforms), bool(self._ends))
        for end in self._ends:
            x, y, turn = se2.between(end.at, se2.compose(transforms, end.own)).T
            possible &= (np.hypot(x, y) <= end.way) & (np.abs(se2.wrap(turn)) <= end.turn)
        return possible

    def _most(self, lost: Path, own: int, known: Path, theirs: int) -> tuple[float, float]:
        """How far [m] and turned [rad] it can have come from one scan to the other."""
        p = self._p
        time = _time(lost, own, known, theirs)
        turn = p.turn_slack + p.max_turn_rate * time if time > 0 else math.pi
        return farthest_way(known, theirs, lost, own, p), turn


def farthest_way(known: Path, theirs: int, lost: Path, own: int, p: WhereaboutsParameters) -> float:
    """How far [m] a robot can have come between two scans, by their places in two paths.

    The `known` path tells its pace, and stamps the time.
    """
    scans = max(abs(int(lost.number[own] - known.number[theirs])), 1)
    way, time = p.slack + scans * _longer_step(known, p), _time(lost, own, known, theirs)
    return min(way, p.slack + p.max_speed * time) if time > 0 else way


def _time(lost: Path, own: int, known: Path, theirs: int) -> float:
    """[s] between two scans, the longest that there is evidence for; 0 where there is none."""
    told = abs(float(lost.stamp[own] - known.stamp[theirs]))
    counted = known.interval * abs(int(lost.number[own] - known.number[theirs]))
    return max(counted, told if math.isfinite(told) else 0.0)


def _longer_step(known: Path, p: WhereaboutsParameters) -> float:
    """How far [m] a robot comes from scan to scan, when it comes far."""
    follows = np.diff(known.number) == 1
    if follows.sum() < p.few:
        return p.untold
    steps = np.hypot(*np.diff(known.pose[:, :2], axis=0)[follows].T)
    return p.paced * float(np.quantile(steps, p.longer))
