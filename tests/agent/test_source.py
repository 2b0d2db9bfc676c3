import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapweave.errors import FileError
from mapweave.io.readers.options import ReadOptions
from mapweave.io.scan_range import ScanRange
from mapweave.io.sources import open_source
from mapweave.scan.scan import Scan
from mapweave_agent.source import (
    NOMINAL_PERIOD,
    ReplayClock,
    count_selected,
    parse_rate,
    told_once,
)


def dues(stamps: list[float], rate: float = 1.0) -> list[float]:
    clock = ReplayClock(rate)
    nothing = np.empty(0)
    return [clock.due(Scan(nothing, nothing, k, stamp)) for k, stamp in enumerate(stamps)]


def test_scans_follow_each_other_as_their_stamps_say() -> None:
    waits = np.diff(dues([100.0, 100.5, 102.5, 102.75]))
    assert np.allclose(waits, [0.5, 2.0, 0.25])


def test_twice_the_rate_takes_half_the_time() -> None:
    stamps = [0.0, 0.5, 2.5]
    assert np.allclose(2 * np.array(dues(stamps, 2.0)), dues(stamps, 1.0))


@pytest.mark.parametrize(
    "stamps", [[5.0] * 4, [math.nan] * 4, [4.0, 3.0, 2.0, 1.0], [0.0, 1e9, 2e18, 3e18]]
)
def test_where_stamps_say_nothing_scans_come_at_the_nominal_rate(stamps: list[float]) -> None:
    assert np.allclose(np.diff(dues(stamps)), NOMINAL_PERIOD)


@given(st.lists(st.floats(), max_size=20))
def test_whatever_the_stamps_no_scan_is_due_before_the_one_before(stamps: list[float]) -> None:
    due = [0.0, *dues(stamps)]
    assert all(0.0 <= later - earlier < 10.1 for earlier, later in itertools.pairwise(due))


def test_at_the_maximum_every_scan_is_due_at_once() -> None:
    assert dues([0.0, 5.0, math.nan], math.inf) == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("text", "rate"), [("max", math.inf), ("1", 1.0), ("2.5", 2.5), ("1e3", 1000.0)]
)
def test_a_rate_is_max_or_a_multiple(text: str, rate: float) -> None:
    assert parse_rate(text) == rate


@pytest.mark.parametrize("text", ["", "0", "-1", "inf", "nan", "1e9", "1e-9", "fast", "0.0"])
def test_any_other_rate_is_refused_with_the_limits(text: str) -> None:
    with pytest.raises(ValueError, match=r"expected max.* from 0.001 to 1000000$"):
        parse_rate(text)


@pytest.mark.parametrize(
    ("text", "count"), [(":", 10), ("3:", 7), (":4", 4), ("3:5", 2), ("8:99", 2), ("20:", 0)]
)
def test_a_range_selects_as_a_slice_does(text: str, count: int) -> None:
    selected = ScanRange.parse(text)
    assert selected.count(10) == count == len(range(10)[selected.first : selected.end])
    assert ScanRange.parse(str(selected)) == selected


@pytest.mark.parametrize("text", ["", "3", "a:b", "5:5", "6:5", "-1:5", "1:2:3", "1 : 2"])
def test_any_other_range_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="expected A:B"):
        ScanRange.parse(text)


def test_a_recording_is_read_through_for_how_many_scans_are_selected(logs: list[Path]) -> None:
    source = open_source(str(logs[0]), ReadOptions())
    assert count_selected("log", source, ScanRange(5, 9)) == 4
    assert [scan.index for scan in ScanRange(5, 9).of(source.scans())] == [5, 6, 7, 8]
    assert all(scan.odometry is None for scan in source.scans())
    with pytest.raises(FileError, match=r"log: has \d+ scans, none of them in 99999:"):
        count_selected("log", source, ScanRange(99999))


def test_of_a_live_source_nobody_knows_how_many_scans_there_will_be() -> None:
    assert count_selected("-", open_source("-", ReadOptions()), ScanRange()) is None


def test_a_warning_is_said_once_however_often_it_comes() -> None:
    said: list[str] = []
    tell = told_once(said.append)
    for message in ("a", "b", "a"):
        tell(message)
    assert said == ["a", "b"]
