"""Where lasers sit and what odometry says, heard on a real network beside the scans."""

import itertools
import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from mapweave.io.readers.options import ReadOptions
from mapweave.scan.scan import Scan
from mapweave_protocol.link.session import open_session
from mapweave_ros.network import Ros2Network
from mapweave_ros.node import Node
from mapweave_ros.source import open_ros2
from tests.ros.lasers import laser, laser_scan, native_key
from tests.ros.moving import ODOMETRY, TF_MESSAGE, cdr, odometry, tf, transform
from tests.ros.test_source import NEVER, ROOM, STEP, Taken, say, topic

HALF = np.full(19, 2.0)


@contextmanager
def robot(endpoint: str, domain: int, kinds: dict[str, tuple[str, bool]]) -> Iterator[Node]:
    """Return a node that says transforms and odometry, as a robot's own would."""
    network = Ros2Network((endpoint,), domain)
    with (
        open_session([endpoint], patience=NEVER) as session,
        Node(session, network, "robot", kinds) as node,
    ):
        yield node


def until(done: Callable[[], bool], again: Callable[[], None] = lambda: None) -> None:
    """Do something again and again until it is done: on a busy machine all takes its time."""
    deadline = time.monotonic() + NEVER
    while not done():
        assert time.monotonic() < deadline
        again()
        time.sleep(0.05)


def domain() -> int:
    """Return one of this test's own: transforms have one topic for all."""
    return int(np.random.default_rng().integers(20, 230))


@contextmanager
def taking(
    endpoint: str, word: str, told: list[str], odometry_topic: str | None = None
) -> Iterator[Taken]:
    options = ReadOptions(
        on_warning=told.append,
        on_news=told.append,
        network=(endpoint,),
        odometry_topic=odometry_topic,
    )
    with Taken(open_ros2(word, options)).running() as taken:
        yield taken


def test_a_laser_is_turned_as_transforms_that_were_said_before_say(endpoint: str) -> None:
    name, number, told = topic(), domain(), list[str]()
    ranges = np.arange(1.0, 19.0)  # from -90° on, 10° apart
    with robot(endpoint, number, {"/tf_static": (TF_MESSAGE, True)}) as node:
        place = transform("base_link", "laser", 0.1, 0.0, math.pi / 2, math.pi)
        node.put("/tf_static", cdr(tf(place), TF_MESSAGE))
        with (
            laser(endpoint, native_key(name, domain=number)) as sensor,
            taking(endpoint, f"ros2:{name}?domain={number}", told) as taken,
        ):
            sensor.wait_for_listener()
            sensor.say(laser_scan(ranges, -np.pi / 2, STEP))
            (scan,) = taken.wait(1)
    np.testing.assert_allclose(scan.angles[[0, -1]], np.radians([10.0, 180.0]), atol=1e-6)
    np.testing.assert_allclose(scan.ranges, ranges[::-1])
    assert told == [f"{name} sits at 0.10 m, 0.00 m, 90°, upside down, by /tf_static"]


def test_several_lasers_sit_where_transforms_say_and_none_is_taken_before(endpoint: str) -> None:
    front, rear, number, told = topic(), topic(), domain(), list[str]()
    with (
        robot(endpoint, number, {"/tf_static": (TF_MESSAGE, True)}) as node,
        laser(endpoint, native_key(front, domain=number)) as ahead,
        laser(endpoint, native_key(rear, domain=number)) as behind,
        taking(endpoint, f"ros2:{front}+{rear}@-0.5,0,180?domain={number}", told) as taken,
    ):
        for sensor in (ahead, behind):
            sensor.wait_for_listener()
        ahead.say(laser_scan(HALF, -np.pi / 2, STEP, 9.0))
        until(lambda: bool(told))
        place = transform("base_link", "laser", 0.5, 0.0, 0.0)
        node.put("/tf_static", cdr(tf(place), TF_MESSAGE))
        stamps = itertools.count(10)

        def both() -> None:
            stamp = next(stamps)
            ahead.say(laser_scan(HALF, -np.pi / 2, STEP, stamp))
            behind.say(laser_scan(HALF, -np.pi / 2, STEP, stamp + 0.01))

        # At first the one behind may be all there is of a view.
        until(lambda: any(_is_whole(scan) for scan in taken.scans), both)
        scan = next(scan for scan in taken.scans if _is_whole(scan))
    assert told[0] == (
        f"{front}: message refused: nothing on /tf_static says where its frame 'laser' sits;"
        f" write it, as in {front}@0.2,0,90 (metres ahead, to the left, degrees)"
    )
    ahead_of, behind_of = np.abs(scan.angles) < 0.01, scan.angles < -np.pi + 0.01
    np.testing.assert_allclose(scan.ranges[ahead_of | behind_of], 2.5, atol=1e-6)


def _is_whole(scan: Scan) -> bool:
    return bool(scan.hits.sum() > 1.5 * len(HALF))


@pytest.mark.parametrize("said", ["/odom", "/tf"])
def test_odometry_on_the_same_network_goes_along_with_scans(endpoint: str, said: str) -> None:
    name, number, told = topic(), domain(), list[str]()
    kind = ODOMETRY if said == "/odom" else TF_MESSAGE
    with (
        robot(endpoint, number, {said: (kind, False)}) as node,
        laser(endpoint, native_key(name, domain=number)) as sensor,
        taking(endpoint, f"ros2:{name}?domain={number}", told, said) as taken,
    ):
        sensor.wait_for_listener()
        for count in range(6):
            stamp, x = 50.0 + 0.1 * count, 0.05 * count
            message = odometry(stamp, x, 0.0, 0.2)
            if said == "/tf":
                message = tf(transform("odom", "base_link", x, 0.0, 0.2, 0.0, stamp))
            node.put(said, cdr(message, kind))
        until(
            lambda: any(scan.odometry is not None for scan in taken.scans),
            lambda: sensor.say(laser_scan(ROOM, -np.pi, STEP, 50.25)),
        )
        first = next(scan for scan in taken.scans if scan.odometry is not None)
        sensor.say(laser_scan(ROOM, -np.pi, STEP, 60.0))
        until(lambda: taken.scans[-1].stamp == 60.0)
        second = taken.scans[-1]
    assert first.odometry is not None
    np.testing.assert_allclose(first.odometry, [0.125, 0.0, 0.2], atol=1e-6)
    assert second.odometry is None
    assert told == []


def test_odometry_of_another_clock_is_told_of_once(endpoint: str) -> None:
    name, number, told = topic(), domain(), list[str]()
    with (
        robot(endpoint, number, {"/odom": (ODOMETRY, False)}) as node,
        laser(endpoint, native_key(name, domain=number)) as sensor,
        taking(endpoint, f"ros2:{name}?domain={number}", told, "/odom") as taken,
    ):
        sensor.wait_for_listener()
        for count in range(6):
            node.put("/odom", cdr(odometry(50.0 + count, 0.0, 0.0, 0.0), ODOMETRY))
        for count in range(120):
            sensor.say(laser_scan(ROOM, -np.pi, STEP, 1e6 + count))
        taken.wait(120)
    assert told == [
        "/odom does not say where the robot was when its scans were taken; expected poses in a"
        " parent called odom, with stamps of the same clock"
    ]


def test_noise_where_transforms_and_odometry_are_said_is_refused(endpoint: str) -> None:
    name, number, told = topic(), domain(), list[str]()
    kinds = {"/tf_static": (TF_MESSAGE, False), "/odom": (ODOMETRY, False)}
    with (
        robot(endpoint, number, kinds) as node,
        laser(endpoint, native_key(name, domain=number)) as sensor,
        taking(endpoint, f"ros2:{name}?domain={number}", told, "/odom") as taken,
    ):
        sensor.wait_for_listener()

        def shout() -> None:  # again and again: of transforms and odometry nobody tells who listens
            for where in kinds:
                for noise in (b"", b"\0\1\0\0", b"\xff" * 2000, bytes(2**20 + 1)):
                    node.put(where, noise)

        until(lambda: len({line.partition(":")[0] for line in told}) == 2, shout)
        say(sensor, 1.0)
        assert taken.wait(1)[0].odometry is None
    assert {line.partition(":")[0] for line in told} == {"/tf_static", "/odom"}
