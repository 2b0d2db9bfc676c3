"""What a bag says beside its scans: where the laser sits, and the robot's odometry."""

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

from mapweave.errors import FileError
from mapweave.geometry import se2
from mapweave.io.readers.odometry_track import OdometryTrack
from mapweave.io.readers.options import ReadOptions
from mapweave.io.readers.ros_bags.frames import (
    TF,
    TF_STATIC,
    StaticFrames,
    TiltedError,
    odometry_in,
)
from mapweave.io.readers.ros_bags.laser_messages import (
    ODOMETRY,
    TF_MESSAGE,
    LaserDecoder,
    Message,
    UnreadableMessageError,
)
from mapweave.scan.mounting import Mounting
from mapweave.scan.scan import Scan


class OfType(Protocol):
    """Yields the messages of a type, at topics with an ending."""

    def __call__(self, kind: str, ending: str = "") -> Iterator[Message]:
        """Yield them."""


@dataclass(frozen=True, slots=True)
class BesideScans:
    """Completes scans by what else a bag holds.

    A scan of a laser whose place on the robot is known has its angles as the robot has them: 0 is
    straight ahead, however the laser is turned, and whichever side of it is up.
    """

    path: Path
    frames: StaticFrames
    odometry: OdometryTrack | None

    @classmethod
    def of(
        cls,
        path: Path,
        of_type: OfType,
        decoder: LaserDecoder,
        options: ReadOptions,
        assume: Callable[[str], None],
    ) -> "BesideScans":
        """Read it, all at once.

        Parameters
        ----------
        of_type
            As of a bag.
        assume
            Told what had to be assumed, such as that a message that cannot be read says nothing.

        Raises
        ------
        FileError
            If odometry is asked for, and there is none, or several of which none was named.
        """
        frames = StaticFrames()
        for message in of_type(TF_MESSAGE, TF_STATIC):
            if (decoded := _decoded(message, TF_MESSAGE, decoder, assume)) is not None:
                frames.add(decoded)
        return cls(path, frames, _odometry(path, of_type, decoder, options, assume))

    def completed(self, frame: str, scan: Scan) -> Scan:
        """Return `scan`, taken in `frame`, as the robot has it, with the odometry of its moment."""
        mounting = self._mounting(frame) or Mounting()
        return self.with_odometry(mounting.turned(scan), mounting)

    def with_odometry(self, scan: Scan, mounting: Mounting) -> Scan:
        """Return `scan`, turned as the robot is, with the odometry of its moment where it was."""
        robot = None if self.odometry is None else self.odometry.at(scan.stamp)
        if robot is None:
            return scan
        # Turned as the robot is, but where the laser is.
        return replace(scan, odometry=se2.compose(robot, [mounting.x, mounting.y, 0.0]))

    def mounting_needed(self, topic: str, frame: str) -> Mounting:
        """Return where one of several lasers sits, which has to be known.

        Raises
        ------
        FileError
            If it is not, or the laser does not look level.
        """
        found = self._mounting(frame)
        if found is None:
            raise FileError(
                self.path,
                f"nothing on {TF_STATIC} says where the laser of {topic} sits, in frame {frame!r};"
                " name one laser with --topic",
            )
        return found

    def _mounting(self, frame: str) -> Mounting | None:
        try:
            return self.frames.mounting(frame)
        except TiltedError as error:
            raise FileError(
                self.path, f"the laser in frame {frame!r} {error}; expected one that looks level"
            ) from error


def _odometry(
    path: Path,
    of_type: OfType,
    decoder: LaserDecoder,
    options: ReadOptions,
    assume: Callable[[str], None],
) -> OdometryTrack | None:
    """Return the odometry that is asked for; None where none is."""
    asked = options.odometry_topic
    if not options.odometry and asked is None:
        return None
    kind = TF_MESSAGE if asked is not None and asked.endswith(TF) else ODOMETRY
    topics: Counter[str] = Counter()
    track = OdometryTrack()
    for message in of_type(kind):
        topics[message.topic] += 1
        if asked is None or message.topic.strip("/") == asked.strip("/"):
            decoded = _decoded(message, kind, decoder, assume)
            for stamp, pose in () if decoded is None else odometry_in(decoded):
                track.add(stamp, pose)
    listed = ", ".join(f"{topic} ({count})" for topic, count in sorted(topics.items())) or "none"
    if asked is None and len(topics) > 1:
        raise FileError(path, f"has odometry at {listed}; name one with --odometry TOPIC")
    if asked is None and not topics:
        raise FileError(path, f"has no {ODOMETRY}; expected one, or --odometry /tf, or none")
    if asked is not None and not any(t.strip("/") == asked.strip("/") for t in topics):
        holding = "; its /tf has: --odometry /tf" if _tf_tells(of_type, decoder) else ""
        raise FileError(path, f"has no odometry at {asked}; there is {listed}{holding}")
    return track


def _tf_tells(of_type: OfType, decoder: LaserDecoder) -> bool:
    """Whether transforms have odometry."""
    transforms = (_decoded(m, TF_MESSAGE, decoder, lambda _: None) for m in of_type(TF_MESSAGE, TF))
    return any(any(odometry_in(decoded)) for decoded in transforms if decoded is not None)


def _decoded(
    message: Message, kind: str, decoder: LaserDecoder, assume: Callable[[str], None]
) -> Any | None:  # noqa: ANN401 - made from its definition
    """Return what `message` says; None, and `assume` is told, where it cannot be read."""
    try:
        return decoder.decode(message, kind)
    except UnreadableMessageError:
        assume(f"messages of {message.topic} that cannot be read say nothing")
        return None
