"""Scans as ROS has them: messages of 32-bit numbers, and bags of ROS 1 and ROS 2."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from mapweave.geometry.arrays import FloatArray
from mapweave.io.readers.ros_bags.laser_messages import LASER_SCAN
from mapweave.scan.scan import Scan

ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_JAZZY)


def ranges_of(scan: Scan) -> FloatArray:
    """(n,) its ranges [m] as 32-bit numbers hold them; infinite where nothing came back."""
    return np.where(scan.hits, scan.ranges, np.inf).astype(np.float32).astype(np.float64)


def angles_of(scan: Scan) -> dict[str, float]:
    """Return where its beams point, as 32-bit numbers hold that [rad]."""
    step = float(np.ptp(scan.angles)) / (len(scan.angles) - 1)
    return {
        "angle_min": float(np.float32(scan.angles[0])),
        "angle_increment": float(np.float32(step)),
    }


def laser_scan(store: Typestore, scan: Scan, **header: int) -> object:
    """Return `scan` as a ``LaserScan``; `header` has what else that of a release has."""
    types, angles = store.types, angles_of(scan)
    second = int(scan.stamp // 1)
    stamp = types["builtin_interfaces/msg/Time"](
        sec=second, nanosec=round((scan.stamp - second) * 1e9)
    )
    return types[LASER_SCAN](
        header=types["std_msgs/msg/Header"](stamp=stamp, frame_id="laser", **header),
        **angles,
        angle_max=float(scan.angles[-1]),
        time_increment=0.0,
        scan_time=0.0,
        range_min=0.0,
        range_max=1000.0,
        ranges=ranges_of(scan).astype(np.float32),
        intensities=np.zeros(0, dtype=np.float32),
    )


def ros1_bag(folder: Path, scans: Sequence[Scan]) -> Path:
    """Write `scans` as a bag of ROS 1 in `folder`, and return it."""
    with Writer1(folder / "scans.bag") as writer:
        connection = writer.add_connection("/scan", LASER_SCAN, typestore=ROS1)
        for number, scan in enumerate(scans):
            message = laser_scan(ROS1, scan, seq=number)
            data = bytes(ROS1.serialize_ros1(message, LASER_SCAN))
            writer.write(connection, number * 10**8, data)
    return folder / "scans.bag"


def ros2_bag(storage: StoragePlugin, folder: Path, scans: Sequence[Scan]) -> Path:
    """Write `scans` as a bag of ROS 2 in `folder`, and return it."""
    with Writer2(folder / "scans", version=9, storage_plugin=storage) as writer:
        connection = writer.add_connection("/scan", LASER_SCAN, typestore=ROS2)
        for number, scan in enumerate(scans):
            data = bytes(ROS2.serialize_cdr(laser_scan(ROS2, scan), LASER_SCAN))
            writer.write(connection, number * 10**8, data)
    return folder / "scans"
