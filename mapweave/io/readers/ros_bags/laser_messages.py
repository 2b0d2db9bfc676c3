"""``sensor_msgs/LaserScan``, as it was recorded, to a scan; of several echoes a beam the first."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mapweave.scan.scan import Scan

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

LASER_SCAN = "sensor_msgs/msg/LaserScan"
MULTI_ECHO_SCAN = "sensor_msgs/msg/MultiEchoLaserScan"
LASER_SCANS = LASER_SCAN, MULTI_ECHO_SCAN
ODOMETRY = "nav_msgs/msg/Odometry"
TF_MESSAGE = "tf2_msgs/msg/TFMessage"
ROS1, CDR = "ros1", "cdr"
"""The encodings of ROS 1 and of ROS 2."""


class UnreadableMessageError(Exception):
    """A message that is no whole scan; its text says why."""


@dataclass(frozen=True, slots=True)
class Message:
    """A message of a bag.

    Attributes
    ----------
    topic, type
        Such as ``/scan`` and ``sensor_msgs/msg/LaserScan``.
    encoding
        ``cdr`` or ``ros1``.
    data
        As it was recorded.
    """

    topic: str
    type: str
    encoding: str
    data: bytes


class LaserDecoder:
    """Decodes laser scans by what every release of ROS means by one; needs `rosbags`.

    So it does transforms and odometry. The definitions that a bag brings along are not needed:
    these have not changed since ROS 1, and bags hold definitions of others that nobody can read.
    """

    def __init__(self) -> None:
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        self._ros1: Typestore = get_typestore(Stores.ROS1_NOETIC)
        # What `rosbags` knows of ROS 1 has no message of transforms.
        transforms = "geometry_msgs/TransformStamped[] transforms"
        self._ros1.register(get_types_from_msg(transforms, TF_MESSAGE))
        self._ros2: Typestore = get_typestore(Stores.ROS2_HUMBLE)

    def scan(self, message: Message, index: int) -> Scan:
        """Return the scan in `message`, the `index`-th of its topic.

        Raises
        ------
        UnreadableMessageError
            If it is not whole, or its angles are none.
        """
        return self.framed_scan(message, index)[1]

    def framed_scan(self, message: Message, index: int) -> tuple[str, Scan]:
        """Return the frame of the laser, and the scan in `message`; as `scan`."""
        laser = self.decode(message, message.type)
        measured = _first_echoes(laser) if message.type == MULTI_ECHO_SCAN else laser.ranges
        try:
            return str(laser.header.frame_id), _scan(laser, measured, index)
        except (ValueError, IndexError) as error:
            raise UnreadableMessageError(str(error) or "is not whole") from error

    def decode(self, message: Message, kind: str) -> Any:  # noqa: ANN401 - made from its definition
        """Return `message` as what its `kind` has.

        Raises
        ------
        UnreadableMessageError
            If it is not whole.
        """
        try:
            if message.encoding == ROS1:
                return self._ros1.deserialize_ros1(message.data, kind)
            return self._ros2.deserialize_cdr(message.data, kind)
        except (_serde_error(), struct.error, ValueError, IndexError) as error:
            raise UnreadableMessageError(f"is no whole {kind}") from error


def _serde_error() -> type[Exception]:
    from rosbags.serde import SerdeError

    return SerdeError


def _first_echoes(laser: Any) -> NDArray[np.float32]:  # noqa: ANN401
    """Return what came back first in each beam; what comes after was seen through glass or rain."""
    echoes = [beam.echoes[0] if len(beam.echoes) else math.nan for beam in laser.ranges]
    return np.array(echoes, dtype=np.float32)


def _scan(laser: Any, ranges: NDArray[np.float32], index: int) -> Scan:  # noqa: ANN401
    """Return the scan of a message."""
    with np.errstate(invalid="ignore"):  # NaN of the kind that signals
        measured = ranges.astype(np.float64)
    stamp = laser.header.stamp
    return Scan.of(
        measured,
        laser.angle_min,
        laser.angle_increment,
        range_min=laser.range_min if laser.range_min > 0 else 0.0,  # also where it is NaN
        range_max=laser.range_max if laser.range_max > 0 else math.inf,  # likewise
        index=index,
        stamp=stamp.sec + stamp.nanosec * 1e-9,
        time_increment=laser.time_increment if laser.time_increment > 0 else 0.0,
    )
