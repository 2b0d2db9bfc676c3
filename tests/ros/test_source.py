"""Scans as a source takes them off a real network."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from mapweave.io.readers.options import ReadOptions
from mapweave.io.sources import open_source
from mapweave.scan.scan import Scan
from mapweave_ros.source import Ros2Source, open_ros2
from tests.ros.lasers import HUMBLE_HASH, Laser, laser, laser_scan, native_key

NEVER = 20.0  # [s]
ROOM = np.full(36, 2.0)  # ranges of a turn [m]
STEP = np.pi / 18


class Taken:
    """Takes what a source yields, in a thread of its own, until the block ends."""

    def __init__(self, source: Ros2Source) -> None:
        self.scans: list[Scan] = []
        self._changed = threading.Condition()
        self._source = source
        self._thread = threading.Thread(target=self._take)

    def _take(self) -> None:
        for scan in self._source.scans():
            with self._changed:
                self.scans.append(scan)
                self._changed.notify_all()

    @contextmanager
    def running(self) -> Iterator["Taken"]:
        """Take for the length of a block."""
        self._thread.start()
        try:
            yield self
        finally:
            self._source.close()
            self._thread.join(NEVER)
            assert not self._thread.is_alive()

    def wait(self, count: int) -> list[Scan]:
        """Return the scans once there are `count`."""
        with self._changed:
            assert self._changed.wait_for(lambda: len(self.scans) >= count, NEVER), self.scans
            return self.scans


@contextmanager
def taking(
    endpoint: str, word: str, tell: Callable[[str], None] = lambda _: None
) -> Iterator[Taken]:
    with Taken(open_ros2(word, ReadOptions(on_warning=tell, network=(endpoint,)))).running() as it:
        yield it


def say(sensor: Laser, *stamps: float, ranges: np.ndarray = ROOM) -> None:
    sensor.wait_for_listener()
    for stamp in stamps:
        sensor.say(laser_scan(ranges, -np.pi, STEP, stamp))


def topic() -> str:
    """Return one of this test's own: the router is shared."""
    return f"/scan_{np.random.default_rng().integers(1 << 40)}"


def test_the_word_is_known_to_every_program_that_opens_sources() -> None:
    assert isinstance(open_source("ros2:/scan", ReadOptions()), Ros2Source)


@pytest.mark.parametrize("type_hash", [HUMBLE_HASH, "RIHS01_0", "TypeHashNotYetInvented"])
def test_whatever_hash_a_release_names_its_scans_are_heard(endpoint: str, type_hash: str) -> None:
    name = topic()
    with (
        laser(endpoint, native_key(name, type_hash=type_hash)) as sensor,
        taking(endpoint, f"ros2:{name}") as taken,
    ):
        say(sensor, 1.5, 2.5)
        assert [(scan.index, scan.stamp) for scan in taken.wait(2)] == [(0, 1.5), (1, 2.5)]


def test_robots_in_other_domains_and_topics_below_are_not_heard(endpoint: str) -> None:
    name = topic()
    with (
        laser(endpoint, native_key(name, domain=3)) as sensor,
        laser(endpoint, native_key(f"{name}/filtered", domain=7)) as below,
        laser(endpoint, native_key(name, domain=7)) as ours,
        taking(endpoint, f"ros2:{name}?domain=7") as taken,
    ):
        ours.wait_for_listener()
        sensor.say(laser_scan(ROOM, -np.pi, STEP, 1.0))
        below.say(laser_scan(ROOM, -np.pi, STEP, 2.0))
        say(ours, 3.0)
        assert [scan.stamp for scan in taken.wait(1)] == [3.0]


def test_a_topic_that_is_said_by_rmw_and_bridge_is_heard_once(endpoint: str) -> None:
    name = topic()
    with (
        laser(endpoint, native_key(name)) as sensor,
        laser(endpoint, name[1:], attached=False) as bridge,
        taking(endpoint, f"ros2:{name}") as taken,
    ):
        for stamp in (1.0, 2.0, 3.0):
            say(sensor, stamp)
            taken.wait(int(stamp))
            say(bridge, stamp)
        say(sensor, 4.0)
        assert [scan.stamp for scan in taken.wait(4)] == [1.0, 2.0, 3.0, 4.0]


def test_what_is_no_scan_is_told_and_the_next_one_is_taken(endpoint: str) -> None:
    name, told = topic(), list[str]()
    with (
        laser(endpoint, native_key(name)) as sensor,
        taking(endpoint, f"ros2:{name}", told.append) as taken,
    ):
        sensor.wait_for_listener()
        for noise in (b"", b"\0\1\0\0", laser_scan(ROOM, 0.0, 0.0), laser_scan(ROOM[:3], 0, STEP)):
            sensor.say(noise)
        say(sensor, 7.0)
        (scan,) = taken.wait(1)
    assert (scan.index, scan.stamp) == (0, 7.0)
    assert len(told) == 1
    assert told[0].startswith(f"{name}: message refused: ")


def test_of_two_lasers_at_one_topic_the_first_is_heard_and_the_other_told_of(
    endpoint: str,
) -> None:
    name, told = topic(), list[str]()
    with (
        laser(endpoint, native_key(name)) as sensor,
        taking(endpoint, f"ros2:{name}", told.append) as taken,
    ):
        sensor.wait_for_listener()
        for stamp, frame in ((1.0, "front"), (1.25, "rear"), (1.5, "/front"), (1.75, "rear")):
            sensor.say(laser_scan(ROOM, -np.pi, STEP, stamp, frame=frame))
        say(sensor, 9.0)  # of a third, after a while without any
        assert [scan.stamp for scan in taken.wait(3)] == [1.0, 1.5, 9.0]
    assert len(told) == 1
    assert "is of a laser in frame 'rear', beside those of 'front'" in told[0]


def test_a_topic_of_another_type_is_told_by_its_type(endpoint: str) -> None:
    name, told, heard = topic(), list[str](), threading.Event()

    def tell(message: str) -> None:
        told.append(message)
        heard.set()

    cloud = native_key(name, dds="sensor_msgs::msg::dds_::PointCloud2_")
    with (
        laser(endpoint, cloud) as sensor,
        taking(endpoint, f"ros2:{name}", tell),
    ):
        say(sensor, 1.0)
        assert heard.wait(NEVER)
    assert "is a sensor_msgs::msg::dds_::PointCloud2_" in told[0]


def test_where_nothing_comes_the_lasers_that_there_are_are_named(
    endpoint: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mapweave_ros.silence.SILENT", 0.2)
    told = list[str]()
    heard = threading.Event()

    def tell(message: str) -> None:
        told.append(message)
        heard.set()

    from mapweave_protocol.link.session import open_session

    token = (
        "@ros2_lv/5/ab12/0/11/MP/%/%/driver/%front%scan/sensor_msgs::msg::dds_::LaserScan_"
        f"/{HUMBLE_HASH}/::,10:,:,:,,"
    )
    with (
        open_session([endpoint], patience=NEVER) as session,
        session.liveliness().declare_token(token),
        taking(endpoint, f"ros2:{topic()}?domain=5", tell),
    ):
        assert heard.wait(NEVER)
    assert told[0].endswith("of topics with LaserScan those announced are /front/scan")


def test_one_laser_is_turned_as_it_is_mounted(endpoint: str) -> None:
    name = topic()
    ranges = np.arange(1.0, 19.0)  # from -90° on, 10° apart
    with (
        laser(endpoint, native_key(name)) as sensor,
        taking(endpoint, f"ros2:{name}@0,0,90,upside-down") as taken,
    ):
        sensor.wait_for_listener()
        sensor.say(laser_scan(ranges, -np.pi / 2, STEP))
        (scan,) = taken.wait(1)
    np.testing.assert_allclose(scan.angles[[0, -1]], np.radians([10.0, 180.0]), atol=1e-6)
    np.testing.assert_allclose(scan.ranges, ranges[::-1])


def test_two_lasers_are_one_view_of_a_turn(endpoint: str) -> None:
    front, rear = topic(), topic()
    half = np.full(19, 2.0)
    word = f"ros2:{front}@0.5,0,0+{rear}@-0.5,0,180"
    with (
        laser(endpoint, native_key(front)) as ahead,
        laser(endpoint, native_key(rear)) as behind,
        taking(endpoint, word) as taken,
    ):
        for sensor in (ahead, behind):
            sensor.wait_for_listener()
        for count, stamp in enumerate((10.0, 10.1), start=1):
            ahead.say(laser_scan(half, -np.pi / 2, STEP, stamp))
            behind.say(laser_scan(half, -np.pi / 2, STEP, stamp + 0.01))
            taken.wait(count)
    scans = taken.scans
    for scan in scans:
        ahead_of, behind_of = np.abs(scan.angles) < 0.01, scan.angles < -np.pi + 0.01
        np.testing.assert_allclose(scan.ranges[ahead_of | behind_of], 2.5, atol=1e-6)
    assert [scan.stamp for scan in scans] == pytest.approx([10.01, 10.11])
