"""Scans as lines of JSON, ``mapweave/scans/1``: what a driver of one's own writes.

Each line is an object with ``ranges`` [m], ``angle_min`` and ``angle_increment`` [rad], and where
it is known ``stamp`` [s], ``range_min`` and ``range_max`` [m], ``odometry`` [m, m, rad]. A range
that did not come back is ``null``, or as in `Scan.of`. A line may name the format:
``{"format": "mapweave/scans/1"}``; fields not known here are ignored.
"""

import json
import math
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

from mapweave.errors import ArgumentError, FileError
from mapweave.io.readers.lines import Line
from mapweave.io.readers.log import read_lines
from mapweave.io.readers.options import ReadOptions
from mapweave.io.readers.tally import Tally
from mapweave.scan.scan import Scan

SCANS_FORMAT = "mapweave/scans/1"
EXPECTED = f"expected lines of JSON ({SCANS_FORMAT})"


class UnreadableLineError(Exception):
    """A line that is no scan; its text says why."""


def sniffs(head: bytes) -> bool:
    """Tell whether a file that begins with `head`, unpacked, is one."""
    return head.lstrip().startswith(b"{")


def read(path: Path, options: ReadOptions) -> Iterator[Scan]:
    """Yield the whole scans of the file at `path`, as `read_scans` does."""
    return read_scan_lines(path, read_lines(path), options)


def read_scan_lines(
    name: Path | str,
    lines: Iterable[Line],
    options: ReadOptions,
    on_damaged: Callable[[str], None] = lambda _: None,
) -> Iterator[Scan]:
    """Yield the scans of `lines`; `name` says where they are from, in warnings and errors.

    `on_damaged` is told of each line that is left out, and why, when it is.

    Raises
    ------
    FileError
        If a line names another format; at the end if there was no usable scan.
    """
    tally = Tally("line", EXPECTED)
    try:
        for line in lines:
            try:
                content = _content(line)
                if content is None or _is_header(name, line.number, content):
                    continue
                tally.pieces += 1
                scan = _scan(tally.scans, content, odometry=options.odometry)
            except (UnreadableLineError, ArgumentError) as error:
                tally.add_damaged(line.number, error)
                on_damaged(f"line {line.number}: {error}")
                continue
            tally.add_scan(scan)
            yield scan
        if problem := tally.problem():
            raise FileError(name, problem)
    finally:  # also where nobody wants the rest
        tally.warn(name, options)


def _content(line: Line) -> dict[str, Any] | None:
    """Return the object in a line; None if it is blank."""
    if line.damage:
        raise UnreadableLineError(line.damage)
    if not line.text.strip():
        return None
    try:
        content = json.loads(line.text)
    except (ValueError, RecursionError) as error:
        raise UnreadableLineError("is no JSON") from error
    if not isinstance(content, dict):
        raise UnreadableLineError("expected a JSON object")
    return content


def _is_header(name: Path | str, number: int, content: dict[str, Any]) -> bool:
    if "format" not in content:
        return False
    if content["format"] != SCANS_FORMAT:
        raise FileError(name, f"line {number} is of format {content['format']!r}; {EXPECTED}")
    return "ranges" not in content


def _scan(index: int, content: dict[str, Any], *, odometry: bool) -> Scan:
    stamp = _number(content, "stamp", math.nan)
    return Scan.of(
        _ranges(content),
        _number(content, "angle_min"),
        _number(content, "angle_increment"),
        range_min=_number(content, "range_min", 0.0),
        range_max=_number(content, "range_max", math.inf),
        index=index,
        stamp=stamp if math.isfinite(stamp) else math.nan,
        odometry=content.get("odometry") if odometry else None,
        time_increment=_number(content, "time_increment", 0.0),
    )


def _number(content: dict[str, Any], field: str, default: float | None = None) -> float:
    """Return a field that is a number; `default` where it is missing or null."""
    value = content.get(field, default)
    if value is None:
        value = default
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise UnreadableLineError(f"{field}: expected a number, got {_short(value)}")
    try:
        return float(value)
    except OverflowError as error:
        raise UnreadableLineError(f"{field}: expected a number, got one too large") from error


def _ranges(content: dict[str, Any]) -> list[float]:
    values = content.get("ranges")
    if not isinstance(values, list):
        raise UnreadableLineError(f"ranges: expected a list of distances, got {_short(values)}")
    for value in values:
        if value is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
            raise UnreadableLineError(f"ranges: expected distances or null, got {_short(value)}")
    return [math.nan if value is None else value for value in values]


def _short(value: object) -> str:
    return "nothing" if value is None else repr(value)[:40]
