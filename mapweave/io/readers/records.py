"""The kinds of lines that hold a scan: CARMEN's ``FLASER`` and ``ROBOTLASER1``, DP-SLAM's.

::

    FLASER n r1…rn x y theta odom_x odom_y odom_theta ipc_timestamp host logger_timestamp
    FLASER n r1…rn x y theta odom_x odom_y odom_theta
    ROBOTLASER1 type start_angle field_of_view resolution maximum_range accuracy remission_mode
        n r1…rn m s1…sm  laser_x laser_y laser_theta  robot_x robot_y robot_theta
        tv rv forward_safety side_safety turn_axis  ipc_timestamp host logger_timestamp
    Odometry x y theta
    Laser n r1…rn
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mapweave.geometry.arrays import FloatArray
from mapweave.io.readers.beams import Beams, DamagedLineError, stated_beams

SCAN_KINDS = (b"FLASER", b"ROBOTLASER1")

FARTHEST_READING = 50.0
"""[m] No laser of these logs measures as far; beyond are their codes 50.0, 51.15, 81.83, 81.91."""

NO_RETURN_CODES = (32.76, 32.767, 51.15, 81.83, 81.87, 81.89, 81.91)
"""[m] SICK's 'no return' in centimetres and millimetres, whatever maximum the log states. A wall
at just one of these distances is lost with them: a few beams in a million."""

_ROUNDING = 0.005
"""[m] Readings are written in centimetres: a maximum of 8.191 comes out as 8.19."""

_MAX_DIGITS = 9  # Of a count: Python refuses to read thousands of digits.
_FLASER_POSES, _FLASER_TIMES = 6, 3
_ROBOTLASER_HEAD = 8
_ROBOTLASER_TAIL = 14


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
        [s] as recorded; NaN where it is not finite, or there is none.
    assumed
        What was assumed of the beams because the log does not say it; empty for nothing.
    """

    angles: FloatArray
    ranges: FloatArray
    laser_pose: FloatArray
    robot_pose: FloatArray
    stamp: float
    assumed: str = ""


def parse_flaser(
    words: list[bytes], beams_of: Callable[[int], Beams], *, untimed: bool
) -> LaserRecord:
    """Return what the words of a ``FLASER`` say.

    Parameters
    ----------
    words
        Of the line, ``FLASER`` the first.
    beams_of
        Tells where so many beams look, which the line does not.
    untimed
        Whether it may end after its poses, as some programs write it. In a log whose other lines
        have times, such a line was cut off.

    Raises
    ------
    DamagedLineError
        If a word is missing, left over, or not the number it should be.
    """
    count = parse_count(words, 1, "beams")
    timed = 2 + count + _FLASER_POSES + _FLASER_TIMES
    check_length(words, (timed, timed - _FLASER_TIMES) if untimed else (timed,))
    poses = parse_numbers(words[2 + count : 8 + count])
    beams = beams_of(count)
    readings = beams.ascending(parse_numbers(words[2 : 2 + count]))
    return LaserRecord(
        angles=beams.angles,
        ranges=without_no_returns(readings, FARTHEST_READING),
        laser_pose=poses[:3],
        robot_pose=poses[3:],
        stamp=parse_stamp(words[8 + count]) if len(words) == timed else math.nan,
        assumed=beams.assumed,
    )


def parse_robotlaser(words: list[bytes]) -> LaserRecord:
    """Return what the words of a ``ROBOTLASER1`` say.

    Raises
    ------
    DamagedLineError
        If a word is missing, left over, or not the number it should be.
    """
    count = parse_count(words, _ROBOTLASER_HEAD, "beams")
    after = _ROBOTLASER_HEAD + 1 + count
    remissions = parse_count(words, after, "remissions")
    tail = after + 1 + remissions
    check_length(words, (tail + _ROBOTLASER_TAIL,))
    start, field_of_view, resolution, maximum = map(float, parse_numbers(words[2:6]))
    poses = parse_numbers(words[tail : tail + 6])
    beams = stated_beams(start, field_of_view, resolution, count)
    readings = beams.ascending(parse_numbers(words[after - count : after]))
    return LaserRecord(
        angles=beams.angles,
        ranges=without_no_returns(readings, maximum),
        laser_pose=poses[:3],
        robot_pose=poses[3:],
        stamp=parse_stamp(words[tail + 11]),
        assumed=beams.assumed,
    )


def parse_laser(
    words: list[bytes], beams_of: Callable[[int], Beams], robot_pose: FloatArray
) -> LaserRecord:
    """Return what the words of a ``Laser`` of DP-SLAM's logs say; no time, and no pose.

    Parameters
    ----------
    words, beams_of
        As `parse_flaser` takes them.
    robot_pose
        (3,) of the ``Odometry`` before it [m, m, rad].

    Raises
    ------
    DamagedLineError
        If a word is missing, left over, or not the number it should be.
    """
    count = parse_count(words, 1, "beams")
    check_length(words, (2 + count,))
    beams = beams_of(count)
    readings = beams.ascending(parse_numbers(words[2:]))
    return LaserRecord(
        angles=beams.angles,
        ranges=without_no_returns(readings, FARTHEST_READING),
        laser_pose=np.full(3, np.nan),
        robot_pose=robot_pose,
        stamp=math.nan,
        assumed=beams.assumed,
    )


def parse_count(words: list[bytes], place: int, what: str) -> int:
    """Return the whole number at `place`: of so many `what`.

    Raises
    ------
    DamagedLineError
        If there is none.
    """
    if place >= len(words):
        raise DamagedLineError(f"{_name(words)} ends before its number of {what}")
    word = words[place]
    if not word.isdigit() or len(word) > _MAX_DIGITS:
        raise DamagedLineError(f"{_name(words)} has no usable number of {what}")
    return int(word)


def check_length(words: list[bytes], expected: tuple[int, ...]) -> None:
    """Raise `DamagedLineError` if there are not as many words as one of `expected`."""
    if len(words) not in expected:
        lengths = " or ".join(map(str, expected))
        raise DamagedLineError(f"{_name(words)} has {len(words)} words, expected {lengths}")


def _name(words: list[bytes]) -> str:
    """Return what a line is called: its first word, or that of Player's that names the device."""
    return (words[3] if words[0][:1].isdigit() else words[0]).decode("ascii", "replace")


def parse_numbers(words: list[bytes]) -> FloatArray:
    """Return the numbers that `words` are.

    Raises
    ------
    DamagedLineError
        If one is none.
    """
    try:
        return np.array([float(word) for word in words])
    except ValueError:
        raise DamagedLineError("a word is not a number") from None


def parse_stamp(word: bytes) -> float:
    """Return the time [s] that `word` is; NaN where it is not finite.

    Raises
    ------
    DamagedLineError
        If it is no number.
    """
    stamp = float(parse_numbers([word])[0])
    return stamp if math.isfinite(stamp) else math.nan


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
