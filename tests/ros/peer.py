"""``python peer.py HOST PORT FOLDER LOG``: `zenoh-ros2-sdk` says the scans of a log at ``/scan``.

A ROS 2 program that mapweave has no part in: it has its own keys, hashes and encoding. It fetches
definitions of messages from the internet; here they are written to FOLDER beforehand.
"""

import sys
import time
from pathlib import Path

import numpy as np
import zenoh_ros2_sdk
from rosbags.typesys import Stores, get_typestore
from zenoh_ros2_sdk.message_registry import get_registry
from zenoh_ros2_sdk.session import ZenohSession

from mapweave.io.readers import read_scans

LASER_SCAN = "sensor_msgs/msg/LaserScan"
NEEDED = (LASER_SCAN, "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
PERIOD = 0.05  # [s] between scans


def write_definitions(folder: Path) -> None:
    """Write the definitions that the peer reads, one file a message."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for name in NEEDED:
        package, _, message = name.split("/")
        file = folder / package / "msg" / f"{message}.msg"
        file.parent.mkdir(parents=True, exist_ok=True)
        definition, _ = store.generate_msgdef(name, ros_version=2)
        file.write_text(definition.partition("=" * 80)[0])


def main(host: str, port: str, folder: str, log: str) -> None:
    """Publish, once somebody listens."""
    write_definitions(Path(folder))
    session = ZenohSession.get_instance(host, int(port))
    get_registry().messages_dir = Path(folder)
    publisher = zenoh_ros2_sdk.ROS2Publisher(
        "/scan", LASER_SCAN, domain_id=7, router_ip=host, router_port=int(port)
    )
    types = session.store.types
    while not publisher.pub.matching_status.matching:
        time.sleep(PERIOD)
    for scan in read_scans(log):
        sec = int(scan.stamp)
        stamp = types["builtin_interfaces/msg/Time"](sec=sec, nanosec=int((scan.stamp - sec) * 1e9))
        publisher.publish(
            header=types["std_msgs/msg/Header"](stamp=stamp, frame_id="laser"),
            angle_min=scan.angles[0],
            angle_max=scan.angles[-1],
            angle_increment=scan.angles[1] - scan.angles[0],
            time_increment=0.0,
            scan_time=0.0,
            range_min=0.0,
            range_max=100.0,
            ranges=np.where(scan.hits, scan.ranges, np.inf).astype(np.float32),
            intensities=np.zeros(0, dtype=np.float32),
        )
        time.sleep(PERIOD)
    publisher.close()
    session.session.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
