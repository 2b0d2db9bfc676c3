"""The poses of a submap's scans as whole numbers, and these as a stream.

A robot goes on as it went: each pose is given by what differs from the last motion carried on.
What receivers do with them (the middle of a path, its length, drawing it) needs no more than the
steps below.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapweave.geometry.arrays import IntArray
from mapweave.kernels.range_coder import Coder
from mapweave.maps import Trajectory
from mapweave.scan.scan import MAX_STAMP
from mapweave_protocol.wire import packing
from mapweave_protocol.wire.coding.line_code import turned_back

PER_METRE = 36  # a step of 28 mm: no scan moves by more than 20 mm
PER_TURN = 912  # a step of 0.39°: no heading turns by more than 0.2°
PER_SECOND = 10  # [1/s]: a step of 0.1 s; which scan it is says its index
MAX_SCANS = 100_000  # of one submap
MAX_INDEX = 2**53
_FINE = 64  # parts of a step in which a motion is carried on
_UNIT = 14  # bits of a cosine
_COSINES = [round((1 << _UNIT) * math.cos(2 * math.pi * k / PER_TURN)) for k in range(PER_TURN)]


@dataclass(frozen=True, slots=True, eq=False)
class CodedTrajectory:
    """A trajectory as whole numbers.

    Attributes
    ----------
    rows
        (m, 6) scan index, whether the stamp is known, stamp, x, y, heading.
    """

    rows: IntArray

    @classmethod
    def of(cls, trajectory: Trajectory, reach: float) -> "CodedTrajectory":
        """Return `trajectory` as whole numbers.

        Raises
        ------
        ValueError
            If a pose is not finite, or further out than `reach` [m].
        """
        places = packing.quantise(trajectory.pose[:, :2], PER_METRE, reach)
        turns = packing.quantise(trajectory.pose[:, 2], PER_TURN / (2 * np.pi), 1e6) % PER_TURN
        known = np.abs(trajectory.stamp) <= MAX_STAMP
        ticks = np.rint(np.where(known, trajectory.stamp, 0.0) * PER_SECOND).astype(np.int64)
        return cls(np.column_stack([trajectory.scan_index, known, ticks, places, turns]))

    def restore(self, reach: float) -> Trajectory:
        """Return the trajectory.

        Raises
        ------
        ValueError
            If a pose is further out than `reach` [m].
        """
        index, known, ticks, x, y, turn = self.rows.T
        stamps = np.where(known, ticks / PER_SECOND, np.nan)
        places = packing.unquantise(np.column_stack([x, y]), PER_METRE, reach)
        headings = (turn - PER_TURN * (turn > PER_TURN // 2)) * (2 * np.pi / PER_TURN)
        return Trajectory(index, stamps, np.column_stack([places, headings]))


@dataclass
class Clock:
    """Which scan of the stream was the last, and when: submaps follow each other."""

    index: int = -1
    ticks: int = 0
    interval: int = 0


def code_trajectory(
    coder: Coder, trajectory: CodedTrajectory | None, clock: Clock
) -> CodedTrajectory:
    """Code `trajectory` with an encoder, or return what a decoder finds.

    Raises
    ------
    ValueError
        If there are too many scans, or an index is out of bounds.
    """
    given = None if trajectory is None else trajectory.rows.tolist()
    scans = coder.count("scans", MAX_SCANS, 0 if given is None else len(given))
    motion = _Motion(coder)
    rows = []
    for number in range(scans):
        row = [0] * 6 if given is None else given[number]
        first = number == 0
        rows.append((*_code_time(coder, clock, row, first=first), *motion.step(row[3:])))
    return CodedTrajectory(packing.whole_numbers(rows).reshape(-1, 6))


def _code_time(
    coder: Coder, clock: Clock, row: Sequence[int], *, first: bool
) -> tuple[int, int, int]:
    """Code index and stamp of a scan."""
    clock.index += 1 + coder.signed(("scan", first), row[0] - clock.index - 1)
    if not 0 <= clock.index <= MAX_INDEX:
        raise ValueError(f"scan index, expected 0 to {MAX_INDEX}")
    known = coder.bit("stamped", row[1])
    if not known:
        return clock.index, 0, 0
    late = coder.signed(("stamp", first), row[2] - clock.ticks - clock.interval)
    step = clock.interval + late
    clock.ticks += step
    if abs(clock.ticks) > MAX_STAMP * PER_SECOND:
        raise ValueError(f"stamp, expected at most {MAX_STAMP:g} s")
    if not first:
        clock.interval = step
    return clock.index, 1, clock.ticks


class _Motion:
    """Carries the motion between the last two poses on, in the robot's own frame."""

    def __init__(self, coder: Coder) -> None:
        self._coder = coder
        self._x = self._y = self._heading = 0
        self._ahead = self._left = self._turned = 0  # the last motion, in parts of a step
        self._steps = 0

    def step(self, pose: Sequence[int]) -> tuple[int, int, int]:
        """Code the next pose."""
        stage = min(self._steps, 2)
        turned = _wrapped(pose[2] - self._heading)
        size = min(abs(self._turned).bit_length(), 4)
        more = self._coder.signed(("heading", size), _wrapped(turned - self._turned))
        turned = _wrapped(self._turned + more)
        between = self._heading + turned // 2
        x, y = self._carried_on(between)
        quarter = (between + PER_TURN // 8) // (PER_TURN // 4)
        ahead, left = turned_back(quarter, pose[0] - x, pose[1] - y)
        speed = min(4, (abs(self._ahead) // _FINE).bit_length())
        ahead = self._coder.signed(("ahead", stage, speed, "pose"), ahead)
        left = self._coder.signed(("left", stage, min(3, abs(more).bit_length())), left)
        dx, dy = turned_back(-quarter, ahead, left)
        self._arrive(x + dx, y + dy, turned, between)
        return self._x, self._y, self._heading

    def _carried_on(self, heading: int) -> tuple[int, int]:
        dx, dy = _turned(heading, self._ahead, self._left)
        return self._x + (dx + _FINE // 2) // _FINE, self._y + (dy + _FINE // 2) // _FINE

    def _arrive(self, x: int, y: int, turned: int, between: int) -> None:
        if self._steps:
            dx, dy = (x - self._x) * _FINE, (y - self._y) * _FINE
            self._ahead, self._left = _turned(-between, dx, dy)
            self._turned = turned
        self._x, self._y = x, y
        self._heading = (self._heading + turned) % PER_TURN
        self._steps += 1


def _wrapped(turn: int) -> int:
    return (turn + PER_TURN // 2) % PER_TURN - PER_TURN // 2


def _turned(heading: int, x: int, y: int) -> tuple[int, int]:
    """Return `x`, `y` turned by `heading`; whole numbers, so that both ends get the same."""
    cosine = _COSINES[heading % PER_TURN]
    sine = _COSINES[(heading - PER_TURN // 4) % PER_TURN]
    half = 1 << (_UNIT - 1)
    return (cosine * x - sine * y + half) >> _UNIT, (sine * x + cosine * y + half) >> _UNIT
