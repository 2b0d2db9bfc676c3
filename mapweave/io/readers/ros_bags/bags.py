"""The laser scans of ROS bags, by `rosbags`; what is whole of one that was cut off.

A recorder that is killed leaves no index, and half a message. `rosbags` reads whole bags only, so
each format brings a walk through what there is that needs no index.
"""

import struct
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Protocol, TypeAlias

from mapweave.errors import FileError, MissingExtraError
from mapweave.io.readers.options import ReadOptions
from mapweave.io.readers.ros_bags.beside_scans import BesideScans
from mapweave.io.readers.ros_bags.laser_messages import (
    LASER_SCANS,
    LaserDecoder,
    Message,
    UnreadableMessageError,
)
from mapweave.io.readers.ros_bags.one_laser import OneLaser
from mapweave.io.readers.tally import Tally
from mapweave.scan.mounting import Mounting
from mapweave.scan.scan import Scan
from mapweave.scan.several_lasers import SeveralLasers

EXPECTED = "expected a ROS bag (.bag, .db3 or .mcap) with sensor_msgs/LaserScan"
CUT_OFF = "is cut off or was not closed"
_DAMAGE: tuple[type[Exception], ...] = (
    # unpacking
    *(ValueError, RuntimeError, OSError, EOFError, struct.error),
    # rosbags, where a length or an id is wrong
    *(AssertionError, ArithmeticError, MemoryError, TypeError, LookupError),
)
"""What is raised for content that is damaged, beside the errors of `rosbags`' readers."""


@dataclass(frozen=True, slots=True)
class BagFormat:
    """A format of bags.

    Attributes
    ----------
    encoding
        Of its messages: ``cdr`` or ``ros1``.
    is_whole
        Tells whether the recorder came to its end.
    open_whole
        Opens the reader that `rosbags` has for it.
    walk
        Yields the whole messages of a bag that need not be whole.
    is_indexed
        Tells whether that reader finds all messages; by default it is trusted to.
    """

    encoding: str
    is_whole: Callable[[Path], bool]
    open_whole: Callable[[Path], AbstractContextManager[Any]]
    walk: Callable[[Path], Iterator[Message]]
    is_indexed: Callable[[Any], bool] = lambda _: True


class Bag(Protocol):
    """What is read of a bag."""

    @property
    def cut_off(self) -> str | None:
        """Why it is not all there; None where it is."""

    def lasers(self) -> dict[str, int]:
        """Return how many messages each laser topic has."""

    def scans(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield the messages of laser topics, in the order in which they were recorded."""

    def of_type(self, kind: str, ending: str = "") -> Iterator[Message]:
        """Yield the messages of a type at topics with this `ending`, in that order."""


@dataclass(frozen=True, slots=True)
class WholeBag:
    """A bag that a reader of `rosbags` has opened."""

    reader: Any
    encoding: str
    cut_off: str | None = None

    def lasers(self) -> dict[str, int]:
        """As of `Bag`."""
        counts: Counter[str] = Counter()
        for connection in self.reader.connections:
            if connection.msgtype in LASER_SCANS:
                counts[connection.topic] += connection.msgcount
        return dict(counts)

    def scans(self, topics: Collection[str]) -> Iterator[Message]:
        """As of `Bag`."""
        chosen = [
            connection
            for connection in self.reader.connections
            if connection.msgtype in LASER_SCANS and connection.topic in topics
        ]
        yield from self._messages(chosen)

    def of_type(self, kind: str, ending: str = "") -> Iterator[Message]:
        """As of `Bag`."""
        chosen = [c for c in self.reader.connections if c.msgtype == kind]
        return self._messages([c for c in chosen if c.topic.endswith(ending)])

    def _messages(self, chosen: Sequence[Any]) -> Iterator[Message]:
        for connection, _, data in self.reader.messages(chosen) if chosen else ():
            yield Message(connection.topic, connection.msgtype, self.encoding, data)


@dataclass(frozen=True, slots=True)
class CutBag:
    """A bag of which `walk` finds the whole messages."""

    path: Path
    walk: Callable[[Path], Iterator[Message]]
    cut_off: str | None = CUT_OFF

    def lasers(self) -> dict[str, int]:
        """As of `Bag`."""
        return dict(Counter(message.topic for message in self._of_types(LASER_SCANS)))

    def scans(self, topics: Collection[str]) -> Iterator[Message]:
        """As of `Bag`."""
        return (message for message in self._of_types(LASER_SCANS) if message.topic in topics)

    def of_type(self, kind: str, ending: str = "") -> Iterator[Message]:
        """As of `Bag`."""
        return (m for m in self._of_types((kind,)) if m.topic.endswith(ending))

    def _of_types(self, kinds: Sequence[str]) -> Iterator[Message]:
        """Yield messages up to where damage leads the walk astray."""
        try:
            yield from (m for m in self.walk(self.path) if m.type in kinds)
        except damage_errors():
            return  # told as `cut_off` already


@dataclass(frozen=True, slots=True)
class SplitBag:
    """A recording in several files, in their order."""

    parts: Sequence[Bag]

    @property
    def cut_off(self) -> str | None:
        """As of `Bag`."""
        return next((part.cut_off for part in self.parts if part.cut_off), None)

    def lasers(self) -> dict[str, int]:
        """As of `Bag`."""
        counts: Counter[str] = Counter()
        for part in self.parts:
            counts.update(part.lasers())
        return dict(counts)

    def scans(self, topics: Collection[str]) -> Iterator[Message]:
        """As of `Bag`."""
        for part in self.parts:
            yield from part.scans(topics)

    def of_type(self, kind: str, ending: str = "") -> Iterator[Message]:
        """As of `Bag`."""
        for part in self.parts:
            yield from part.of_type(kind, ending)


def open_bag(path: Path, bag_format: BagFormat, stack: ExitStack) -> Bag:
    """Open the bag at `path`; `stack` closes it.

    Raises
    ------
    MissingExtraError
        If `rosbags` is not installed.
    """
    check_installed()
    if bag_format.is_whole(path):
        try:
            reader = stack.enter_context(bag_format.open_whole(path))
        except damage_errors():
            return CutBag(path, bag_format.walk, "has an index that cannot be read")
        if bag_format.is_indexed(reader):
            return WholeBag(reader, bag_format.encoding)
        return CutBag(path, bag_format.walk, None)
    return CutBag(path, bag_format.walk)


def check_installed() -> None:
    """Raise MissingExtraError if `rosbags` is not installed: before any of it is asked for."""
    damage_errors()


def damage_errors() -> tuple[type[Exception], ...]:
    """Return what is raised for a damaged bag; MissingExtraError if `rosbags` is not installed."""
    try:
        from apsw import Error as SqliteError
        from rosbags.rosbag1 import ReaderError as Reader1Error
        from rosbags.rosbag2 import ReaderError as Reader2Error
    except ImportError as error:
        raise MissingExtraError("reading ROS bags", "bags") from error
    return (Reader1Error, Reader2Error, SqliteError, *_DAMAGE)


def read_bag(path: Path, bag_format: BagFormat, options: ReadOptions) -> Iterator[Scan]:
    """Yield the scans of a laser of the bag at `path`; parameters and errors as `read_scans`."""
    with ExitStack() as stack:
        yield from read_open_bag(path, open_bag(path, bag_format, stack), options)


def read_open_bag(path: Path, bag: Bag, options: ReadOptions) -> Iterator[Scan]:
    """Yield the scans of a laser of a bag, which is open, or of several as one."""
    tally = Tally("message", EXPECTED, cut_off=bag.cut_off)
    decoder = LaserDecoder()
    topics = choose_topics(path, bag, options.topic)
    beside = BesideScans.of(path, partial(_whole_of_type, bag), decoder, options, tally.assume)
    taken = _taken(bag, topics, decoder, tally)
    alone = len(topics) == 1
    try:
        for scan in _alone(taken, beside, options) if alone else _together(taken, topics, beside):
            tally.add_scan(scan)
            yield scan
        if problem := tally.problem():
            raise FileError(path, problem)
    finally:  # also where nobody wants the rest
        tally.warn(path, options)


_Taken: TypeAlias = tuple[str, str, Scan]
"""A topic, the frame of its laser, and a scan."""


def _taken(
    bag: Bag, topics: Sequence[str], decoder: LaserDecoder, tally: Tally
) -> Iterator[_Taken]:
    """Yield the whole scans of one laser of each topic."""
    lasers = {topic: OneLaser() for topic in topics}
    for message in _sound(bag.scans(topics), tally):
        tally.pieces += 1
        topic = message.topic
        try:
            frame, scan = decoder.framed_scan(message, tally.scans)
        except UnreadableMessageError as error:
            tally.add_damaged(tally.pieces, error)
            continue
        if lasers[topic].has_taken(frame, scan.stamp):
            yield topic, frame, scan
        else:
            tally.assume(f"what {topic} has in frame {frame!r} is of another laser, left out")


def _alone(taken: Iterator[_Taken], beside: BesideScans, options: ReadOptions) -> Iterator[Scan]:
    """Yield the scans of one laser as the robot has them."""
    for number, (_, frame, scan) in enumerate(taken):
        completed = beside.completed(frame, scan)
        if options.on_laser is not None and not number:
            options.on_laser(frame, beside.frames)
        yield completed


def _together(
    taken: Iterator[_Taken], topics: Sequence[str], beside: BesideScans
) -> Iterator[Scan]:
    """Yield the scans of several lasers as those of one that sits in the middle of the robot."""
    mountings = dict.fromkeys(topics, Mounting())
    together = SeveralLasers(mountings)
    for topic, frame, scan in taken:
        mountings[topic] = beside.mounting_needed(topic, frame)
        for view in together.add(topic, scan):
            yield beside.with_odometry(view, Mounting())


def _whole_of_type(bag: Bag, kind: str, ending: str = "") -> Iterator[Message]:
    """Yield those up to where the bag is damaged: reading its scans tells of it."""
    try:
        yield from bag.of_type(kind, ending)
    except damage_errors():
        return


def _sound(messages: Iterator[Message], tally: Tally) -> Iterator[Message]:
    """Yield `messages` up to where the bag turns out to be damaged."""
    try:
        yield from messages
    except damage_errors() as error:
        tally.cut_off = f"cannot be read any further ({error})"


def choose_topics(path: Path, bag: Bag, asked: str | None) -> tuple[str, ...]:
    """Return the laser topics to read: those asked for, joined by ``+``, else the only one.

    Raises
    ------
    FileError
        If there is no such topic, none at all, or several of which none was asked for.
    """
    lasers = {topic: count for topic, count in sorted(bag.lasers().items()) if count}
    listed = ", ".join(f"{topic} ({count} scans)" for topic, count in lasers.items())
    if not lasers:
        cut_off = f"{bag.cut_off}; " if bag.cut_off else ""
        raise FileError(path, f"{cut_off}holds no laser scan; {EXPECTED}")
    if asked is None:
        if len(lasers) > 1:
            every = "+".join(lasers)
            raise FileError(
                path, f"has several lasers, {listed}; name one with --topic, or all: {every}"
            )
        return tuple(lasers)
    found = {
        name: next((t for t in lasers if _is_same(t, name)), None) for name in asked.split("+")
    }
    for name, topic in found.items():
        if topic is None:
            raise FileError(path, f"has no laser scans on topic {name}; there are {listed}")
    return tuple(dict.fromkeys(topic for topic in found.values() if topic is not None))


def _is_same(topic: str, name: str) -> bool:
    return topic.strip("/") == name.strip("/")
