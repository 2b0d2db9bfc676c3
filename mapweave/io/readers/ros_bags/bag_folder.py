"""Folders of ROS 2 bags: files in SQLite or MCAP, and ``metadata.yaml``, where it was written."""

import re
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from mapweave.errors import FileError
from mapweave.io.readers.options import ReadOptions
from mapweave.io.readers.ros_bags import db3, mcap
from mapweave.io.readers.ros_bags.bags import (
    EXPECTED,
    Bag,
    BagFormat,
    SplitBag,
    WholeBag,
    check_installed,
    damage_errors,
    open_bag,
    read_open_bag,
)
from mapweave.io.readers.ros_bags.laser_messages import CDR
from mapweave.scan.scan import Scan

_HEAD = 16  # bytes that tell a format


def read(path: Path, options: ReadOptions) -> Iterator[Scan]:
    """Yield the scans of one topic of the recording in a folder, as `read_scans` does."""
    with ExitStack() as stack:
        yield from read_open_bag(path, _open(path, stack), options)


def _open(path: Path, stack: ExitStack) -> Bag:
    """Open the recording by its metadata; file by file where there is none, or it loses some."""
    parts = [(file, found) for file in _in_order(path) if (found := _format(file))]
    told = (path / "metadata.yaml").is_file()
    if parts or told:
        check_installed()
    if told and all(form.is_whole(file) for file, form in parts):
        from rosbags.rosbag2 import Reader

        try:
            reader: Any = stack.enter_context(Reader(path))
            if not parts or all(map(mcap.is_indexed, reader.storage.storages)):
                return WholeBag(reader, CDR)
        except damage_errors() as error:
            if not parts:
                raise FileError(path, f"cannot be read ({error}); {EXPECTED}") from error
    if not parts:
        raise FileError(path, "is a folder; expected a ROS 2 bag in it, or a file")
    return SplitBag([open_bag(file, form, stack) for file, form in parts])


def _in_order(folder: Path) -> list[Path]:
    """Return the files of a folder, part 10 after part 9."""

    def key(file: Path) -> list[tuple[int, str]]:
        words = re.split(r"([0-9]+)", file.name)
        return [(int(word), "") if word.isdigit() else (-1, word) for word in words]

    return sorted((file for file in folder.iterdir() if file.is_file()), key=key)


def _format(file: Path) -> BagFormat | None:
    with file.open("rb") as opened:
        head = opened.read(_HEAD)
    formats = ((db3.sniffs, db3.FORMAT), (mcap.sniffs, mcap.FORMAT))
    return next((form for sniffs, form in formats if sniffs(head)), None)
