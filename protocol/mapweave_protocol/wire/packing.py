"""Numbers quantised: lengths, angles and stamps as whole numbers of small steps, and back.

Quantising is idempotent: packing what was unpacked gives the same numbers.
"""

import numpy as np
from numpy.typing import ArrayLike

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray

PER_METRE = 1e3  # of the poses of submaps: what they hold moves along
PER_RADIAN = 1e5  # 0.2 mm at 20 m
HALF_TURN = 314159  # the largest angle that, unpacked, still lies in (-pi, pi]
MAX_WHOLE = 2**53


def whole_numbers(values: ArrayLike) -> IntArray:
    """Return `values` as an array.

    Raises
    ------
    ValueError
        If one is larger than a double holds exactly.
    """
    try:
        array = np.asarray(values, dtype=np.int64)
    except OverflowError:
        array = None
    if array is None or np.any(np.abs(array) > MAX_WHOLE):
        raise ValueError(f"whole numbers, expected at most {MAX_WHOLE}")
    return array


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
    """Return ``(n, 3)`` poses [m, m, rad] in steps of 1 mm and 1e-5 rad.

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
