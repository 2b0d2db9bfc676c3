"""``sensor_msgs/LaserScan`` off the wire, to a scan; what is none is refused in words."""

from typing import Any

from mapweave.errors import ArgumentError, MissingExtraError
from mapweave.io.readers.ros_bags.laser_messages import (
    CDR,
    LASER_SCANS,
    LaserDecoder,
    Message,
    UnreadableMessageError,
)
from mapweave.scan.scan import Scan, check_beams
from mapweave_ros.topics import DDS_LASER_SCAN, dds_type_of

KINDS = {dds_type_of(kind): kind for kind in LASER_SCANS}
MAX_BYTES = 2**20  # of a message: ten thousand beams and their intensities are a tenth of it
NOISE = (AssertionError, TypeError, MemoryError)  # what rosbags makes of it


class ScanMessages:
    """Decodes the messages of lasers.

    Raises
    ------
    MissingExtraError
        If `rosbags` is not installed.
    """

    def __init__(self) -> None:
        try:
            self._decoder = LaserDecoder()
        except ImportError as error:
            raise MissingExtraError("a ROS 2 topic", "ros2") from error

    def scan(self, topic: str, dds_type: str | None, payload: bytes, index: int) -> Scan:
        """Return the scan in `payload`; as `framed_scan`."""
        return self.framed_scan(topic, dds_type, payload, index)[1]

    def framed_scan(
        self, topic: str, dds_type: str | None, payload: bytes, index: int
    ) -> tuple[str, Scan]:
        """Return the laser's frame, and the scan in `payload`.

        Parameters
        ----------
        dds_type
            As the key says it; None where it does not, and it is taken for a ``LaserScan``.
        index
            The scan's.

        Raises
        ------
        UnreadableMessageError
            If there is none; its text says why.
        """
        kind = KINDS.get(dds_type or DDS_LASER_SCAN)
        if kind is None:
            raise UnreadableMessageError(f"is a {dds_type}; expected a {DDS_LASER_SCAN}")
        _check_size(payload)
        try:
            frame, scan = self._decoder.framed_scan(Message(topic, kind, CDR, payload), index)
        except NOISE as error:
            raise UnreadableMessageError("is no LaserScan") from error
        try:
            return frame, check_beams(scan)
        except ArgumentError as error:
            raise UnreadableMessageError(str(error)) from error

    def decode(self, topic: str, kind: str, payload: bytes) -> Any:  # noqa: ANN401 - made at run time
        """Return another message, of a `kind` such as ``nav_msgs/msg/Odometry``.

        Raises
        ------
        UnreadableMessageError
            If it is none.
        """
        _check_size(payload)
        try:
            return self._decoder.decode(Message(topic, kind, CDR, payload), kind)
        except NOISE as error:
            raise UnreadableMessageError(f"is no {kind}") from error


def _check_size(payload: bytes) -> None:
    if len(payload) > MAX_BYTES:
        raise UnreadableMessageError(f"has {len(payload)} bytes; expected at most {MAX_BYTES}")
