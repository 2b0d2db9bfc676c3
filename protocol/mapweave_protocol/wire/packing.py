"""Numbers as bytes: quantised, as differences from row to row, little-endian.

Quantising is idempotent: packing what was unpacked gives the same bytes. Differences of what lies
side by side are small, which is what makes the compression of a message pay.
"""

import numpy as np
from numpy.typing import ArrayLike

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray

PER_METRE = 1e3  # millimetres: a tenth of what a laser resolves
PER_RADIAN = 1e6  # microradians: 0.1 mm at 100 m
PER_SECOND = 1e4  # exact in a double until the year 9000
HALF_TURN = 3141592  # the largest angle that, unpacked, still lies in (-pi, pi]
MAX_STAMP = 1e11  # [s]; an overflown clock says nothing
UNKNOWN_STAMP = -(2**62)
WIDTHS = (1, 2, 4, 8)


def pack_integers(values: IntArray) -> bytes:
    """Return ``(n, k)`` integers as one byte that tells the width, then the differences.

    The differences wrap around at the width of the values, so that they never need more.
    """
    width = _width(values)
    narrow = values.astype(f"<i{width}")
    differences = np.diff(narrow, axis=0, prepend=np.zeros_like(narrow[:1]))
    return bytes([width]) + differences.tobytes()


def unpack_integers(data: bytes, columns: int, limit: int) -> IntArray:
    """Return the ``(n, columns)`` integers of `data`.

    Raises
    ------
    ValueError
        If the length does not fit, or n is more than `limit`.
    """
    width = data[0] if data else 0
    if width not in WIDTHS:
        raise ValueError(f"width of integers {width}, expected 1, 2, 4 or 8")
    rows, rest = divmod(len(data) - 1, width * columns)
    if rest or rows > limit:
        raise ValueError(f"{len(data)} bytes, expected at most {limit} whole rows of {columns}")
    differences = np.frombuffer(data, dtype=f"<i{width}", offset=1, count=rows * columns)
    values = np.cumsum(differences.reshape(rows, columns), axis=0, dtype=f"<i{width}")
    return values.astype(np.int64)


def _width(values: IntArray) -> int:
    extreme = max(int(values.max()), -int(values.min()) - 1) if values.size else 0
    return next(width for width in WIDTHS if extreme < 1 << (8 * width - 1))


def quantise(values: ArrayLike, per_unit: float, limit: float) -> IntArray:
    """Return `values` as whole numbers, `per_unit` to one.

    Raises
    ------
    ValueError
        If one is not finite or its magnitude exceeds `limit`.
    """
    array = np.asarray(values, dtype=float)
    # Written so that NaN fails as well.
    if not np.all(np.abs(array) <= limit):
        raise ValueError(f"expected finite numbers of at most {limit:g}")
    return np.rint(array * per_unit).astype(np.int64)


def unquantise(values: IntArray, per_unit: float, limit: float) -> FloatArray:
    """Return whole `values` divided by `per_unit`.

    Raises
    ------
    ValueError
        If a magnitude exceeds `limit`.
    """
    scaled = values / per_unit
    if not np.all(np.abs(scaled) <= limit):
        raise ValueError(f"expected numbers of at most {limit:g}")
    return scaled


def quantise_poses(poses: ArrayLike, reach: float) -> IntArray:
    """Return ``(n, 3)`` poses [m, m, rad] as whole millimetres and microradians.

    Raises
    ------
    ValueError
        If one is not finite or further out than `reach` [m].
    """
    array = np.asarray(poses, dtype=float).reshape(-1, 3)
    places = quantise(array[:, :2], PER_METRE, reach)
    angles = quantise(se2.wrap(array[:, 2:]), PER_RADIAN, np.pi)
    return np.hstack([places, np.clip(angles, -HALF_TURN, HALF_TURN)])


def unquantise_poses(values: IntArray, reach: float) -> FloatArray:
    """Return the ``(n, 3)`` poses [m, m, rad] of what `quantise_poses` gave.

    Raises
    ------
    ValueError
        If one is further out than `reach` [m], or an angle is outside (-pi, pi].
    """
    places = unquantise(values[:, :2], PER_METRE, reach)
    return np.hstack([places, unquantise(values[:, 2:], PER_RADIAN, np.pi)])


def quantise_stamps(stamps: FloatArray) -> IntArray:
    """Return ``(n,)`` stamps [s] in ticks; NaN, and what no clock says, as `UNKNOWN_STAMP`."""
    known = np.abs(stamps) <= MAX_STAMP
    ticks = np.rint(np.where(known, stamps, 0.0) * PER_SECOND).astype(np.int64)
    return np.where(known, ticks, UNKNOWN_STAMP)


def unquantise_stamps(ticks: IntArray) -> FloatArray:
    """Return the ``(n,)`` stamps [s], NaN where unknown."""
    stamps = ticks / PER_SECOND
    return np.where(np.abs(stamps) <= MAX_STAMP, stamps, np.nan)
