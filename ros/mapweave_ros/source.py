"""``ros2:/scan``: the scans of one or several lasers, as they are said on a ROS 2 network."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import zenoh

from mapweave.io.readers.options import ReadOptions
from mapweave.io.readers.ros_bags.frames import TF_STATIC
from mapweave.io.readers.ros_bags.laser_messages import LASER_SCAN, UnreadableMessageError
from mapweave.io.readers.ros_bags.one_laser import OneLaser
from mapweave.io.refusals import Refusals
from mapweave.scan.mounting import Mounting
from mapweave.scan.scan import Scan
from mapweave.scan.several_lasers import SeveralLasers
from mapweave_protocol.link.inbox import Arrival, Inbox
from mapweave_ros.address import Laser, Ros2Address
from mapweave_ros.graph import topics_of_type
from mapweave_ros.output import open_when_there
from mapweave_ros.robot.beside_scans import BesideScans, kind_of_odometry
from mapweave_ros.robot.frames import RobotFrames
from mapweave_ros.scan_messages import ScanMessages
from mapweave_ros.silence import Expected, Silence
from mapweave_ros.topics import TopicKeys, dds_type_of

POLL = 0.1  # [s] after which it is noticed that nobody wants any more
BEFORE = 0.3  # [s] for what is latched to come, before lasers are heard
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
    address = Ros2Address.parse(name, options.network)
    return Ros2Source(address, options.on_warning, options.odometry_topic, options.on_news)


class Ros2Source:
    """A `mapweave.io.sources.ScanSource` of what is published while somebody takes it.

    Parameters
    ----------
    address
        Of the lasers.
    on_warning
        Told what is refused, and where nothing comes.
    odometry
        The topic of odometry on the same network that may help; None for none.
    on_news
        Told where a laser sits, and when one is heard again.
    """

    live = True

    def __init__(
        self,
        address: Ros2Address,
        on_warning: Callable[[str], None],
        odometry: str | None = None,
        on_news: Callable[[str], None] = lambda _: None,
    ) -> None:
        self._address = address
        self._odometry = odometry
        self._tell = on_warning
        self._tell_news = on_news
        self._messages = ScanMessages()
        self._closed = threading.Event()
        self.frames = RobotFrames()

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
            domain = self._address.network.domain
            topics = [_Topic(laser, domain, self._tell) for laser in self._lasers]
            beside = BesideScans(
                self._messages, domain, self.frames, self._odometry, self._tell, self._tell_news
            )
            beside.subscribe(session, inbox.put, stack)
            self._hear_transforms(inbox, beside)
            for key in (key for topic in topics for key in topic.keys):
                stack.enter_context(session.declare_subscriber(key, inbox.put))
            silence = self._silence(session)
            heard = self._heard(inbox, topics, beside, silence)
            yield from self._combined(heard, beside)

    def _hear_transforms(self, inbox: Inbox, beside: BesideScans) -> None:
        """Take what is said before the first scan, as transforms are that do not change."""
        until = time.monotonic() + BEFORE
        while not self._closed.is_set() and (left := until - time.monotonic()) > 0:
            arrival = inbox.get(left)
            if arrival is not None:
                beside.takes(arrival)

    @property
    def _lasers(self) -> tuple[Laser, ...]:
        return self._address.lasers

    def _silence(self, session: zenoh.Session) -> Silence:
        """Return what tells which of the topics that were asked for nothing is heard of."""
        expected = {laser.topic: Expected("scan", LASER_SCAN) for laser in self._lasers}
        if self._odometry is not None:
            expected[self._odometry] = Expected("odometry", kind_of_odometry(self._odometry))
        return Silence(
            expected,
            self._address.network.domain,
            lambda kind: topics_of_type(session, dds_type_of(kind), POLL),
            self._tell,
            self._tell_news,
        )

    def _heard(
        self, inbox: Inbox, topics: list["_Topic"], beside: BesideScans, silence: Silence
    ) -> Iterator[tuple[str, Mounting, Scan]]:
        """Yield the scans of each laser: its topic, where it sits, and what it measured."""
        scans = 0
        while not self._closed.is_set():
            arrival = inbox.get(POLL)
            silence.check()
            if arrival is None:
                continue
            if (taken := beside.takes(arrival)) is not None:
                silence.heard(taken)
                continue
            topic = next(topic for topic in topics if topic.has(arrival))
            silence.heard(topic.laser.topic)
            found = topic.scan(arrival, self._messages, scans)
            if found is None:
                continue
            mounting = self._mounting(topic, found[0], beside)
            if mounting is not None:
                scans += 1
                yield topic.laser.topic, mounting, found[1]

    def _mounting(self, topic: "_Topic", frame: str, beside: BesideScans) -> Mounting | None:
        """Return where a laser sits, as of `_Topic.mounting`; note the first one's frame."""
        alone = len(self._lasers) == 1
        mounting = topic.mounting(frame, beside, alone=alone)
        if mounting is not None and topic.laser == self._lasers[0]:
            # Scans of several lasers are seen from the middle of the robot.
            seen_from = mounting if alone else Mounting()
            self.frames.laser_sits(frame, seen_from, known=topic.is_known or not alone)
        return mounting

    def _combined(
        self, heard: Iterator[tuple[str, Mounting, Scan]], beside: BesideScans
    ) -> Iterator[Scan]:
        """Yield scans as the robot has them; one for several that belong together."""
        mountings = {laser.topic: Mounting() for laser in self._lasers}
        together = SeveralLasers(mountings)
        for topic, mounting, scan in heard:
            if len(mountings) == 1:
                yield beside.with_odometry(mounting.turned(scan), mounting)
                continue
            mountings[topic] = mounting
            for view in together.add(topic, scan):
                yield beside.with_odometry(view, Mounting())


class _Topic:
    """What is said at a laser's topic by one publisher at a time."""

    def __init__(self, laser: Laser, domain: int, tell: Callable[[str], None]) -> None:
        self.laser = laser
        self._names = TopicKeys(laser.topic, domain)
        self._native = zenoh.KeyExpr(self._names.native)
        self._refusals = Refusals(laser.topic, tell)
        self._key = ""
        self._one = OneLaser()
        self._mounted: str | None = None  # the frame whose mounting is known
        self._mounting: Mounting | None = None
        self.is_known = False
        """Whether somebody said where it sits."""
        self._heard = 0.0

    @property
    def keys(self) -> tuple[str, str]:
        return self._names.bridged, self._names.native

    def has(self, arrival: Arrival) -> bool:
        """Tell whether `arrival` is of this topic."""
        key = arrival.key
        return key == self._names.bridged or self._native.includes(zenoh.KeyExpr(key))

    def mounting(self, frame: str, beside: BesideScans, *, alone: bool) -> Mounting | None:
        """Return where the laser sits: as it was said, or as transforms say it.

        None where that is not known, and needed: of several lasers. What is known at first holds: a
        laser that were turned round while it maps would map nothing.
        """
        if self._mounting is None or self._mounted != self._one.frame:
            self._mounted = self._one.frame
            self._mounting = self.laser.mounting or beside.mounting(self.laser.topic, frame)
            self.is_known = self._mounting is not None
        if self._mounting is None and alone:
            self._mounting = Mounting()
        if self._mounting is None:
            self._refusals.add(
                f"nothing on {TF_STATIC} says where its frame {frame!r} sits; write it, as in"
                f" {self.laser.topic}@0.2,0,90 (metres ahead, to the left, degrees)"
            )
        return self._mounting

    def scan(self, arrival: Arrival, messages: ScanMessages, index: int) -> tuple[str, Scan] | None:
        """Return frame and scan in `arrival`; None where it was refused, or said twice over."""
        now = time.monotonic()
        if arrival.key != self._key and now - self._heard < FORGOTTEN:
            return None  # as where a bridge says again what rmw_zenoh has said
        try:
            dds_type = self._names.type_at(arrival.key)
            frame, scan = messages.framed_scan(self.laser.topic, dds_type, arrival.payload, index)
        except UnreadableMessageError as error:
            self._refusals.add(str(error))
            return None
        self._key, self._heard = arrival.key, now
        first = self._one.frame
        if not self._one.has_taken(frame, scan.stamp):
            self._refusals.add(
                f"is of a laser in frame {frame!r}, beside those of {first!r}; expected one laser,"
                " or each at a topic of its own and all of them named"
            )
            return None
        return frame, scan
