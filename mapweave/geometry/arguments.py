"""Arguments as a caller gives them: lists as well, vertices as well; what is none is refused.

Public functions take their arguments through these; functions of one room among themselves need
not.
"""

from collections.abc import Iterable
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from mapweave.errors import ArgumentError
from mapweave.geometry.arrays import FloatArray

FARTHEST = 1e9  # [m] a coordinate may be: no building is there, and its square is still a number

_SEGMENTS = "expected (n, 4) segments x1 y1 x2 y2 or (n, 2) vertices [m]"
_NUMBERS = "biufO"  # kinds of arrays; single objects are asked whether they are numbers

T = TypeVar("T")


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
        If it has another shape, or holds anything that is no finite number up to `FARTHEST`.
    """
    given = as_numbers(argument, value, _SEGMENTS)
    if given.ndim == 1 and not given.size:
        return np.empty((0, 4))
    if given.ndim != 2 or given.shape[1] not in (2, 4):
        raise ArgumentError(argument, f"{_SEGMENTS}, got shape {given.shape}")
    if not np.isfinite(given).all():
        raise ArgumentError(argument, "expected finite coordinates [m], got NaN or infinity")
    if given.size and np.abs(given).max() > FARTHEST:
        far = np.abs(given).max()
        raise ArgumentError(argument, f"expected coordinates within {FARTHEST:g} m, got {far:g}")
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
    """Return `value` as an array of floats; what a mask hides is NaN.

    Raises
    ------
    ArgumentError
        With what was `expected`, if it is no array of real numbers: a text, a date, or rows of
        unequal lengths.
    """
    try:
        given = np.asanyarray(value)
        if isinstance(given, np.ma.MaskedArray) and given.dtype.kind in _NUMBERS:
            given = np.ma.filled(given.astype(np.float64), np.nan)
        # What is cast by force is none: a complex number is not its real part, a date no length.
        numbers = np.asarray(given, dtype=np.float64) if given.dtype.kind in _NUMBERS else None
    except (TypeError, OverflowError, ValueError) as error:
        raise ArgumentError(argument, f"{expected}, got {type(value).__name__}: {error}") from error
    if numbers is None:
        raise ArgumentError(
            argument, f"{expected}, got {type(value).__name__} of type {given.dtype}"
        )
    return numbers


def as_number(argument: str, value: ArrayLike, expected: str) -> float:
    """Return `value` as one number, which may be infinite, but not NaN.

    Raises
    ------
    ArgumentError
        With what was `expected`, if it is none.
    """
    given = as_numbers(argument, value, expected)
    if given.ndim or np.isnan(given):
        raise ArgumentError(argument, f"{expected}, got {value!r}")
    return float(given)


def as_positive(argument: str, value: float, unit: str) -> float:
    """Return `value`, finite and above zero.

    Raises
    ------
    ArgumentError
        If it is not.
    """
    given = as_number(argument, value, f"expected more than 0 {unit}")
    if not 0 < given < np.inf:
        raise ArgumentError(argument, f"expected more than 0 {unit}, got {value}")
    return given


def check_kind(argument: str, value: object, *kinds: type) -> None:
    """Raise ArgumentError unless `value` is of one of the `kinds`."""
    if not isinstance(value, kinds):
        names = " or ".join(kind.__name__ for kind in kinds)
        raise ArgumentError(argument, f"expected {names}, got {type(value).__name__}")


def as_list(argument: str, values: Iterable[T], kind: type[T]) -> list[T]:
    """Return `values` as a list, also those that can be gone through only once.

    Raises
    ------
    ArgumentError
        If one of them is not of `kind`, or they are none that can be gone through.
    """
    try:
        each_once = iter(values)
    except TypeError as error:
        found = type(values).__name__
        raise ArgumentError(argument, f"expected a list of {kind.__name__}, got {found}") from error
    given = list(each_once)
    for value in given:
        check_kind(argument, value, kind)
    return given
