"""The bytes of a log, whichever way it is packed: plain, gzip or zip, told by its first bytes.

The streams are inflated here rather than by :mod:`gzip` and :mod:`zipfile`, because a recording
that was cut off must give all it holds: those modules need the end of the file.
"""

import struct
import zipfile
import zlib
from collections.abc import Generator, Iterator
from typing import BinaryIO

BLOCK = 1 << 16
"""Bytes read or inflated at a time: bounds the memory, also for a hostile archive."""

_GZIP = b"\x1f\x8b"
_ZIP = b"PK\x03\x04"
_GZIP_WINDOW = zlib.MAX_WBITS | 16
_RAW_WINDOW = -zlib.MAX_WBITS
_ZIP_HEADER = struct.Struct("<4s2xHH8xL4xHH")
_STORED, _DEFLATED = 0, 8
_ENCRYPTED = 1


class DamagedStreamError(Exception):
    """A compressed stream that is cut off or damaged; what came before it was yielded."""


class UnusableArchiveError(Exception):
    """An archive from which no log can be read."""


def read_blocks(file: BinaryIO) -> Iterator[bytes]:
    """Yield the bytes of the log in `file`, unpacked, in bounded blocks.

    Raises
    ------
    DamagedStreamError
        After the last good block, where a compressed stream is cut off or damaged.
    UnusableArchiveError
        For an empty, encrypted or otherwise compressed zip archive.
    """
    head = file.read(BLOCK)
    if head.startswith(_GZIP):
        return _gunzip(file, head)
    if head.startswith(_ZIP):
        return _unzip(file)
    return _plain(file, head)


def _plain(file: BinaryIO, block: bytes) -> Iterator[bytes]:
    while block:
        yield block
        block = file.read(BLOCK)


def _gunzip(file: BinaryIO, block: bytes) -> Iterator[bytes]:
    # A gzip file may hold several streams, one after the other (RFC 1952, 2.2).
    while block.startswith(_GZIP):
        rest = yield from _inflate(file, block, _GZIP_WINDOW, "gzip")
        block = rest or file.read(BLOCK)


def _unzip(file: BinaryIO) -> Iterator[bytes]:
    file.seek(_log_offset(file))
    header = file.read(_ZIP_HEADER.size)
    if len(header) < _ZIP_HEADER.size:
        raise DamagedStreamError("the zip archive is cut off")
    _, flags, method, size, name_length, extra_length = _ZIP_HEADER.unpack(header)
    if flags & _ENCRYPTED or method not in (_STORED, _DEFLATED):
        raise UnusableArchiveError("is a zip archive that is encrypted or not deflated")
    file.seek(name_length + extra_length, 1)
    if method == _DEFLATED:
        yield from _inflate(file, file.read(BLOCK), _RAW_WINDOW, "zip")
    else:
        yield from _stored(file, size)


def _log_offset(file: BinaryIO) -> int:
    """Return where the largest member starts: the log, not a note that came along with it."""
    try:
        with zipfile.ZipFile(file) as archive:
            members = [member for member in archive.infolist() if not member.is_dir()]
    except zipfile.BadZipFile:
        return 0  # The list of members is at the end: cut off, so take the first.
    if not members:
        raise UnusableArchiveError("is an empty zip archive")
    return max(members, key=lambda member: member.file_size).header_offset


def _stored(file: BinaryIO, size: int) -> Iterator[bytes]:
    while size:
        block = file.read(min(size, BLOCK))
        if not block:
            raise DamagedStreamError("the zip archive is cut off")
        size -= len(block)
        yield block


def _inflate(file: BinaryIO, block: bytes, window: int, kind: str) -> Generator[bytes, None, bytes]:
    """Yield what a deflated stream holds that starts with `block`; return what follows it."""
    decoder = zlib.decompressobj(window)
    while not decoder.eof:
        if not block:
            yield decoder.flush()
            raise DamagedStreamError(f"the {kind} stream is cut off")
        try:
            inflated = decoder.decompress(block, BLOCK)
        except zlib.error as error:
            raise DamagedStreamError(f"the {kind} stream is damaged ({error})") from error
        yield inflated
        block = decoder.unconsumed_tail or file.read(BLOCK)
    return decoder.unused_data + block
