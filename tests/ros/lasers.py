"""Lasers that say their scans on Zenoh as ROS 2 nodes do."""

import struct
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Any, Self, cast

import numpy as np
import zenoh
from numpy.typing import ArrayLike
from rosbags.typesys import Stores, get_typestore

from mapweave.scan.scan import Scan
from mapweave_protocol.link.session import open_session

LASER_SCAN = "sensor_msgs/msg/LaserScan"
TYPE = "sensor_msgs::msg::dds_::LaserScan_"
HUMBLE_HASH = "TypeHashNotSupported"
STORE = get_typestore(Stores.ROS2_JAZZY)
JAZZY_HASH = STORE.hash_rihs01(LASER_SCAN)
PATIENCE = 60.0  # [s] for what takes one on a quiet machine
GID = bytes(range(16))


def laser_scan(
    ranges: ArrayLike,
    angle_min: float,
    angle_increment: float,
    stamp: float = 0.0,
    *,
    range_min: float = 0.0,
    range_max: float = 100.0,
    frame: str = "laser",
) -> bytes:
    """Return the message as it goes over the wire."""
    types = STORE.types
    values = np.asarray(ranges, dtype=np.float32)
    sec = int(stamp // 1)
    header = types["std_msgs/msg/Header"](
        stamp=types["builtin_interfaces/msg/Time"](sec=sec, nanosec=int((stamp - sec) * 1e9)),
        frame_id=frame,
    )
    message = types[LASER_SCAN](
        header=header,
        angle_min=angle_min,
        angle_max=angle_min + angle_increment * (len(values) - 1),
        angle_increment=angle_increment,
        time_increment=0.0,
        scan_time=0.1,
        range_min=range_min,
        range_max=range_max,
        ranges=values,
        intensities=np.zeros(0, dtype=np.float32),
    )
    return bytes(STORE.serialize_cdr(message, LASER_SCAN))


def as_message(scan: Scan) -> bytes:
    """Return `scan` as a message; what did not come back is infinite."""
    return laser_scan(
        np.where(scan.hits, scan.ranges, np.inf),
        float(scan.angles[0]),
        float(scan.angles[1] - scan.angles[0]),
        scan.stamp,
    )


class Laser:
    """A publisher of one topic.

    Parameters
    ----------
    key
        `native_key` or the bridge's.
    attached
        Whether `rmw_zenoh`'s attachment goes along.
    """

    def __init__(self, session: zenoh.Session, key: str, *, attached: bool) -> None:
        self._publisher = session.declare_publisher(
            key, congestion_control=zenoh.CongestionControl.BLOCK
        )
        self._attached = attached
        self._sequence = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._publisher.undeclare()  # type: ignore[no-untyped-call]

    def wait_for_listener(self) -> None:
        """Return once somebody listens."""
        deadline = time.monotonic() + PATIENCE
        while not cast("Any", self._publisher.matching_status).matching:  # its stub says bool
            assert time.monotonic() < deadline, "nobody listens"
            time.sleep(0.02)

    def say(self, payload: bytes) -> None:
        """Publish a message."""
        options: dict[str, Any] = {}
        if self._attached:
            self._sequence += 1
            head = struct.pack("<qqB", self._sequence, time.time_ns(), len(GID))
            options["attachment"] = head + GID
        self._publisher.put(payload, **options)


def native_key(topic: str, domain: int = 0, type_hash: str = JAZZY_HASH, dds: str = TYPE) -> str:
    """Return the key at which `rmw_zenoh` publishes."""
    return f"{domain}{topic}/{dds}/{type_hash}"


@contextmanager
def laser(endpoint: str, key: str, *, attached: bool = True) -> Iterator[Laser]:
    """Return a laser on the network of the router at `endpoint`."""
    with (
        open_session([endpoint], patience=PATIENCE) as session,
        Laser(session, key, attached=attached) as publisher,
    ):
        yield publisher
