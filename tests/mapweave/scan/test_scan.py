"""A scan is checked when it is made, whichever way its sensor turns."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from mapweave.errors import ArgumentError
from mapweave.geometry.arrays import FloatArray
from mapweave.scan import Scan, extract_segments
from mapweave.scan.scan import UNNUMBERED
from tests.mapweave.buildings import AROUND, BUILDING, cast, walls_of

HERE = np.array([3.0, 1.0, 0.2])
FULL = np.linspace(-np.pi, np.pi, 360, endpoint=False)


def test_points_lie_along_their_beams() -> None:
    scan = Scan(np.array([1.0, 2.0, 3.0]), np.array([-np.pi / 2, 0.0, np.pi / 2]))
    np.testing.assert_allclose(scan.points, [[0, -1], [2, 0], [0, 3]], atol=1e-12)


def test_a_scan_is_made_of_lists_and_needs_no_more() -> None:
    scan = Scan([1, 2, 3], [-0.5, 0, 0.5])
    assert scan.ranges.dtype == scan.angles.dtype == np.float64
    assert (scan.index, scan.odometry) == (UNNUMBERED, None)
    assert math.isnan(scan.stamp)


@pytest.mark.parametrize("nothing", [math.nan, math.inf, -math.inf, 0.0, -1.0])
def test_what_is_no_distance_is_no_return(nothing: float) -> None:
    scan = Scan([nothing, 2.0], [0.0, 0.1])
    assert scan.hits.tolist() == [False, True]
    assert np.isnan(scan.ranges[0])
    assert np.isnan(scan.points).tolist() == [[True, True], [False, False]]


def test_a_clockwise_sensor_shows_the_same_scan() -> None:
    scan = cast(walls_of(BUILDING), HERE)
    clockwise = Scan(scan.ranges[::-1], scan.angles[::-1])
    np.testing.assert_array_equal(clockwise.angles, scan.angles)
    np.testing.assert_array_equal(clockwise.ranges, scan.ranges)


@given(st.floats(-math.pi, 0.0), st.floats(0.001, 0.01), st.integers(2, 500))
def test_what_drivers_state_is_the_scan_whichever_way_it_is_stated(
    start: float, step: float, count: int
) -> None:
    ranges = np.linspace(1.0, 2.0, count)
    one = Scan.of(ranges, start, step)
    other = Scan.of(ranges[::-1], start + step * (count - 1), -step)
    np.testing.assert_allclose(other.angles, one.angles, atol=1e-12)
    np.testing.assert_array_equal(other.ranges, one.ranges)


def test_readings_out_of_the_drivers_range_are_no_returns() -> None:
    ranges = [0.01, 0.02, 29.99, 30.0, 31.0]
    scan = Scan.of(ranges, 0.0, 0.1, range_min=0.02, range_max=30.0, stamp=7.0)
    assert scan.hits.tolist() == [False, True, True, False, False]
    assert scan.stamp == 7.0


@pytest.mark.parametrize("nothing", [0.0, -1.0, -math.inf])
def test_a_bound_that_is_no_distance_states_nothing(nothing: float) -> None:
    assert Scan.of([0.01, 1.0, 30.0], 0.0, 0.1, range_min=nothing, range_max=nothing).hits.all()


@pytest.mark.parametrize("highest", [1.0, 5.0])
def test_bounds_with_nothing_between_them_are_refused(highest: float) -> None:
    with pytest.raises(ArgumentError, match=r"^range_max: expected more than range_min, 5 m, got"):
        Scan.of([2.0, 3.0], 0.0, 0.1, range_min=5.0, range_max=highest)


@pytest.mark.parametrize(("stated", "sweep"), [(0.5, 1.0), (-0.5, -1.0), (0.51, 0.0), (1e6, 0.0)])
def test_a_sweep_of_more_than_a_second_is_not_believed(stated: float, sweep: float) -> None:
    assert Scan.of([1.0, 2.0, 3.0], 0.0, 0.1, time_increment=stated).sweep == sweep


def test_a_scan_cannot_be_changed_and_changes_with_nothing() -> None:
    ranges, angles = np.array([1.0, 2.0]), np.array([0.0, 0.1])
    scan = Scan(ranges, angles)
    ranges[0] = angles[0] = -9.0
    assert (scan.ranges[0], scan.angles[0]) == (1.0, 0.0)
    with pytest.raises(ValueError, match="read-only"):
        scan.ranges[0] = 5.0


@pytest.mark.parametrize(
    "angles",
    [FULL, FULL + np.pi, np.linspace(-np.pi, np.pi, 361), np.linspace(0, 2 * np.pi, 361)],
)
def test_a_full_turn_is_a_scan_wherever_it_begins_and_with_a_doubled_beam(
    angles: FloatArray,
) -> None:
    """All show the room that a scan all around shows."""
    scan = cast(walls_of(BUILDING), HERE, angles=angles)
    assert len(scan.angles) == len(angles)
    around = cast(walls_of(BUILDING), HERE, angles=AROUND)
    seen, expected = (total_length(extract_segments(s).segments) for s in (scan, around))
    assert seen == pytest.approx(expected, rel=0.05)


def total_length(segments: FloatArray) -> float:
    return float(np.hypot(*(segments[:, 2:] - segments[:, :2]).T).sum())


def test_a_turn_whose_increment_was_rounded_is_a_turn() -> None:
    assert len(Scan.of(np.ones(361), -np.pi, 0.0175).angles) == 361  # 6.3 rad


@pytest.mark.parametrize(
    ("ranges", "angles", "complaint"),
    [
        ([1, 2, 3], [0, 0.1], r"^angles: expected \(3,\), one a range, got shape \(2,\)"),
        ([[1, 2]], [[0, 0.1]], r"^ranges: expected \(n,\) distances \[m\], got shape \(1, 2\)"),
        ([1, 2], [0, math.nan], r"^angles: .* got nan for beam 1"),
        ([1, 2], [math.nan, math.nan], r"^angles: .* got nan for beam 0"),
        ([1, 2], [-math.inf, 0], r"^angles: .* got -inf for beam 0"),
        ([1], [math.nan], r"^angles: expected finite"),
        ([1, 2, 3], [0, 0.2, 0.1], r"^angles: .* ascend"),
        ([1, 2, 3], [0, 0, 0.1], r"^angles: .* ascend"),
        ([1, 2, 3], [0.2, 0.3, 0.1], r"^angles: .* ascend"),
        (np.ones(400), np.radians(np.arange(400)), r"^angles: expected one turn at the most"),
        ("far", [0.0], r"^ranges: expected \(n,\) distances \[m\], got str"),
        ([1, 2], ["left", "right"], r"^angles: expected \(n,\) directions \[rad\], got list"),
    ],
)
def test_what_is_no_scan_is_refused_by_the_name_of_the_argument(
    ranges: ArrayLike, angles: ArrayLike, complaint: str
) -> None:
    with pytest.raises(ArgumentError, match=complaint):
        Scan(ranges, angles)


@pytest.mark.parametrize("odometry", [[1, 2], [1, 2, math.nan], "home"])
def test_odometry_is_a_pose(odometry: ArrayLike) -> None:
    with pytest.raises(ArgumentError, match=r"^odometry: expected \(3,\)"):
        Scan.of([1, 2], 0.0, 0.1, odometry=odometry)
    assert Scan.of([1, 2], 0.0, 0.1, odometry=[1, 2, 3]).odometry is not None


@pytest.mark.parametrize(
    ("start", "increment", "name"),
    [(math.nan, 0.1, "angle_min"), (0, math.nan, "angle_increment"), (0, 0, "angle_increment")],
)
def test_an_increment_turns_the_beam(start: float, increment: float, name: str) -> None:
    with pytest.raises(ArgumentError, match=rf"^{name}: expected"):
        Scan.of([1, 2], start, increment)


def test_no_beams_are_a_blind_scan() -> None:
    nothing: Sequence[float] = []
    assert Scan.of(nothing, 0.0, 0.1).points.shape == (0, 2)


@pytest.mark.parametrize("index", ["first", 1.5, None, -2, 2**53 + 1])
def test_an_index_numbers_a_scan(index: int) -> None:
    with pytest.raises(ArgumentError, match=r"^index: expected a whole number from 0"):
        Scan([1, 2], [0, 0.1], index)
    assert type(Scan([1, 2], [0, 0.1], np.int64(3)).index) is int  # type: ignore[arg-type]


@pytest.mark.parametrize("stamp", ["noon", [1.0, 2.0], np.datetime64("2020-01-01")])
def test_a_stamp_is_a_time(stamp: float) -> None:
    with pytest.raises(ArgumentError, match=r"^stamp: expected a time \[s\]"):
        Scan([1, 2], [0, 0.1], stamp=stamp)


@pytest.mark.parametrize("stamp", [math.inf, math.nan, 1e18, -1.1e11, 1e308])
def test_a_clock_that_has_overflown_tells_no_time(stamp: float) -> None:
    assert math.isnan(Scan([1, 2], [0, 0.1], stamp=stamp).stamp)


@pytest.mark.parametrize("name", ["angle_min", "angle_increment", "range_min", "range_max"])
@pytest.mark.parametrize("value", ["wide", None, [0.1, 0.2], math.nan])
def test_what_drivers_state_are_numbers(name: str, value: float) -> None:
    stated: dict[str, Any] = {"angle_min": 0.0, "angle_increment": 0.1, name: value}
    with pytest.raises(ArgumentError, match=rf"^{name}: expected"):
        Scan.of([1, 2], **stated)


ROOM = np.linspace(0.4, 6.0, 360)  # [m]


@pytest.mark.parametrize("range_max", [12.0, 12_000.0, math.inf])
def test_distances_in_millimetres_are_refused_in_words(range_max: float) -> None:
    with pytest.raises(ArgumentError, match=r"ranges: .* in millimetres\?"):
        Scan.of(ROOM * 1000, -math.pi, math.radians(1.0), range_max=range_max)


@pytest.mark.parametrize("nothing", [0.0, 13.0, 65.535, 8191.0, 1e9, math.inf])
def test_what_did_not_come_back_is_no_distance_in_another_unit(nothing: float) -> None:
    ranges = np.full(360, nothing)
    ranges[:20] = ROOM[:20]
    scan = Scan.of(ranges, -math.pi, math.radians(1.0), range_max=12.0)
    assert scan.hits.sum() == 20


def test_a_maximum_that_is_set_low_cuts_off_distances_and_says_nothing_of_their_unit() -> None:
    scan = Scan.of(ROOM + 20.0, -math.pi, math.radians(1.0), range_max=3.0)
    assert not scan.hits.any()


def test_a_few_far_returns_in_the_open_are_distances_in_metres() -> None:
    ranges = np.full(360, math.nan)
    ranges[:100] = np.linspace(105.0, 180.0, 100)
    assert Scan.of(ranges, -math.pi, math.radians(1.0)).hits.sum() == 100
