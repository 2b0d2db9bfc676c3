"""The lines of a log, numbered, each of bounded length."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from mapweave.io.readers.streams import DamagedStreamError

MAX_LINE = 1 << 18
"""Bytes; a sweep of 4096 beams takes a tenth of it, and a hostile file no more."""


@dataclass(frozen=True, slots=True)
class Line:
    """A line of a log.

    Attributes
    ----------
    number
        From 1, as editors count.
    text
        Without its line break; at most `MAX_LINE` bytes and one.
    damage
        Why it cannot be whole, whatever it says; None where nothing is known against it.
    """

    number: int
    text: bytes
    damage: str | None = None


def split_lines(blocks: Iterable[bytes]) -> Iterator[Line]:
    """Yield the lines of `blocks`; the last one carries the damage of a stream that was cut off."""
    number, rest, damage = 0, b"", None
    try:
        for block in blocks:
            *whole, rest = (rest + block).split(b"\n")
            for text in whole:
                number += 1
                yield _line(number, text)
            rest = rest[: MAX_LINE + 1]
    except DamagedStreamError as error:
        damage = str(error)
    if damage:
        yield Line(number + 1, rest, damage)
    elif rest:
        yield _line(number + 1, rest)


def _line(number: int, text: bytes) -> Line:
    if len(text) > MAX_LINE:
        return Line(number, text[: MAX_LINE + 1], f"longer than {MAX_LINE} bytes")
    return Line(number, text)
