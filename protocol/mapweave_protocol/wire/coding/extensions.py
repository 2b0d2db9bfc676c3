"""Numbers of few digits and names of runs as msgpack extensions: shorter than floats and text."""

import re
from decimal import Decimal
from functools import lru_cache

import msgpack

REMEMBERED = 2**14  # numbers, of some 100 bytes
_MAX_EXPONENT = 40
_BOOT = 100  # the type of an extension that is 8 hexadecimal digits, such as name runs
_HEXADECIMAL = re.compile(r"[0-9a-f]{8}")


class Extended(tuple[object, ...]):
    """Values that `extended` has been through: what travels again and again goes through once."""

    __slots__ = ()


def extended(value: object) -> object:
    """Return `value` with floats of few digits as extensions: the exponent, and the digits.

    So is a string of 8 hexadecimal digits.
    """
    if isinstance(value, float):  # most of what a message holds
        return _decimal(value)
    if isinstance(value, tuple):
        if isinstance(value, Extended):
            return value
        return tuple([extended(item) for item in value])
    if isinstance(value, dict):
        return {key: extended(item) for key, item in value.items()}
    if isinstance(value, str) and _HEXADECIMAL.fullmatch(value):
        return msgpack.ExtType(_BOOT, bytes.fromhex(value))
    return value


def unextended(code: int, data: bytes) -> float | str:
    """Return what an extension of msgpack stands for.

    Raises
    ------
    ValueError
        If it is none of ours.
    """
    if code == _BOOT and len(data) == 4:
        return data.hex()
    if not 0 <= code <= 2 * _MAX_EXPONENT:
        raise ValueError("an extension that is no number")
    return float(f"{int.from_bytes(data, 'little', signed=True)}e{code - _MAX_EXPONENT}")


@lru_cache(maxsize=REMEMBERED)  # most numbers of a version were in the one before
def _decimal(value: float) -> object:
    sign, digits, exponent = Decimal(repr(value)).as_tuple()
    if not isinstance(exponent, int) or not -_MAX_EXPONENT <= exponent <= _MAX_EXPONENT:
        return value
    number = int("".join(map(str, digits))) * (-1 if sign else 1)
    size = next((n for n in (1, 2, 4) if -(1 << 8 * n - 1) <= number < 1 << 8 * n - 1), 0)
    if not size or not number:
        return value
    return msgpack.ExtType(exponent + _MAX_EXPONENT, number.to_bytes(size, "little", signed=True))
