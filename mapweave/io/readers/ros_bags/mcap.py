"""MCAP, version 0, with ROS messages: records, some of them in chunks."""

import struct
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

from mapweave.io.readers.options import ReadOptions
from mapweave.io.readers.ros_bags.bags import BagFormat, read_bag
from mapweave.io.readers.ros_bags.laser_messages import CDR, Message
from mapweave.scan.scan import Scan

MAGIC = b"\x89MCAP0\r\n"
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = 0x03, 0x04, 0x05, 0x06
_RECORD = struct.Struct("<BQ")
_NUMBER = struct.Struct("<H")
_LENGTH = struct.Struct("<I")
_MESSAGE_HEAD = 22  # bytes: channel, sequence and two times, before the data
_CHUNK_HEAD = 28  # bytes: two times, the size and the checksum, before the name of the compression
_NO_SCHEMA = "__schemaless__"  # what `rosbags` calls the type of a channel that tells none
_LARGEST = 1 << 28  # [bytes] of a record, unpacked; recorders close a chunk at some megabytes


def sniffs(head: bytes) -> bool:
    """Tell whether a file that begins with `head` is one."""
    return head.startswith(MAGIC)


def read(path: Path, options: ReadOptions) -> Iterator[Scan]:
    """Yield the scans of one topic, as `read_scans` does."""
    return read_bag(path, FORMAT, options)


def is_whole(path: Path) -> bool:
    """Tell whether the file ends as it began, with the format's name."""
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - len(MAGIC)))
        return file.tell() > 0 and file.read() == MAGIC


@contextmanager
def open_whole(path: Path) -> Iterator[Any]:
    """Open the reader that `rosbags` has for it; that of a bag goes by the name of the file."""
    from rosbags.rosbag2 import Reader

    reader = Reader.STORAGE_PLUGINS[".mcap"](path)
    reader.open()
    try:
        yield reader
    finally:
        reader.close()


def is_indexed(reader: object) -> bool:
    """Tell whether the end of an opened file says what is in it: topics, types, and of each chunk.

    The format leaves most of that to the recorder (`noMessageIndex`, `noRepeatedChannels` and more
    in ROS 2); for `rosbags`, what is not told there is not there. SQLite's files, which a folder
    may hold as well, always tell.
    """
    chunks = getattr(reader, "chunks", None)
    if chunks is None:
        return True
    types = {connection.msgtype for connection in getattr(reader, "connections", ())}
    told = bool(types) and _NO_SCHEMA not in types
    return told and all(chunk.message_index_offsets for chunk in chunks)


def walk(path: Path) -> Iterator[Message]:
    """Yield the whole messages of a file that need not be whole, in its order."""
    schemas: dict[int, str] = {}
    channels: dict[int, tuple[str, str, str]] = {}
    with path.open("rb") as file:
        file.read(len(MAGIC))
        for kind, body in _unpacked(file):
            if kind == _SCHEMA:
                content = BytesIO(body)
                (number,) = _NUMBER.unpack(content.read(2))
                schemas[number] = _text(content)
            elif kind == _CHANNEL:
                number, channel = _channel(body, schemas)
                channels[number] = channel
            elif kind == _MESSAGE:
                (number,) = _NUMBER.unpack_from(body)
                if number in channels:
                    yield Message(*channels[number], body[_MESSAGE_HEAD:])


def _channel(body: bytes, schemas: dict[int, str]) -> tuple[int, tuple[str, str, str]]:
    """Return a channel's number; and its topic, type and encoding."""
    content = BytesIO(body)
    (number,) = _NUMBER.unpack(content.read(2))
    (schema,) = _NUMBER.unpack(content.read(2))
    topic, encoding = _text(content), _text(content)
    # ROS 1 names a type without what kind of file defines it.
    package, *_, name = schemas.get(schema, "/").split("/")
    return number, (topic, f"{package}/msg/{name}", encoding)


def _text(content: BinaryIO) -> str:
    (size,) = _LENGTH.unpack(content.read(_LENGTH.size))
    return content.read(size).decode("utf-8", "replace")


def _unpacked(file: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """Yield the records of `file`, and in place of a chunk the records in it."""
    for kind, body, whole in _records(file):
        if kind == _CHUNK and len(body) > _CHUNK_HEAD + _LENGTH.size:
            for inner, content, complete in _records(BytesIO(_inflate(body))):
                if complete:
                    yield inner, content
        elif whole:
            yield kind, body


def _records(file: BinaryIO) -> Iterator[tuple[int, bytes, bool]]:
    """Yield kind and content of each record, and whether all of it was there."""
    while len(head := file.read(_RECORD.size)) == _RECORD.size:
        kind, size = _RECORD.unpack(head)
        body = file.read(min(size, _LARGEST))
        yield kind, body, len(body) == size
        if len(body) < size:
            return


def _inflate(chunk: bytes) -> bytes:
    """Return the records that are there of a chunk that may be cut off."""
    content = BytesIO(chunk)
    content.seek(_CHUNK_HEAD)
    compression = _text(content)
    content.seek(8, 1)
    packed = content.read()
    if compression == "zstd":
        return _zstd(packed)
    if compression == "lz4":
        from lz4.frame import LZ4FrameDecompressor

        return bytes(LZ4FrameDecompressor().decompress(packed, _LARGEST))
    return packed


def _zstd(packed: bytes) -> bytes:
    if sys.version_info >= (3, 14):
        from compression import zstd
    else:
        from backports import zstd
    return zstd.ZstdDecompressor().decompress(packed, _LARGEST)


FORMAT = BagFormat(CDR, is_whole, open_whole, walk, is_indexed)
