"""Transforms and odometry as messages, of ROS 2 or of ROS 1."""

import math
from typing import Any, TypeAlias

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

Made: TypeAlias = Any
"""What is made at run time from its definition."""

ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
TF_MESSAGE, ODOMETRY = "tf2_msgs/msg/TFMessage", "nav_msgs/msg/Odometry"

ROS1.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", TF_MESSAGE))


def quaternion(yaw: float, roll: float = 0.0) -> tuple[float, float, float, float]:
    """Return x, y, z, w of a turn about x by `roll`, then about z by `yaw` [rad]."""
    (sr, cr), (sy, cy) = ((math.sin(a / 2), math.cos(a / 2)) for a in (roll, yaw))
    return sr * cy, sr * sy, cr * sy, cr * cy


def _header(store: Made, frame: str, stamp: float) -> Made:
    sec = int(stamp // 1)
    time = store.types["builtin_interfaces/msg/Time"](sec=sec, nanosec=int((stamp - sec) * 1e9))
    more = {"seq": 0} if store is ROS1 else {}
    return store.types["std_msgs/msg/Header"](stamp=time, frame_id=frame, **more)


def transform(
    parent: str,
    child: str,
    x: float,
    y: float,
    yaw: float,
    roll: float = 0.0,
    stamp: float = 0.0,
    store: Made = ROS2,
) -> Made:
    """Return a ``TransformStamped``."""
    types = store.types
    qx, qy, qz, qw = quaternion(yaw, roll)
    return types["geometry_msgs/msg/TransformStamped"](
        header=_header(store, parent, stamp),
        child_frame_id=child,
        transform=types["geometry_msgs/msg/Transform"](
            translation=types["geometry_msgs/msg/Vector3"](x=x, y=y, z=0.2),
            rotation=types["geometry_msgs/msg/Quaternion"](x=qx, y=qy, z=qz, w=qw),
        ),
    )


def tf(*transforms: Made, store: Made = ROS2) -> Made:
    """Return a ``TFMessage``."""
    return store.types[TF_MESSAGE](transforms=list(transforms))


def odometry(stamp: float, x: float, y: float, yaw: float, store: Made = ROS2) -> Made:
    """Return an ``Odometry``."""
    types = store.types
    qx, qy, qz, qw = quaternion(yaw)
    zero = types["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=0.0)
    pose = types["geometry_msgs/msg/Pose"](
        position=types["geometry_msgs/msg/Point"](x=x, y=y, z=0.0),
        orientation=types["geometry_msgs/msg/Quaternion"](x=qx, y=qy, z=qz, w=qw),
    )
    return types[ODOMETRY](
        header=_header(store, "odom", stamp),
        child_frame_id="base_link",
        pose=types["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=np.zeros(36)),
        twist=types["geometry_msgs/msg/TwistWithCovariance"](
            twist=types["geometry_msgs/msg/Twist"](linear=zero, angular=zero),
            covariance=np.zeros(36),
        ),
    )


def cdr(message: Made, kind: str) -> bytes:
    """Return a message of ROS 2 as it goes over the wire."""
    return bytes(ROS2.serialize_cdr(message, kind))
