"""Whole numbers as few bytes: an adaptive binary range coder, and its decoder.

A number is a string of binary decisions, each with a context of its own in which the coder counts
how often either came out: what is usual costs a fraction of a bit. Both ends count alike, from
what they begin with, so no table travels. Encoder and decoder are walked through the same code: a
function that codes a thing takes the thing from an encoder's caller, and from a decoder gives it
back. A context names either decisions or numbers, not both.
"""

from abc import ABC, abstractmethod
from collections.abc import Hashable, Mapping
from copy import copy
from typing import Protocol, Self, TypeAlias, cast

from mapweave.kernels.loading import COMPILED

MAX_BITS = 62  # of a number's magnitude
MOST_COUNTED = 500  # of one context, then both counts are halved: what is usual may change
NUMBERS_OF_A_BYTE = 8  # at most: bounds what few bytes unfold into; maps have two
NUMBERS_OF_NONE = 1000
_TOP = 1 << 24
_MASK = 0xFFFFFFFF
_PRECISION = 15  # bits of a probability
_FLUSHED = 5  # bytes

Beginning: TypeAlias = Mapping[str, tuple[int, int]]


class Coder(Protocol):
    """What encoder and decoder offer, compiled or not."""

    @property
    def numbers(self) -> int:
        """How many numbers have passed."""

    def bit(self, context: Hashable, value: int = 0) -> int:
        """Code a decision, 0 or 1, of a kind that is named by `context`."""

    def even(self, value: int = 0) -> int:
        """Code a bit that is as likely 0 as 1."""

    def unsigned(self, context: Hashable, value: int = 0) -> int:
        """Code a number of 0 or more, its length first (an exponential Golomb code).

        Raises
        ------
        ValueError
            If it is longer than `MAX_BITS`, or there are too many.
        """

    def signed(self, context: Hashable, value: int = 0) -> int:
        """Code a number of either sign; errors as of `unsigned`."""

    def count(self, context: Hashable, limit: int, value: int = 0) -> int:
        """Code how many of something follow.

        Raises
        ------
        ValueError
            If there are more than `limit`.
        """


class Encoder(Coder, Protocol):
    """Turns numbers into bytes; a decoder, a plain `Coder`, turns bytes into numbers."""

    def finish(self) -> bytes:
        """Return the bytes; nothing may be coded after.

        Zeros at the end are left off, as a decoder adds them, but for those that allow for the
        number of numbers.
        """

    def copy(self) -> Self:
        """Return an encoder that goes on from here, as this one may as well."""


def make_encoder(beginning: Beginning, limit: int) -> Encoder:
    """Return an encoder of at most `limit` numbers.

    Parameters
    ----------
    beginning
        By name of a decision, as of `name_of`, the counts of 0 and 1 with which it begins; of
        others 1 and 1.
    """
    made = PythonEncoder if COMPILED is None else COMPILED.RangeEncoder
    return cast("Encoder", made(beginning, limit))


def make_decoder(data: bytes, beginning: Beginning, limit: int) -> Coder:
    """Return a decoder; what is not from an encoder gives other numbers, or an error.

    It gives at most `limit` numbers, and at most so many as its bytes may stand for.
    """
    allowed = min(limit, NUMBERS_OF_NONE + NUMBERS_OF_A_BYTE * len(data))
    made = PythonDecoder if COMPILED is None else COMPILED.RangeDecoder
    return cast("Coder", made(data, beginning, allowed))


class PythonCoder(ABC):
    """What the twins of the compiled classes have in common; see `Coder`."""

    def __init__(self, beginning: Beginning) -> None:
        self.numbers = 0
        self._beginning = beginning
        self._range = _MASK
        self._counts: dict[Hashable, list[int]] = {}

    @abstractmethod
    def bit(self, context: Hashable, value: int = 0) -> int:
        """See `Coder`."""

    @abstractmethod
    def even(self, value: int = 0) -> int:
        """See `Coder`."""

    @abstractmethod
    def _spend(self) -> None:
        """Check that there may be another number."""

    def unsigned(self, context: Hashable, value: int = 0) -> int:
        """See `Coder`."""
        self._spend()
        wanted, bits = value + 1, 0
        while self.bit((context, bits), int(wanted >> (bits + 1) > 0)):
            bits += 1
            if bits > MAX_BITS:
                raise ValueError(f"a number of more than {MAX_BITS} bits")
        found = 1
        for place in range(bits - 1, -1, -1):
            digit = wanted >> place & 1
            leading = place == bits - 1
            found = 2 * found + (
                self.bit((context, bits, 1), digit) if leading else self.even(digit)
            )
        return found - 1

    def signed(self, context: Hashable, value: int = 0) -> int:
        """See `Coder`."""
        magnitude = self.unsigned(context, abs(value))
        negative = magnitude and self.bit((context, "sign"), int(value < 0))
        return -magnitude if negative else magnitude

    def count(self, context: Hashable, limit: int, value: int = 0) -> int:
        """See `Coder`."""
        found = self.unsigned(context, value)
        if found > limit:
            raise ValueError(f"{found} in a row, expected at most {limit}")
        return found

    def _counted(self, context: Hashable) -> list[int]:
        counts = self._counts.get(context)
        if counts is None:
            counts = self._counts[context] = list(self._beginning.get(name_of(context), (1, 1)))
        return counts

    def _split(self, counts: list[int]) -> int:
        """Return the part of the range that means 1."""
        share = max(1, (counts[1] << _PRECISION) // (counts[0] + counts[1]))
        return (self._range >> _PRECISION) * share


class PythonEncoder(PythonCoder):
    """The twin of the compiled class; see `Encoder`."""

    def __init__(self, beginning: Beginning, limit: int) -> None:
        super().__init__(beginning)
        self._limit = limit
        self._low = 0
        self._held: int | None = None  # a byte that a carry may still change
        self._pending = 0  # bytes of 255 after it
        self._bytes = bytearray()

    def bit(self, context: Hashable, value: int = 0) -> int:
        """See `Coder`."""
        counts = self._counted(context)
        part = self._split(counts)
        if value:
            self._range = part
        else:
            self._low += part
            self._range -= part
        _learn(counts, value)
        self._renormalise()
        return value

    def even(self, value: int = 0) -> int:
        """See `Coder`."""
        self._range >>= 1
        if value:
            self._low += self._range
        self._renormalise()
        return value

    def finish(self) -> bytes:
        """See `Encoder`."""
        # Of the numbers that mean the same, the one that ends in most zeros.
        self._low = (self._low + _TOP - 1) & -_TOP
        for _ in range(_FLUSHED):
            self._shift()
        payload = bytes(self._bytes).rstrip(b"\0")
        least = -((NUMBERS_OF_NONE - self.numbers) // NUMBERS_OF_A_BYTE)
        return payload.ljust(least, b"\0") if least > 0 else payload

    def copy(self) -> Self:
        """See `Encoder`."""
        other = copy(self)
        other._counts = {context: counts.copy() for context, counts in self._counts.items()}
        other._bytes = self._bytes.copy()
        return other

    def _spend(self) -> None:
        self.numbers += 1
        if self.numbers > self._limit:
            raise ValueError(f"more than {self._limit} numbers")

    def _renormalise(self) -> None:
        while self._range < _TOP:
            self._range = self._range << 8 & _MASK
            self._shift()

    def _shift(self) -> None:
        """Move the uppermost byte out, or keep it while a carry may still come."""
        carry, upper = self._low >> 32, self._low >> 24 & 0xFF
        if carry or upper < 0xFF:
            if self._held is not None:
                self._bytes.append(self._held + carry & 0xFF)
            self._bytes.extend([0xFF + carry & 0xFF] * self._pending)
            self._held, self._pending = upper, 0
        else:
            self._pending += 1
        self._low = self._low << 8 & _MASK


class PythonDecoder(PythonCoder):
    """The twin of the compiled class; see `Coder`."""

    def __init__(self, data: bytes, beginning: Beginning, allowed: int) -> None:
        super().__init__(beginning)
        self._data = data
        self._allowed = allowed
        self._at = 4
        self._code = int.from_bytes(data[:4].ljust(4, b"\0"), "big")

    def bit(self, context: Hashable, value: int = 0) -> int:
        """See `Coder`; `value` means nothing."""
        counts = self._counted(context)
        part = self._split(counts)
        value = int(self._code < part)
        if value:
            self._range = part
        else:
            self._code -= part
            self._range -= part
        _learn(counts, value)
        self._renormalise()
        return value

    def even(self, value: int = 0) -> int:
        """See `Coder`; `value` means nothing."""
        self._range >>= 1
        value = int(self._code >= self._range)
        if value:
            self._code -= self._range
        self._renormalise()
        return value

    def _spend(self) -> None:
        self.numbers += 1
        if self.numbers > self._allowed:
            raise ValueError(f"more than {self._allowed} numbers in {len(self._data)} bytes")

    def _renormalise(self) -> None:
        while self._range < _TOP:
            self._range = self._range << 8 & _MASK
            following = self._data[self._at] if self._at < len(self._data) else 0
            self._code = (self._code << 8 | following) & _MASK
            self._at += 1


def name_of(context: Hashable) -> str:
    """Return the parts of a context in a row, such as ``aside 1 0 3``."""
    if isinstance(context, tuple):
        return " ".join(name_of(part) for part in context)
    return context if isinstance(context, str) else str(int(context))  # type: ignore[call-overload]


def _learn(counts: list[int], value: int) -> None:
    counts[value] += 2
    if counts[0] + counts[1] > MOST_COUNTED:
        counts[:] = (counts[0] + 1) >> 1, (counts[1] + 1) >> 1
