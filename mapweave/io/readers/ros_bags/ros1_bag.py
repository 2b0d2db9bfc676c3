"""ROS 1 bags, version 2.0: chunks of records, each with a header of named fields."""

import bz2
import struct
from collections.abc import Iterator
from contextlib import AbstractContextManager
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

from mapweave.io.readers.options import ReadOptions
from mapweave.io.readers.ros_bags.bags import BagFormat, read_bag
from mapweave.io.readers.ros_bags.laser_messages import ROS1, Message
from mapweave.scan.scan import Scan

MAGIC = b"#ROSBAG V"
_MESSAGE, _BAG_HEADER, _CHUNK, _CONNECTION = b"\x02", b"\x03", b"\x05", b"\x07"
_LENGTH = struct.Struct("<I")
_POSITION = struct.Struct("<Q")
_LARGEST = 1 << 28  # [bytes] of a chunk, unpacked; recorders close one at a megabyte or so

_Fields = dict[bytes, bytes]


def sniffs(head: bytes) -> bool:
    """Tell whether a file that begins with `head` is one."""
    return head.startswith(MAGIC)


def read(path: Path, options: ReadOptions) -> Iterator[Scan]:
    """Yield the scans of one topic, as `read_scans` does."""
    return read_bag(path, FORMAT, options)


def is_whole(path: Path) -> bool:
    """Tell whether the header knows of an index, which is written last, within the file."""
    with path.open("rb") as file:
        file.readline(len(MAGIC) + 8)
        fields, _ = next(_records(file), ({}, b""))
    index = fields.get(b"index_pos", b"")
    return len(index) == _POSITION.size and 0 < _POSITION.unpack(index)[0] < path.stat().st_size


def open_whole(path: Path) -> AbstractContextManager[Any]:
    """Return the reader that `rosbags` has for it."""
    from rosbags.rosbag1 import Reader

    return Reader(path)


def walk(path: Path) -> Iterator[Message]:
    """Yield the whole messages of a bag that need not be whole, in the order of the file."""
    topics: dict[bytes, tuple[str, str]] = {}
    with path.open("rb") as file:
        file.readline(len(MAGIC) + 8)
        for fields, body in _unpacked(file):
            kind, number = fields.get(b"op"), fields.get(b"conn", b"")
            if kind == _CONNECTION:
                topics[number] = _connection(fields, body)
            elif kind == _MESSAGE and number in topics:
                yield Message(*topics[number], ROS1, body)


def _unpacked(file: BinaryIO) -> Iterator[tuple[_Fields, bytes]]:
    """Yield the records of `file`, and in place of a chunk the records in it."""
    for fields, body in _records(file, cut=True):
        if fields.get(b"op") == _CHUNK:
            yield from _records(BytesIO(_inflate(fields.get(b"compression", b""), body)))
        else:
            yield fields, body


def _records(file: BinaryIO, *, cut: bool = False) -> Iterator[tuple[_Fields, bytes]]:
    """Yield the fields and the data of each whole record; with `cut` also of a chunk in part."""
    while True:
        header, whole = _sized(file)
        if not whole:
            return
        fields = _fields(header)
        body, whole = _sized(file)
        if not whole and not (cut and fields.get(b"op") == _CHUNK):
            return
        yield fields, body


def _sized(file: BinaryIO) -> tuple[bytes, bool]:
    """Return what follows its length, and whether all of it was there."""
    length = file.read(_LENGTH.size)
    if len(length) < _LENGTH.size:
        return b"", False
    (size,) = _LENGTH.unpack(length)
    content = file.read(min(size, _LARGEST))
    return content, len(content) == size


def _fields(header: bytes) -> _Fields:
    """Return the fields ``name=value`` of a header."""
    fields, file = {}, BytesIO(header)
    while file.tell() < len(header):
        field, whole = _sized(file)
        if not whole:
            break
        name, _, value = field.partition(b"=")
        fields[name] = value
    return fields


def _connection(fields: _Fields, body: bytes) -> tuple[str, str]:
    """Return topic and type, the type as ROS 2 writes it."""
    stated = _fields(body)
    package, _, name = stated.get(b"type", b"").decode("utf-8", "replace").partition("/")
    return fields.get(b"topic", b"").decode("utf-8", "replace"), f"{package}/msg/{name}"


def _inflate(compression: bytes, body: bytes) -> bytes:
    """Return what is there of a chunk that may be cut off."""
    if compression == b"bz2":
        return bz2.BZ2Decompressor().decompress(body, _LARGEST)
    if compression == b"lz4":
        from lz4.frame import LZ4FrameDecompressor

        return bytes(LZ4FrameDecompressor().decompress(body, _LARGEST))
    return body


FORMAT = BagFormat(ROS1, is_whole, open_whole, walk)
