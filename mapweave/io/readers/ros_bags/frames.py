"""Where sensors sit on a robot, as ``/tf_static`` says it: transforms that do not change."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from mapweave.geometry.arrays import FloatArray
from mapweave.scan.mounting import Mounting

TF_STATIC, TF = "/tf_static", "/tf"
MAX_TILT = math.radians(15)  # of a laser that looks level: at 10 m it sees what is 2.6 m higher
MAX_FRAMES = 1000  # that are remembered: what comes from a network is bounded


class TiltedError(Exception):
    """A laser that does not look level; its text says how far from it."""


class StaticFrames:
    """Which frame is fixed to which."""

    def __init__(self) -> None:
        self._parents: dict[str, tuple[str, FloatArray]] = {}  # and (4, 4) child to parent

    def add(self, message: Any) -> None:  # noqa: ANN401 - made at run time from its definition
        """Take what a ``TFMessage`` says; what is no rigid motion is left out."""
        for transform in message.transforms:
            child, parent = (
                frame_name(transform.child_frame_id),
                frame_name(transform.header.frame_id),
            )
            motion = rigid(transform.transform)
            if motion is not None and child != parent and len(self._parents) < MAX_FRAMES:
                self._parents[child] = parent, motion

    def mounting(self, frame: str) -> Mounting | None:
        """Return where a laser of `frame` sits on its robot; None where nothing is known of it.

        The robot's frame is the one that all others are fixed to, such as ``base_link``.

        Raises
        ------
        TiltedError
            If it looks up or down.
        """
        found = self._placed(frame)
        if found is None:
            return None
        _, placed = found
        upright = placed[2, 2]
        tilt = math.acos(min(1.0, abs(upright)))
        if tilt > MAX_TILT:
            raise TiltedError(f"is tilted by {math.degrees(tilt):.0f}°")
        x, y = placed[:2, 3].tolist()
        return Mounting(x, y, math.atan2(placed[1, 0], placed[0, 0]), bool(upright < 0))

    def fixed(self, frame: str) -> tuple[str, FloatArray] | None:
        """Return what a frame is fixed to, and its (3,) pose there [m, m, rad]; None for nothing.

        Seen from above: how it is tilted is left out.
        """
        found = self._placed(frame)
        return None if found is None else (found[0], _on_the_floor(found[1]))

    def _placed(self, frame: str) -> tuple[str, FloatArray] | None:
        """Return the frame that all others are fixed to, and (4, 4) of `frame` in it."""
        name = frame_name(frame)
        if name not in self._parents:
            return None
        placed, seen = np.eye(4), {name}
        while name in self._parents:
            name, motion = self._parents[name]
            placed = motion @ placed
            if name in seen:
                return None  # each is fixed to the other
            seen.add(name)
        return name, placed


def rigid(transform: Any) -> FloatArray | None:  # noqa: ANN401
    """(4, 4) of a ``Transform`` or ``Pose``; None where it is no rigid motion."""
    place = transform.translation if hasattr(transform, "translation") else transform.position
    turn = transform.rotation if hasattr(transform, "rotation") else transform.orientation
    quaternion = np.array([turn.x, turn.y, turn.z, turn.w], dtype=np.float64)
    position = np.array([place.x, place.y, place.z], dtype=np.float64)
    norm = float(np.linalg.norm(quaternion))
    if not (np.isfinite(position).all() and math.isfinite(norm) and norm > 0.5):
        return None
    x, y, z, w = quaternion / norm
    motion = np.eye(4)
    motion[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    motion[:3, 3] = position
    return motion


def planar(transform: Any) -> FloatArray | None:  # noqa: ANN401
    """(3,) of a ``Transform`` or ``Pose`` on the floor [m, m, rad]; None where it is none."""
    motion = rigid(transform)
    if motion is None:
        return None
    return _on_the_floor(motion)


def _on_the_floor(motion: FloatArray) -> FloatArray:
    """(3,) of a (4, 4) motion [m, m, rad]."""
    return np.array([motion[0, 3], motion[1, 3], math.atan2(motion[1, 0], motion[0, 0])])


def odometry_in(message: Any) -> Iterable[tuple[float, FloatArray]]:  # noqa: ANN401
    """Yield stamps [s] and poses (3,) of the robot in its frame of odometry.

    Of an ``Odometry`` message, or of a ``TFMessage`` those whose parent is called ``odom``.
    """
    if not hasattr(message, "transforms"):
        stamped = [(message.header, message.pose.pose)]
    else:
        stamped = [
            (each.header, each.transform)
            for each in message.transforms
            if frame_name(each.header.frame_id).endswith("odom")
        ]
    for header, value in stamped:
        pose = planar(value)
        if pose is not None:
            yield header.stamp.sec + header.stamp.nanosec * 1e-9, pose


def frame_name(frame: str) -> str:
    """Return a frame's name without the slash with which ROS 1 wrote it once."""
    return frame.lstrip("/")
