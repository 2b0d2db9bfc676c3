"""What a ROS 2 network says beside scans: where lasers sit, and the robot's odometry."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace

import zenoh
import zenoh.ext as ze

from mapweave.geometry import se2
from mapweave.io.readers.odometry_track import OdometryTrack
from mapweave.io.readers.ros_bags.frames import (
    TF,
    TF_STATIC,
    TiltedError,
    odometry_in,
)
from mapweave.io.readers.ros_bags.laser_messages import (
    ODOMETRY,
    TF_MESSAGE,
    UnreadableMessageError,
)
from mapweave.io.refusals import Refusals
from mapweave.scan.mounting import Mounting
from mapweave.scan.scan import Scan
from mapweave_protocol.link.inbox import Arrival
from mapweave_ros.robot.frames import RobotFrames
from mapweave_ros.scan_messages import ScanMessages
from mapweave_ros.topics import TopicKeys, dds_type_of

REMEMBERED = 400  # poses of odometry: some seconds of it
PATIENCE = 50  # scans in a row of which odometry says nothing


def kind_of_odometry(topic: str) -> str:
    """Return the type of the messages at a topic of odometry: transforms if it is called ``tf``."""
    return TF_MESSAGE if topic.endswith(TF) else ODOMETRY


class BesideScans:
    """Hears transforms that do not change, and odometry where it is asked for.

    Parameters
    ----------
    domain
        Of ROS 2.
    frames
        Take what is said of transforms; of those that change where they are followed.
    odometry
        Its topic, such as ``/odom``, or one called ``tf``; None for none.
    tell, tell_news
        Told what is refused, and what of a laser's place is found.
    """

    def __init__(
        self,
        messages: ScanMessages,
        domain: int,
        frames: RobotFrames,
        odometry: str | None,
        tell: Callable[[str], None],
        tell_news: Callable[[str], None],
    ) -> None:
        self._messages = messages
        self._tell = tell
        self._tell_news = tell_news
        self._frames = frames
        self._track = OdometryTrack(REMEMBERED)
        self._asked = odometry
        self._heard = {TF_STATIC: _Heard(TF_STATIC, domain, TF_MESSAGE, tell)}
        if frames.followed:
            self._heard[TF] = _Heard(TF, domain, TF_MESSAGE, tell)
        if odometry is not None:
            kind = kind_of_odometry(odometry)
            self._heard[odometry] = _Heard(odometry, domain, kind, tell)
        self._said: set[str] = set()
        self._without = 0  # scans in a row, though odometry is heard

    def subscribe(
        self, session: zenoh.Session, put: Callable[[zenoh.Sample], None], stack: ExitStack
    ) -> None:
        """Subscribe, until `stack` is closed; transforms that were said already are asked for."""
        for topic, heard in self._heard.items():
            for key in heard.keys:
                if topic == TF_STATIC:
                    history = ze.HistoryConfig(detect_late_publishers=True)
                    stack.enter_context(
                        ze.declare_advanced_subscriber(session, key, put, history=history)
                    )
                else:
                    stack.enter_context(session.declare_subscriber(key, put))

    def takes(self, arrival: Arrival) -> str | None:
        """Take `arrival`, if it is of this; return its topic, None if it is not."""
        topic = next((t for t, heard in self._heard.items() if heard.has(arrival)), None)
        if topic is None:
            return None
        decoded = self._heard[topic].decoded(arrival, self._messages)
        if decoded is None:
            return topic
        if topic == TF_STATIC:
            self._frames.say_fixed(decoded)
        if topic == TF and self._frames.followed:
            self._frames.say_moving(decoded)
        if topic == self._asked:
            for stamp, pose in odometry_in(decoded):
                self._track.add(stamp, pose)
        return topic

    def mounting(self, topic: str, frame: str) -> Mounting | None:
        """Return where a laser sits; None where it is not known, or not level."""
        try:
            found = self._frames.mounting(frame)
        except TiltedError as error:
            self._tell_once(f"{topic}: the laser in frame {frame!r} {error}; expected a level one")
            return None
        if found is not None:
            upside_down = ", upside down" if found.upside_down else ""
            news = (
                f"{topic} sits at {found.x:.2f} m, {found.y:.2f} m, {found.degrees:.0f}°"
                f"{upside_down}, by {TF_STATIC}"
            )
            self._tell_once(news, self._tell_news)
        return found

    def with_odometry(self, scan: Scan, mounting: Mounting) -> Scan:
        """Return `scan` with what odometry says of its moment, if it does."""
        robot = self._track.at(scan.stamp)
        self._without = self._without + 1 if robot is None else 0
        if self._asked is not None and self._without == PATIENCE:
            self._tell_once(
                f"{self._asked} does not say where the robot was when its scans were taken;"
                " expected poses in a parent called odom, with stamps of the same clock"
            )
        if robot is None:
            return scan
        return replace(scan, odometry=se2.compose(robot, [mounting.x, mounting.y, 0.0]))

    def _tell_once(self, message: str, tell: Callable[[str], None] | None = None) -> None:
        if message not in self._said:
            self._said.add(message)
            (tell or self._tell)(message)


class _Heard:
    """A topic of one type."""

    def __init__(self, topic: str, domain: int, kind: str, tell: Callable[[str], None]) -> None:
        self._topic, self._kind = topic, kind
        self._names = TopicKeys(topic, domain)
        self._native = zenoh.KeyExpr(self._names.native)
        self._refusals = Refusals(topic, tell)

    @property
    def keys(self) -> Iterator[str]:
        yield self._names.bridged
        yield self._names.native

    def has(self, arrival: Arrival) -> bool:
        key = arrival.key
        return key == self._names.bridged or self._native.includes(zenoh.KeyExpr(key))

    def decoded(self, arrival: Arrival, messages: ScanMessages) -> object | None:
        """Return the message in `arrival`; None where it was refused."""
        dds_type, expected = self._names.type_at(arrival.key), dds_type_of(self._kind)
        if dds_type not in (None, expected):
            self._refusals.add(f"is a {dds_type}; expected a {expected}")
            return None
        try:
            decoded: object = messages.decode(self._topic, self._kind, arrival.payload)
        except UnreadableMessageError as error:
            self._refusals.add(str(error))
            return None
        return decoded
