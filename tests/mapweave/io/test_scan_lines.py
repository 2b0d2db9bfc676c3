"""Lines of JSON: what each says is a scan, and what says nothing is told once."""

import gzip
import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapweave.errors import FileError
from mapweave.io.readers import read_scans
from mapweave.io.readers.lines import Line
from mapweave.io.readers.options import ReadOptions
from mapweave.io.readers.scan_lines import read_scan_lines
from mapweave.scan.scan import Scan

LINE = {"stamp": 17.5, "angle_min": -0.5, "angle_increment": 0.25, "ranges": [1.5, 2, None, 3.5]}
HEADER = {"format": "mapweave/scans/1", "sensor": "whatever"}


def read(*contents: object, odometry: bool = False) -> list[Scan]:
    lines = [
        Line(number, (text if isinstance(text, str) else json.dumps(text)).encode())
        for number, text in enumerate(contents, start=1)
    ]
    return list(read_scan_lines("here", lines, ReadOptions(odometry)))


@pytest.mark.parametrize("head", [(), (HEADER,), ("", HEADER, "")])
def test_a_line_is_a_scan_with_or_without_a_header(head: tuple[object, ...]) -> None:
    first, second = read(*head, LINE, LINE | {"stamp": None})
    np.testing.assert_array_equal(first.ranges, [1.5, 2.0, math.nan, 3.5])
    np.testing.assert_array_equal(first.angles, [-0.5, -0.25, 0.0, 0.25])
    assert (first.stamp, first.index, second.index) == (17.5, 0, 1)
    assert math.isnan(second.stamp)


def test_the_format_may_stand_in_each_line() -> None:
    assert len(read(LINE | {"format": "mapweave/scans/1"})) == 1


def test_ranges_out_of_bounds_and_of_any_writing_of_none_are_no_returns() -> None:
    text = json.dumps(LINE | {"range_min": 1.0, "range_max": 4.0, "ranges": []})
    (scan,) = read(text.replace("[]", "[2.0, 0.5, 4.0, 4.5, 0, -1, NaN, Infinity, null]"))
    assert scan.ranges[0] == 2.0
    assert np.isnan(scan.ranges[1:]).all()


def test_odometry_is_read_only_where_it_is_asked_for() -> None:
    line = LINE | {"odometry": [1.0, 2.0, 0.5]}
    (without,), (with_it,) = read(line), read(line, odometry=True)
    assert without.odometry is None
    assert with_it.odometry is not None
    assert with_it.odometry.tolist() == [1.0, 2.0, 0.5]


@pytest.mark.parametrize(
    ("damaged", "problem"),
    [
        ("{", "is no JSON"),
        ("[" * 100_000, "is no JSON"),
        ("[1, 2]", "expected a JSON object"),
        ({"ranges": [1.0]}, "angle_min: expected a number, got nothing"),
        (LINE | {"angle_min": "left"}, "angle_min: expected a number, got 'left'"),
        (LINE | {"angle_increment": 0}, "angle_increment: expected an angle"),
        (LINE | {"angle_min": 10**400}, "angle_min: expected a number, got one too large"),
        (LINE | {"ranges": 1.5}, "ranges: expected a list of distances, got 1.5"),
        (LINE | {"ranges": [1.0, "far"]}, "ranges: expected distances or null, got 'far'"),
        (LINE | {"ranges": [True]}, "ranges: expected distances or null, got True"),
        (LINE | {"ranges": [1.0] * 100}, "one turn at the most"),
    ],
    ids=lambda value: str(value)[:30],
)
def test_a_damaged_line_is_left_out_and_told_with_its_number(damaged: object, problem: str) -> None:
    with pytest.warns(UserWarning, match="dropped 1 damaged line, the first line 3") as warnings:
        scans = read(HEADER, LINE, damaged, LINE)
    assert problem in str(warnings[0].message)
    assert [scan.index for scan in scans] == [0, 1]


@given(st.binary(max_size=60))
def test_whatever_a_line_holds_the_others_are_read(text: bytes) -> None:
    whole = json.dumps(LINE).encode()
    lines = [Line(1, whole), Line(2, text), Line(3, whole)]
    options = ReadOptions(on_warning=lambda _: None)
    assert len(list(read_scan_lines("here", lines, options))) == 2


def test_another_format_is_refused() -> None:
    with pytest.raises(
        FileError, match=r"^here: line 1 is of format 'mapweave/scans/2'; expected lines"
    ):
        read({"format": "mapweave/scans/2"}, LINE)


@pytest.mark.parametrize(
    ("contents", "problem"),
    [
        ((), "is empty; expected lines of JSON"),
        ((HEADER,), "is empty"),
        ((LINE | {"ranges": [None, 0]},), "in none of its 1 scans did a beam come back"),
        (("{",), "1 damaged line, the first line 1: is no JSON"),
    ],
)
def test_lines_without_a_usable_scan_are_refused(
    contents: tuple[object, ...], problem: str
) -> None:
    with pytest.raises(FileError, match=problem):
        read(*contents)


@pytest.mark.parametrize("packed", [False, True])
def test_a_file_of_lines_is_told_by_its_content(packed: bool, tmp_path: Path) -> None:
    text = f"{json.dumps(HEADER)}\n{json.dumps(LINE)}\n{json.dumps(LINE)}\n".encode()
    path = tmp_path / "some.log"
    path.write_bytes(gzip.compress(text) if packed else text)
    assert [scan.index for scan in read_scans(path)] == [0, 1]
