"""The rows of an SQLite file that was cut off, page by page, without the trees above.

SQLite refuses such a file, and its trees may begin in pages that are missing. The format is
documented and frozen: https://www.sqlite.org/fileformat2.html, sections 1.6 and 2.1.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, TypeAlias

Value: TypeAlias = int | float | str | bytes | None

_FILE_HEADER = 100  # bytes, at the beginning of the first page
_LEAF = 0x0D
_LEAF_HEAD = 8
_PAGE_NUMBER = struct.Struct(">I")
_CELLS = struct.Struct(">H")
_INT_SIZES = (0, 1, 2, 3, 4, 6, 8)
_FLOAT = struct.Struct(">d")


class _MissingError(Exception):
    """A row that continues in a page that is not there."""


def table_rows(path: Path) -> Iterator[tuple[int, list[Value]]]:
    """Yield the number and the values of every whole row, of whichever table, in file order."""
    with path.open("rb") as file:
        pages = _Pages.of(file)
        for number in range(1, pages.count + 1):
            yield from _leaf_rows(pages, number)


@dataclass(frozen=True, slots=True)
class _Pages:
    """The pages of a file, counted from 1; the last one may be cut off.

    Attributes
    ----------
    usable
        Bytes of a page that hold content.
    """

    file: BinaryIO
    size: int
    usable: int
    count: int

    @classmethod
    def of(cls, file: BinaryIO) -> "_Pages":
        head = file.read(_FILE_HEADER).ljust(_FILE_HEADER, b"\0")
        (stated,) = _CELLS.unpack_from(head, 16)
        size = 65536 if stated == 1 else max(512, stated)
        return cls(file, size, size - head[20], -(-file.seek(0, 2) // size))

    def read(self, number: int) -> bytes:
        if not 1 <= number <= self.count:
            raise _MissingError
        self.file.seek((number - 1) * self.size)
        return self.file.read(self.size)


def _leaf_rows(pages: _Pages, number: int) -> Iterator[tuple[int, list[Value]]]:
    page = pages.read(number)
    start = _FILE_HEADER if number == 1 else 0
    if len(page) < start + _LEAF_HEAD or page[start] != _LEAF:
        return
    (cells,) = _CELLS.unpack_from(page, start + 3)
    for cell in range(min(cells, pages.usable // 2 - _LEAF_HEAD)):
        try:
            (place,) = _CELLS.unpack_from(page, start + _LEAF_HEAD + 2 * cell)
            row, payload = _cell(pages, page, place)
            yield row, _values(payload)
        except (_MissingError, IndexError, struct.error, UnicodeDecodeError):
            continue  # cut off, or no row at all: the page only looks like one of a table


def _cell(pages: _Pages, page: bytes, place: int) -> tuple[int, bytes]:
    """Return a row's number and its content, from the page and those that it continues in."""
    size, place = _varint(page, place)
    row, place = _varint(page, place)
    local = _local(size, pages.usable)
    content = [page[place : place + local]]
    (following,) = _PAGE_NUMBER.unpack_from(page, place + local) if local < size else (0,)
    left = size - local
    while left > 0:
        overflow = pages.read(following)
        (following,) = _PAGE_NUMBER.unpack_from(overflow)
        content.append(overflow[_PAGE_NUMBER.size :][: min(left, pages.usable - 4)])
        left -= pages.usable - 4
    return row, b"".join(content)


def _local(size: int, usable: int) -> int:
    """Return how many bytes of a row of `size` are in its own page (section 1.6)."""
    most, least = usable - 35, (usable - 12) * 32 // 255 - 23
    if size <= most:
        return size
    fitting = least + (size - least) % (usable - 4)
    return fitting if fitting <= most else least


def _varint(content: bytes, place: int) -> tuple[int, int]:
    """Return the number of one to nine bytes at `place`, and where it ends."""
    value = 0
    for index in range(8):
        byte = content[place + index]
        value = value << 7 | byte & 0x7F
        if byte < 0x80:
            return value, place + index + 1
    return value << 8 | content[place + 8], place + 9


def _values(record: bytes) -> list[Value]:
    """Return the values of a row (section 2.1)."""
    end, place = _varint(record, 0)
    kinds = []
    while place < end:
        kind, place = _varint(record, place)
        kinds.append(kind)
    values: list[Value] = []
    for kind in kinds:
        size = _size(kind)
        if place + size > len(record):
            raise _MissingError
        values.append(_value(kind, record[place : place + size]))
        place += size
    return values


def _size(kind: int) -> int:
    if kind < len(_INT_SIZES):
        return _INT_SIZES[kind]
    return _FLOAT.size if kind == 7 else max(0, kind - 12) // 2


def _value(kind: int, content: bytes) -> Value:
    match kind:
        case 0:
            return None
        case 7:
            return float(_FLOAT.unpack(content)[0])
        case 8 | 9:
            return kind - 8
        case _ if kind < len(_INT_SIZES):
            return int.from_bytes(content, "big", signed=True)
        case _:
            return content.decode() if kind % 2 else content
