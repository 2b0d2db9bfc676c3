"""Scans as sensors write them, and what is none."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapweave.io.readers.ros_bags.laser_messages import MULTI_ECHO_SCAN, UnreadableMessageError
from mapweave.io.refusals import Refusals
from mapweave_ros.scan_messages import MAX_BYTES, ScanMessages
from tests.mapweave.io.bag_files import ROS2, Laser
from tests.ros.lasers import TYPE, laser_scan

MESSAGES = ScanMessages()
TURN = np.radians(1.0)
WHOLE = laser_scan(np.full(90, 2.0), -0.7, TURN, 12.5)


def read(payload: bytes, dds_type: str | None = TYPE) -> np.ndarray:
    return MESSAGES.scan("/scan", dds_type, payload, 0).ranges


def test_whatever_is_written_for_no_return_is_none() -> None:
    written = [0.0, np.inf, -np.inf, np.nan, -1.0, 30.0, 31.0, 0.05, *[2.0] * 4]
    ranges = read(laser_scan(written, 0.0, TURN, range_min=0.1, range_max=30.0))
    assert np.isfinite(ranges).tolist() == [False] * 8 + [True] * 4


def test_of_several_echoes_a_beam_the_first_counts() -> None:
    message = Laser(np.full(40, 2.0), beyond=np.full(40, 1.5)).message(0)
    payload = bytes(ROS2.serialize_cdr(message, MULTI_ECHO_SCAN))
    ranges = read(payload, "sensor_msgs::msg::dds_::MultiEchoLaserScan_")
    assert ranges[1:].tolist() == [2.0] * 39


@pytest.mark.parametrize("range_max", [0.0, np.nan, np.inf, -1.0])
def test_a_maximum_that_is_no_distance_says_nothing(range_max: float) -> None:
    assert np.isfinite(read(laser_scan(np.full(20, 2.0), 0, TURN, range_max=range_max))).all()


def test_a_clockwise_sensor_is_turned_round() -> None:
    scan = MESSAGES.scan("/scan", TYPE, laser_scan(np.arange(1.0, 21.0), 0.5, -TURN), 0)
    assert scan.ranges.tolist() == list(range(20, 0, -1))
    assert scan.angles[-1] == pytest.approx(0.5)


def test_a_turn_whose_last_beam_looks_where_the_first_does_is_one() -> None:
    assert len(read(laser_scan(np.full(361, 2.0), -np.pi, TURN))) == 361


@pytest.mark.parametrize("stamp", [0.0, -5.0, 2.0**31 - 1])
def test_odd_stamps_are_handed_on(stamp: float) -> None:
    scan = MESSAGES.scan("/scan", TYPE, laser_scan(np.full(20, 2.0), 0, TURN, stamp), 0)
    assert scan.stamp == stamp


@pytest.mark.parametrize(
    ("payload", "why"),
    [
        (laser_scan(np.full(9, 2.0), 0.0, TURN), "ranges: expected 10 beams or more, got 9"),
        (laser_scan(np.full(20, 2.0), 0.0, 0.0), "angle_increment"),
        (laser_scan(np.full(20, 2.0), np.nan, TURN), "angle_min"),
        (laser_scan(np.full(20, 2.0), 0.0, np.inf), "angle_increment"),
        (laser_scan(np.full(900, 2.0), 0.0, TURN), "one turn at the most"),
        (bytes(MAX_BYTES + 1), "expected at most"),
        (b"", "."),
    ],
)
def test_what_is_no_scan_is_refused_in_one_line(payload: bytes, why: str) -> None:
    with pytest.raises(UnreadableMessageError, match=why) as raised:
        read(payload)
    assert "\n" not in str(raised.value)


@given(st.binary(max_size=400))
def test_noise_is_a_scan_or_refused(noise: bytes) -> None:
    try:
        read(noise, None)
    except UnreadableMessageError as error:
        assert str(error)


@given(st.integers(0, len(WHOLE) - 1), st.binary(max_size=8))
def test_a_damaged_message_is_a_scan_or_refused(place: int, noise: bytes) -> None:
    for damaged in (WHOLE[:place], WHOLE[:place] + noise + WHOLE[place + len(noise) :]):
        try:
            read(damaged, None)
        except UnreadableMessageError as error:
            assert str(error)


def test_a_flood_of_refusals_is_told_in_a_few_lines() -> None:
    told: list[str] = []
    refusals = Refusals("/scan", told.append)
    for _ in range(1234):
        refusals.add("is empty")
    assert told == [
        "/scan: message refused: is empty",
        "/scan: 10 messages refused, the last: is empty",
        "/scan: 100 messages refused, the last: is empty",
        "/scan: 1000 messages refused, the last: is empty",
    ]
