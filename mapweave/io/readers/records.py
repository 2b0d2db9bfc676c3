"""The two kinds of line that hold a scan: CARMEN's ``FLASER`` and ``ROBOTLASER1``.

::

    FLASER n r1…rn x y theta odom_x odom_y odom_theta ipc_timestamp host logger_timestamp
    ROBOTLASER1 type start_angle field_of_view resolution maximum_range accuracy remission_mode
        n r1…rn m s1…sm  laser_x laser_y laser_theta  robot_x robot_y robot_theta
        tv rv forward_safety side_safety turn_axis  ipc_timestamp host logger_timestamp
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from mapweave.geometry.arrays import FloatArray

SCAN_KINDS = (b"FLASER", b"ROBOTLASER1")

FARTHEST_READING = 50.0
"""[m] No laser of these logs measures as far; beyond are their codes 50.0, 51.15, 81.83, 81.91."""

NO_RETURN_CODES = (32.76, 32.767, 51.15, 81.83, 81.87, 81.89, 81.91)
"""[m] SICK's 'no return' in centimetres and millimetres, whatever maximum the log states. A wall
at just one of these distances is lost with them: a few beams in a million."""

_ROUNDING = 0.005
"""[m] Readings are written in centimetres: a maximum of 8.191 comes out as 8.19."""

_MAX_DIGITS = 9  # Of a count: Python refuses to read thousands of digits.
_FLASER_TAIL = 9
_ROBOTLASER_HEAD = 8
_ROBOTLASER_TAIL = 14
_DEGREE = math.pi / 180
_FLASER_RESOLUTION = {
    180: 1.0 * _DEGREE,
    181: 1.0 * _DEGREE,
    360: 0.5 * _DEGREE,
    361: 0.5 * _DEGREE,
    400: 0.25 * _DEGREE,
    401: 0.25 * _DEGREE,
}
"""[rad] The modes of the SICK LMS by the number of beams; 400 and 401 look over the front 100°."""


class DamagedLineError(Exception):
    """A line that was meant to hold a scan and does not hold a whole one."""


@dataclass(frozen=True, slots=True, eq=False)
class LaserRecord:
    """What a line says of one scan.

    Attributes
    ----------
    angles
        (n,) [rad] in the sensor's frame, ascending.
    ranges
        (n,) [m]; NaN where nothing came back.
    laser_pose, robot_pose
        (3,) [m, m, rad] as recorded; which frame they are in is the log's secret.
    stamp
        [s] as recorded; NaN where it is not finite.
    """

    angles: FloatArray
    ranges: FloatArray
    laser_pose: FloatArray
    robot_pose: FloatArray
    stamp: float


def parse_record(words: list[bytes], angular_step: float | None = None) -> LaserRecord:
    """Return what the words of a line whose first is in `SCAN_KINDS` say.

    Parameters
    ----------
    angular_step
        Between beams [rad], where the line does not state it (``FLASER``); None has the number of
        beams tell.

    Raises
    ------
    DamagedLineError
        If a word is missing, left over, or not the number it should be.
    """
    if words[0] == b"FLASER":
        return _parse_flaser(words, angular_step)
    return _parse_robotlaser(words)


def _parse_flaser(words: list[bytes], angular_step: float | None) -> LaserRecord:
    count = _count(words, 1, "beams")
    _check_length(words, 2 + count + _FLASER_TAIL)
    poses = _numbers(words[2 + count : 8 + count])
    return LaserRecord(
        angles=_flaser_angles(count, angular_step),
        ranges=without_no_returns(_numbers(words[2 : 2 + count]), FARTHEST_READING),
        laser_pose=poses[:3],
        robot_pose=poses[3:],
        stamp=_stamp(words[8 + count]),
    )


def _parse_robotlaser(words: list[bytes]) -> LaserRecord:
    count = _count(words, _ROBOTLASER_HEAD, "beams")
    after = _ROBOTLASER_HEAD + 1 + count
    remissions = _count(words, after, "remissions")
    tail = after + 1 + remissions
    _check_length(words, tail + _ROBOTLASER_TAIL)
    start, _, resolution, maximum = _numbers(words[2:6])
    poses = _numbers(words[tail : tail + 6])
    return LaserRecord(
        angles=beam_angles(float(start), float(resolution), count),
        ranges=without_no_returns(_numbers(words[after - count : after]), float(maximum)),
        laser_pose=poses[:3],
        robot_pose=poses[3:],
        stamp=_stamp(words[tail + 11]),
    )


def _count(words: list[bytes], place: int, what: str) -> int:
    if place >= len(words):
        raise DamagedLineError(f"{_name(words)} ends before its number of {what}")
    word = words[place]
    if not word.isdigit() or len(word) > _MAX_DIGITS:
        raise DamagedLineError(f"{_name(words)} has no usable number of {what}")
    return int(word)


def _check_length(words: list[bytes], expected: int) -> None:
    if len(words) != expected:
        raise DamagedLineError(f"{_name(words)} has {len(words)} words, expected {expected}")


def _name(words: list[bytes]) -> str:
    return words[0].decode("ascii")


def _numbers(words: list[bytes]) -> FloatArray:
    try:
        return np.array([float(word) for word in words])
    except ValueError:
        raise DamagedLineError("a word is not a number") from None


def _stamp(word: bytes) -> float:
    stamp = float(_numbers([word])[0])
    return stamp if math.isfinite(stamp) else math.nan


MIN_RESOLUTION = 1e-4  # [rad] finer than any lidar's, and coarse enough to compute with


@lru_cache(maxsize=16)
def beam_angles(start: float, resolution: float, count: int) -> FloatArray:
    """Return the ``(count,)`` directions [rad] from `start` on; shared, so read-only.

    Raises
    ------
    DamagedLineError
        If there are fewer than two beams, or if they do not ascend within one turn.
    """
    span = resolution * (count - 1)
    sound = abs(start) <= 2 * math.pi and resolution >= MIN_RESOLUTION  # False for NaN
    if count < 2 or not (sound and span <= 2 * math.pi + resolution):
        raise DamagedLineError(
            f"{count} beams, {resolution} rad apart, from {start} rad; expected two or more that"
            " ascend within one turn"
        )
    angles: FloatArray = start + resolution * np.arange(count, dtype=np.float64)
    angles.setflags(write=False)
    return angles


def _flaser_angles(count: int, step: float | None = None) -> FloatArray:
    """Return the directions of the beams of a ``FLASER``, which states only how many there are.

    They look ahead in the middle; where `step` [rad] between them is known, that is all it takes.
    """
    if count < 2:
        raise DamagedLineError(f"FLASER has {count} beams, expected two or more")
    if step is not None:
        return beam_angles(-(count - 1) * step / 2, step, count)
    resolution = _FLASER_RESOLUTION.get(count, math.pi / (count - 1))
    # 180 and 360 beams are 181 and 361 whose last one, at +90°, was not sent.
    start = -math.pi / 2 if count in (180, 360) else -(count - 1) * resolution / 2
    return beam_angles(start, resolution, count)


def without_no_returns(readings: FloatArray, maximum: float) -> FloatArray:
    """Return ``(n,)`` `readings` [m] with NaN for every beam that did not come back.

    Parameters
    ----------
    maximum
        The stated maximum range [m]; one that is no distance states nothing.
    """
    limit = maximum if math.isfinite(maximum) and maximum > 0 else FARTHEST_READING
    returned = (readings > 0) & (readings < limit - _ROUNDING)
    for code in NO_RETURN_CODES:
        returned &= np.abs(readings - code) > 1e-6
    return np.where(returned, readings, np.nan)
