"""ROS 2 bags in SQLite: one table of topics, one of messages."""

import shutil
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from mapweave.io.readers.options import ReadOptions
from mapweave.io.readers.ros_bags.bags import BagFormat, read_bag
from mapweave.io.readers.ros_bags.laser_messages import CDR, Message
from mapweave.io.readers.ros_bags.sqlite_pages import table_rows
from mapweave.scan.scan import Scan

MAGIC = b"SQLite format 3\0"
LOG_SUFFIXES = ("-wal", "-journal")
"""What SQLite keeps beside a file that was not closed, and needs to read it."""

_PAGE_SIZE = struct.Struct(">H")
_PAGES = struct.Struct(">I")


def sniffs(head: bytes) -> bool:
    """Tell whether a file that begins with `head` is one."""
    return head.startswith(MAGIC)


def read(path: Path, options: ReadOptions) -> Iterator[Scan]:
    """Yield the scans of one topic, as `read_scans` does."""
    return read_bag(path, FORMAT, options)


def is_whole(path: Path) -> bool:
    """Tell whether the file has all its pages, and nothing waits beside it."""
    with path.open("rb") as file:
        head = file.read(100)
    if len(head) < 100:
        return False
    page = _PAGE_SIZE.unpack_from(head, 16)[0]
    pages = _PAGES.unpack_from(head, 28)[0]
    return path.stat().st_size >= (65536 if page == 1 else page) * pages and not _logs(path)


@contextmanager
def open_whole(path: Path) -> Iterator[Any]:
    """Open the reader that `rosbags` has for it; that of a bag goes by the name of the file."""
    from rosbags.rosbag2 import Reader

    reader = Reader.STORAGE_PLUGINS[".db3"](path)
    reader.open()
    try:
        yield reader
    finally:
        reader.close()


def walk(path: Path) -> Iterator[Message]:
    """Yield the whole messages of a bag that need not be whole, in the order of the file."""
    with _settled(path) as settled:
        topics = _topics(settled)
        seen: set[int] = set()
        for number, row in table_rows(settled):
            match row:
                case [None, int(topic), int(), bytes(data)] if topic in topics:
                    if number not in seen:  # a page that SQLite has given up may repeat a row
                        seen.add(number)
                        yield Message(*topics[topic], CDR, data)


def _topics(path: Path) -> dict[int, tuple[str, str]]:
    """Return name and type of each topic by its number."""
    topics = {}
    for number, row in table_rows(path):
        match row:
            case [None, str(name), str(kind), "cdr", *_]:
                topics[number] = (name, kind)
    return topics


def _logs(path: Path) -> list[Path]:
    """Return what SQLite still has to carry out on the file."""
    logs = [path.with_name(path.name + suffix) for suffix in LOG_SUFFIXES]
    return [log for log in logs if log.is_file() and log.stat().st_size]


@contextmanager
def _settled(path: Path) -> Iterator[Path]:
    """Give a copy in which what waits beside the file is carried out; itself if nothing does."""
    logs = _logs(path)
    if not logs:
        yield path
        return
    import apsw

    with TemporaryDirectory() as folder:
        for part in (path, *logs):
            shutil.copyfile(part, Path(folder) / part.name)
        copy = Path(folder) / path.name
        connection = apsw.Connection(str(copy))
        try:
            connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
        finally:
            connection.close()
        yield copy


FORMAT = BagFormat(CDR, is_whole, open_whole, walk)
