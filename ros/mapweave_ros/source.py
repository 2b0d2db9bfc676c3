"""``ros2:/scan``: the scans of one or several lasers, as they are said on a ROS 2 network."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import numpy as np
import zenoh

from mapweave.geometry.arrays import FloatArray
from mapweave.io.readers.options import ReadOptions
from mapweave.io.readers.ros_bags.laser_messages import UnreadableMessageError
from mapweave.scan.scan import Scan
from mapweave_protocol.link.inbox import Arrival, Inbox
from mapweave_ros.address import Laser, Ros2Address
from mapweave_ros.graph import topics_of_type
from mapweave_ros.mounting import Mounting
from mapweave_ros.output import open_when_there
from mapweave_ros.refusals import Refusals
from mapweave_ros.scan_messages import ScanMessages
from mapweave_ros.several_lasers import SeveralLasers
from mapweave_ros.topics import DDS_LASER_SCAN, TopicKeys

POLL = 0.1  # [s] after which it is noticed that nobody wants any more
SILENT = 5.0  # [s] without a scan, after which it is said what else there is
FORGOTTEN = 2.0  # [s] after which another publisher of a topic is listened to


def open_ros2(name: str, options: ReadOptions) -> "Ros2Source":
    """Return the source that `name` says, as ``mapweave.sources`` wants it.

    Raises
    ------
    Ros2SourceError
        If `name` names no laser.
    EndpointError
        If it names an endpoint that is none.
    MissingExtraError
        If `rosbags` is not installed.
    """
    return Ros2Source(Ros2Address.parse(name, options.network), options.on_warning)


class Ros2Source:
    """A `mapweave.io.sources.ScanSource` of what is published while somebody takes it.

    Parameters
    ----------
    address
        Of the lasers.
    on_warning
        Told what is refused, and where nothing comes.
    """

    live = True

    def __init__(self, address: Ros2Address, on_warning: Callable[[str], None]) -> None:
        self._address = address
        self._tell = on_warning
        self._messages = ScanMessages()
        self._closed = threading.Event()

    @property
    def mounting(self) -> FloatArray:
        """(3,) where the robot's scans are taken from, on the robot [m, m, rad].

        A single laser is turned as the robot is; scans of several are from its middle.
        """
        mounting = self._lasers[0].mounting
        alone = len(self._lasers) == 1 and mounting is not None
        return np.array([mounting.x, mounting.y, 0.0]) if alone and mounting else np.zeros(3)

    def count(self) -> None:
        """Nobody knows."""

    def close(self) -> None:
        """End `scans`, from any thread."""
        self._closed.set()

    def scans(self) -> Iterator[Scan]:
        """Yield scans as they come, until `close`; what is no scan is told, and left out."""
        inbox = Inbox()
        with ExitStack() as stack:
            session = open_when_there(stack, self._address.network, self._closed.is_set)
            if session is None:
                return
            topics = [
                _Topic(laser, self._address.network.domain, self._tell) for laser in self._lasers
            ]
            for key in (key for topic in topics for key in topic.keys):
                stack.enter_context(session.declare_subscriber(key, inbox.put))
            yield from self._combined(self._heard(session, inbox, topics))

    @property
    def _lasers(self) -> tuple[Laser, ...]:
        return self._address.lasers

    def _heard(
        self, session: zenoh.Session, inbox: Inbox, topics: list["_Topic"]
    ) -> Iterator[tuple[Laser, Scan]]:
        """Yield the scans of each laser."""
        silent_at, scans = time.monotonic() + SILENT, 0
        while not self._closed.is_set():
            arrival = inbox.get(POLL)
            if arrival is None:
                if time.monotonic() > silent_at:
                    self._tell_silence(session)
                    silent_at = float("inf")
                continue
            topic = next(topic for topic in topics if topic.has(arrival))
            scan = topic.scan(arrival, self._messages, scans)
            if scan is not None:
                silent_at, scans = float("inf"), scans + 1
                yield topic.laser, scan

    def _combined(self, heard: Iterator[tuple[Laser, Scan]]) -> Iterator[Scan]:
        """Yield scans as the robot has them; one for several that belong together."""
        mountings = {laser.topic: laser.mounting or Mounting() for laser in self._lasers}
        if len(mountings) == 1:
            for laser, scan in heard:
                yield mountings[laser.topic].turned(scan)
            return
        together = SeveralLasers(mountings)
        for laser, scan in heard:
            yield from together.add(laser.topic, scan)

    def _tell_silence(self, session: zenoh.Session) -> None:
        there = topics_of_type(session, self._address.network.domain, DDS_LASER_SCAN, POLL)
        asked = ", ".join(laser.topic for laser in self._lasers)
        known = f"those announced are {', '.join(there)}" if there else "none is announced"
        where = f"{asked} in domain {self._address.network.domain}"
        self._tell(f"no scan yet at {where}; of topics with LaserScan {known}")


class _Topic:
    """What is said at a laser's topic by one publisher at a time."""

    def __init__(self, laser: Laser, domain: int, tell: Callable[[str], None]) -> None:
        self.laser = laser
        self._names = TopicKeys(laser.topic, domain)
        self._native = zenoh.KeyExpr(self._names.native)
        self._refusals = Refusals(laser.topic, tell)
        self._key = ""
        self._heard = 0.0

    @property
    def keys(self) -> tuple[str, str]:
        return self._names.bridged, self._names.native

    def has(self, arrival: Arrival) -> bool:
        """Tell whether `arrival` is of this topic."""
        key = arrival.key
        return key == self._names.bridged or self._native.includes(zenoh.KeyExpr(key))

    def scan(self, arrival: Arrival, messages: ScanMessages, index: int) -> Scan | None:
        """Return the scan in `arrival`; None where it was refused, or said twice over."""
        now = time.monotonic()
        if arrival.key != self._key and now - self._heard < FORGOTTEN:
            return None  # as where a bridge says again what rmw_zenoh has said
        try:
            dds_type = self._names.type_at(arrival.key)
            scan = messages.scan(self.laser.topic, dds_type, arrival.payload, index)
        except UnreadableMessageError as error:
            self._refusals.add(str(error))
            return None
        self._key, self._heard = arrival.key, now
        return scan
