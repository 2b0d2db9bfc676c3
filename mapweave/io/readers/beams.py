"""Where the beams of a scan look: from what a line states of them, however it states it."""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from mapweave.geometry.arrays import FloatArray

DEGREE = math.pi / 180
_TURN = 2 * math.pi

MIN_RESOLUTION = 1e-4  # [rad] finer than any lidar's, and coarse enough to compute with


class DamagedLineError(Exception):
    """A line that was meant to hold a scan and does not hold a whole one."""


class Beams(NamedTuple):
    """Where the beams of a scan look.

    Attributes
    ----------
    angles
        (n,) [rad] in the sensor's frame, ascending; shared, so read-only.
    clockwise
        Whether the line has its readings in the opposite order.
    assumed
        What was assumed because the log does not say it: half a sentence; empty for nothing.
    """

    angles: FloatArray
    clockwise: bool = False
    assumed: str = ""

    def ascending(self, readings: FloatArray) -> FloatArray:
        """Return (n,) `readings`, in the order of the line, in the order of `angles`."""
        return readings[::-1] if self.clockwise else readings


@lru_cache(maxsize=16)
def beam_angles(start: float, resolution: float, count: int) -> FloatArray:
    """Return the ``(count,)`` directions [rad] from `start` on; shared, so read-only.

    Raises
    ------
    DamagedLineError
        If there are fewer than two beams, or if they do not ascend within one turn.
    """
    if count < 2 or not _is_sound(start, resolution, count):
        raise DamagedLineError(
            f"{count} beams, {resolution} rad apart, from {start} rad; expected two or more that"
            " ascend within one turn"
        )
    return _read_only(start + resolution * np.arange(count, dtype=np.float64))


def even_beams(start: float, step: float, count: int, assumed: str = "") -> Beams:
    """Return ``count`` beams, `step` [rad] apart from `start` [rad] on; clockwise if negative.

    Raises
    ------
    DamagedLineError
        If there are fewer than two beams, or if they go round more than once.
    """
    if step >= 0 or count < 2:
        return Beams(beam_angles(start, step, count), assumed=assumed)
    if not _is_sound(start, -step, count):
        raise DamagedLineError(
            f"{count} beams, {step} rad apart, from {start} rad; expected two or more within one"
            " turn"
        )
    descending = start + step * np.arange(count, dtype=np.float64)
    return Beams(_read_only(descending[::-1].copy()), clockwise=True, assumed=assumed)


@lru_cache(maxsize=16)
def stated_beams(start: float, field_of_view: float, resolution: float, count: int) -> Beams:
    """Return the beams of a line that states all this [rad]; in degrees, where it must be.

    A negative resolution is a sensor that turns clockwise, or hangs upside down. A resolution of
    0 is none: the beams are spread over the field of view.

    Raises
    ------
    DamagedLineError
        If there are fewer than two beams, or if they go round more than once.
    """
    step = resolution or _spread(field_of_view, count, _TURN)
    assumed = (
        "" if resolution else "beams are spread over the field of view, as the resolution is 0"
    )
    if count >= 2 and not _is_sound(start, abs(step), count):
        degrees = resolution or _spread(field_of_view, count, 360.0)
        if _are_degrees(start, field_of_view, degrees, count):
            start, step = start * DEGREE, degrees * DEGREE
            in_degrees = "angles beyond a turn are degrees"
            assumed = f"{in_degrees}; {assumed}" if assumed else in_degrees
    return even_beams(start, step, count, assumed)


def _is_sound(start: float, resolution: float, count: int) -> bool:
    """Return whether beams ascend within one turn, and can be told apart."""
    span = resolution * (count - 1)
    sound = abs(start) <= _TURN and MIN_RESOLUTION <= resolution < math.inf  # False for NaN
    return sound and span <= _TURN + resolution


def _spread(field_of_view: float, count: int, turn: float) -> float:
    """Return the step of ``count`` beams over a field of view, in its unit, of `turn` a turn.

    The outermost beams look along its sides; on a full turn an even number of beams has none
    that looks where the first does.
    """
    gaps = count if abs(field_of_view) > 0.999 * turn and count % 2 == 0 else count - 1
    return field_of_view / gaps if gaps > 0 else 0.0


def _are_degrees(start: float, field_of_view: float, step: float, count: int) -> bool:
    """Return whether angles that are unsound in radians agree with each other in degrees."""
    beyond_a_turn = abs(field_of_view) > 1.1 * _TURN  # False for NaN
    agree = abs((count - 1) * abs(step) - abs(field_of_view)) <= 2 * abs(step)
    return beyond_a_turn and agree and _is_sound(start * DEGREE, abs(step) * DEGREE, count)


def _read_only(angles: FloatArray) -> FloatArray:
    angles.setflags(write=False)
    return angles
