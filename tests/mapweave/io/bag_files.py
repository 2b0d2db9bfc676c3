"""Small ROS bags, written by the writers of `rosbags`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from mapweave.geometry.arrays import FloatArray
from mapweave.io.readers.ros_bags.laser_messages import LASER_SCAN, MULTI_ECHO_SCAN

ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)


@dataclass(frozen=True)
class Laser:
    """What a driver publishes; angles and distances as 32-bit numbers.

    With `beyond` its beams come back twice but the first, which does not at all: (n,) how much
    farther away the second time [m].
    """

    ranges: FloatArray
    angle_min: float = -1.0
    angle_increment: float = 0.003
    range_min: float = 0.1
    range_max: float = 10.0
    frame: str = "laser"
    beyond: FloatArray | None = None

    @property
    def kind(self) -> str:
        """Type of the message."""
        return LASER_SCAN if self.beyond is None else MULTI_ECHO_SCAN

    def message(self, number: int, *, ros1: bool = False) -> object:
        """Return it as a message, the `number`-th."""
        store = ROS1 if ros1 else ROS2
        time = store.types["builtin_interfaces/msg/Time"](sec=100 + number, nanosec=250_000_000)
        make = store.types["std_msgs/msg/Header"]
        header = (
            make(seq=number, stamp=time, frame_id=self.frame)
            if ros1
            else make(stamp=time, frame_id=self.frame)
        )
        ranges: Any = np.asarray(self.ranges, dtype=np.float32)
        intensities: Any = np.zeros(0, dtype=np.float32)
        if self.beyond is not None:
            echo = store.types["sensor_msgs/msg/LaserEcho"]
            both = np.column_stack([self.ranges, self.ranges + self.beyond]).astype(np.float32)
            ranges = [echo(echoes=each[: 2 * (beam > 0)]) for beam, each in enumerate(both)]
            intensities = []
        return store.types[self.kind](
            header=header,
            angle_min=self.angle_min,
            angle_max=self.angle_min + self.angle_increment * len(self.ranges),
            angle_increment=self.angle_increment,
            time_increment=0.0,
            scan_time=0.1,
            range_min=self.range_min,
            range_max=self.range_max,
            ranges=ranges,
            intensities=intensities,
        )


def lasers(count: int, beams: int = 40) -> list[Laser]:
    """Return scans that cannot be compressed away, so that chunks have some length."""
    generator = np.random.default_rng(7)
    return [Laser(generator.uniform(0.5, 9.0, beams)) for _ in range(count)]


def write_bag(path: Path, topics: dict[str, list[Laser]], compression: str = "") -> Path:
    """Write a ROS 1 bag; return it."""
    writer = Writer1(path)
    if compression:
        writer.set_compression(Writer1.CompressionFormat[compression.upper()])
    with writer:
        for topic, scans in topics.items():
            connection = writer.add_connection(topic, _kind(scans), typestore=ROS1)
            for number, scan in enumerate(scans):
                data = ROS1.serialize_ros1(scan.message(number, ros1=True), scan.kind)
                writer.write(connection, number * 10**8, data)
    return path


def write_recording(
    folder: Path, topics: dict[str, list[Laser]], storage: str, compression: str = ""
) -> Path:
    """Write a ROS 2 recording, in SQLite or MCAP; return its one file of messages."""
    plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
    writer = Writer2(folder, version=9, storage_plugin=plugin)
    if compression:
        writer.set_compression(CompressionMode[compression.upper()], CompressionFormat.ZSTD)
    with writer:
        for topic, scans in topics.items():
            connection = writer.add_connection(topic, _kind(scans), typestore=ROS2)
            for number, scan in enumerate(scans):
                data = ROS2.serialize_cdr(scan.message(number), scan.kind)
                writer.write(connection, number * 10**8, data)
    (file,) = (path for path in folder.iterdir() if path.suffix != ".yaml")
    return file


def _kind(scans: list[Laser]) -> str:
    return scans[0].kind if scans else LASER_SCAN
