"""A scan: one sweep of ranges, checked when it is made."""

import math
import operator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mapweave.errors import ArgumentError
from mapweave.geometry.arguments import as_number, as_numbers
from mapweave.geometry.arrays import BoolArray, FloatArray
from mapweave.scan.units import check_metres

UNNUMBERED = -1
"""The index of a scan that belongs to no log: who maps it counts."""

MAX_STAMP = 1e11
"""[s]; an overflown clock says nothing, and the time is not known."""

LONGEST_SWEEP = 1.0
"""[s]; no lidar turns slower."""

MIN_BEAMS = 10
"""Of a live scan; fewer show no wall."""

_TURN = 2 * math.pi
_LAST_INDEX = 2**53  # that a file holds


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Scan:
    """One sweep of a 2D laser, in the sensor's frame: x ahead, y to the left.

    Ranges and angles may be given as lists, and clockwise, as some sensors turn: they are turned
    round. What is kept is ascending, and cannot be written to.

    Attributes
    ----------
    ranges
        (n,) measured distances [m]; NaN where nothing came back, which may be given as NaN,
        infinity, zero or a negative number.
    angles
        (n,) beam directions [rad], counter-clockwise: strictly ascending, evenly spaced as a
        laser's are, over one turn at the most. The last beam of a full turn may look where the
        first did.
    index
        Which scan of its log, from 0; `UNNUMBERED`, -1, where there is no log: `Mapper` counts.
    stamp
        When it was taken [s]; NaN where the log gives no usable time.
    odometry
        (3,) the robot's own guess of its pose [m, m, rad], only where it was asked for.
    sweep
        [s] from the first beam to the last; 0 where all are of one instant, or it is not known.
        Negative where the last one was taken first, as by a sensor that turns clockwise: `stamp` is
        of the beam that was taken first.

    Raises
    ------
    ArgumentError
        If ranges and angles are not of one length, or one of the arguments is not as above.

    Examples
    --------
    >>> Scan([1.0, 1.1, float("inf")], [-0.1, 0.0, 0.1]).hits.tolist()
    [True, True, False]
    >>> Scan([1.0, 2.0], [0.5, -0.5]).ranges.tolist()  # clockwise
    [2.0, 1.0]
    """

    ranges: FloatArray
    angles: FloatArray
    index: int
    stamp: float
    odometry: FloatArray | None
    sweep: float

    def __init__(
        self,
        ranges: ArrayLike,
        angles: ArrayLike,
        index: int = UNNUMBERED,
        stamp: float = math.nan,
        odometry: ArrayLike | None = None,
        sweep: float = 0.0,
    ) -> None:
        given = _of_one_length(ranges, angles)
        measured, directions = _ascending(*given)
        _check_directions(directions)
        returned = np.where((measured > 0) & (measured < np.inf), measured, np.nan)
        keep = object.__setattr__  # only here: the instance is frozen
        keep(self, "ranges", _read_only(returned))
        keep(self, "angles", _owned(directions))
        keep(self, "index", _index(index))
        keep(self, "stamp", _stamp(stamp))
        keep(self, "odometry", None if odometry is None else _pose("odometry", odometry))
        keep(self, "sweep", _sweep(sweep if directions is given[1] else -sweep))

    @classmethod
    def of(
        cls,
        ranges: ArrayLike,
        angle_min: float,
        angle_increment: float,
        *,
        range_min: float = 0.0,
        range_max: float = math.inf,
        index: int = UNNUMBERED,
        stamp: float = math.nan,
        odometry: ArrayLike | None = None,
        time_increment: float = 0.0,
    ) -> "Scan":
        """Return a scan from what drivers state, such as a ROS ``LaserScan``.

        Parameters
        ----------
        ranges
            (n,) [m]; NaN, infinity, zero or a negative number where nothing came back.
        angle_min
            Direction of the first beam [rad].
        angle_increment
            From each beam to the next [rad]; negative for a sensor that turns clockwise.
        range_min, range_max
            [m] readings below the one are no returns, nor are those at the other and beyond, as
            some lidars and simulators write; a number that is no distance states nothing.
        index, stamp, odometry
            As of `Scan`.
        time_increment
            From each beam to the next [s]; 0 where it is not known. Where a sweep would take more
            than `LONGEST_SWEEP` it is in another unit, and states nothing.

        Raises
        ------
        ArgumentError
            If one of them is no number, the angles are not finite, the increment is zero, nothing
            is between the ranges, the beams go round more than once, or the distances seem to be
            in millimetres.

        Examples
        --------
        >>> Scan.of([2.0, 2.0, 9.9], angle_min=0.1, angle_increment=-0.1, range_max=9.0).ranges
        array([nan,  2.,  2.])
        """
        first, step = _angle("angle_min", angle_min), _angle("angle_increment", angle_increment)
        if step == 0:
            raise ArgumentError("angle_increment", "expected an angle [rad] other than 0")
        low, high = _span(range_min, range_max)
        given = as_numbers("ranges", ranges, "expected (n,) distances [m]")
        check_metres(given)
        used = np.where((given >= low) & (given < high), given, np.nan)
        angles = first + step * np.arange(given.size, dtype=np.float64)
        each = as_number("time_increment", time_increment, "expected a time [s]")
        swept = each * max(given.size - 1, 0)
        sweep = swept if abs(swept) <= LONGEST_SWEEP else 0.0
        return cls(used, angles, index, stamp, odometry, sweep)

    @property
    def hits(self) -> BoolArray:
        """(n,) which beams came back."""
        return np.isfinite(self.ranges)

    @property
    def points(self) -> FloatArray:
        """(n, 2) where each beam ended [m], NaN where nothing came back."""
        bearing = np.column_stack([np.cos(self.angles), np.sin(self.angles)])
        points: FloatArray = self.ranges[:, None] * bearing
        return points


def check_beams(scan: Scan) -> Scan:
    """Return `scan`; ArgumentError if it has fewer than `MIN_BEAMS` beams."""
    if len(scan.ranges) < MIN_BEAMS:
        raise ArgumentError("ranges", f"expected {MIN_BEAMS} beams or more, got {len(scan.ranges)}")
    return scan


def _span(range_min: float, range_max: float) -> tuple[float, float]:
    """Return between which distances [m] something came back; ArgumentError if between none."""
    low = as_number("range_min", range_min, "expected a distance [m]")
    high = as_number("range_max", range_max, "expected a distance [m]")
    low, high = low if low > 0 else 0.0, high if high > 0 else math.inf
    if low >= high:
        raise ArgumentError("range_max", f"expected more than range_min, {low:g} m, got {high:g} m")
    return low, high


def _of_one_length(ranges: ArrayLike, angles: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return both as (n,) arrays; ArgumentError if they are not."""
    measured = as_numbers("ranges", ranges, "expected (n,) distances [m]")
    directions = as_numbers("angles", angles, "expected (n,) directions [rad]")
    if measured.ndim != 1:
        raise ArgumentError("ranges", f"expected (n,) distances [m], got shape {measured.shape}")
    if directions.shape != measured.shape:
        raise ArgumentError(
            "angles", f"expected ({len(measured)},), one a range, got shape {directions.shape}"
        )
    return measured, directions


def _ascending(ranges: FloatArray, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return both in counter-clockwise order, if they were clockwise."""
    clockwise = len(angles) > 1 and angles[0] > angles[-1]
    return (ranges[::-1], angles[::-1]) if clockwise else (ranges, angles)


def _check_directions(angles: FloatArray) -> None:
    """Raise ArgumentError unless `angles` (n,) [rad] ascend within a turn."""
    if len(angles) < 2:
        if not np.isfinite(angles).all():
            raise ArgumentError("angles", "expected finite directions [rad], got NaN or infinity")
        return
    span = float(angles[-1] - angles[0])
    if not ((angles[1:] > angles[:-1]).all() and math.isfinite(span)):  # nor where one is NaN
        _refuse_directions(angles)
    # A turn of beams whose stated increment was rounded may end up to a beam late.
    if not span <= _TURN + span / (len(angles) - 1) * (1 + 1e-6):
        raise ArgumentError(
            "angles", f"expected one turn at the most, 2 pi, got {span:.4f} rad from end to end"
        )


def _refuse_directions(angles: FloatArray) -> None:
    """Raise ArgumentError that says why `angles` (n,) do not ascend."""
    if not np.isfinite(angles).all():
        first = int(np.flatnonzero(~np.isfinite(angles))[0])
        raise ArgumentError(
            "angles", f"expected finite directions [rad], got {angles[first]} for beam {first}"
        )
    raise ArgumentError(
        "angles",
        "expected directions [rad] that ascend from beam to beam, or descend, and do not jump at"
        " half a turn",
    )


def _angle(argument: str, value: float) -> float:
    """Return `value` [rad]; ArgumentError if it is no finite angle."""
    angle = as_number(argument, value, "expected a finite angle [rad]")
    if not math.isfinite(angle):
        raise ArgumentError(argument, f"expected a finite angle [rad], got {value}")
    return angle


def _index(value: int) -> int:
    """Return `value`; ArgumentError if it numbers no scan."""
    try:
        index = operator.index(value)
    except TypeError:
        index = UNNUMBERED - 1
    if not UNNUMBERED <= index <= _LAST_INDEX:
        raise ArgumentError(
            "index", f"expected a whole number from 0, or {UNNUMBERED} for none, got {value!r}"
        )
    return index


def _stamp(value: float) -> float:
    """Return `value` [s], NaN where it tells no time; ArgumentError if it is no number."""
    stamp = as_numbers("stamp", value, "expected a time [s]")
    if stamp.ndim:
        raise ArgumentError("stamp", f"expected a time [s], got {value!r}")
    return float(stamp) if abs(stamp) <= MAX_STAMP else math.nan  # False for NaN


def _sweep(value: float) -> float:
    """Return it; ArgumentError if it is not finite."""
    if not math.isfinite(value):
        raise ArgumentError("sweep", f"expected a time [s], got {value}")
    return float(value)


def _pose(argument: str, value: ArrayLike) -> FloatArray:
    """Return (3,) `value`; ArgumentError if it is no pose."""
    pose = as_numbers(argument, value, "expected (3,) x, y, theta [m, m, rad]")
    if pose.shape != (3,) or not np.isfinite(pose).all():
        raise ArgumentError(argument, f"expected (3,) finite x, y, theta [m, m, rad], got {pose}")
    return pose


def _owned(values: FloatArray) -> FloatArray:
    """Return `values` that nobody else writes to: themselves where nobody can."""
    return _read_only(values.copy()) if values.flags.writeable else values


def _read_only(values: FloatArray) -> FloatArray:
    values.setflags(write=False)
    return values
