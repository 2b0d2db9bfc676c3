"""Arrays as a caller gives them: lists as well, vertices as well; what is no such thing is refused.

Public functions take their arguments through these; functions of one room among themselves need
not.
"""

import numpy as np
from numpy.typing import ArrayLike

from mapweave.errors import ArgumentError
from mapweave.geometry.arrays import FloatArray

_SEGMENTS = "expected (n, 4) segments x1 y1 x2 y2 or (n, 2) vertices [m]"


def as_segments(argument: str, value: ArrayLike) -> FloatArray:
    """Return `value`, segments or the vertices of one polyline, as (n, 4) segments x1 y1 x2 y2 [m].

    Parameters
    ----------
    argument
        Its name, for the message.
    value
        (n, 4) segments; or (n, 2) vertices, which are n - 1 segments from each to the next.
        Nothing at all, as in ``[]``, is no segments.

    Raises
    ------
    ArgumentError
        If it has another shape, or holds anything that is no finite number.
    """
    given = as_numbers(argument, value, _SEGMENTS)
    if given.ndim == 1 and not given.size:
        return np.empty((0, 4))
    if given.ndim != 2 or given.shape[1] not in (2, 4):
        raise ArgumentError(argument, f"{_SEGMENTS}, got shape {given.shape}")
    if not np.isfinite(given).all():
        raise ArgumentError(argument, "expected finite coordinates [m], got NaN or infinity")
    if given.shape[1] == 4:
        return given
    if len(given) == 1:
        raise ArgumentError(argument, "expected two vertices or more, got one")
    return np.hstack([given[:-1], given[1:]])


def as_values(argument: str, value: ArrayLike, count: int, of: str) -> FloatArray:
    """Return `value` as (count,) finite numbers, one for each `of`.

    Raises
    ------
    ArgumentError
        If it has another shape, or holds anything that is no finite number.
    """
    given = as_numbers(argument, value, f"expected ({count},) numbers, one for each {of}")
    if given.shape != (count,):
        raise ArgumentError(
            argument, f"expected ({count},) numbers, one for each {of}, got shape {given.shape}"
        )
    if not np.isfinite(given).all():
        raise ArgumentError(argument, "expected finite numbers, got NaN or infinity")
    return given


def as_numbers(argument: str, value: ArrayLike, expected: str) -> FloatArray:
    """Return `value` as an array of floats.

    Raises
    ------
    ArgumentError
        With what was `expected`, if it is no array of numbers: a text, or rows of unequal lengths.
    """
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ArgumentError(argument, f"{expected}, got {type(value).__name__}: {error}") from error


def as_positive(argument: str, value: float, unit: str) -> float:
    """Return `value`, finite and above zero.

    Raises
    ------
    ArgumentError
        If it is not.
    """
    if not 0 < value < np.inf:
        raise ArgumentError(argument, f"expected more than 0 {unit}, got {value}")
    return float(value)
