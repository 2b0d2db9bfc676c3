"""The robot's own tree of frames, and which frame of it a pose of its scans places in a map.

A frame has one parent. So the map may only be said to be the parent of the topmost frame that the
robot has: ``odom`` where somebody says how ``base_link`` moves in it, else what all is fixed to.
"""

import threading
from dataclasses import dataclass
from typing import Any

import numpy as np

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.io.readers.odometry_track import OdometryTrack
from mapweave.io.readers.ros_bags.frames import MAX_FRAMES, StaticFrames, frame_name, planar
from mapweave.scan.mounting import Mounting

REMEMBERED = 400  # poses of a moving frame: some seconds of it


@dataclass(frozen=True, slots=True)
class _Laser:
    """The frame of a laser, and where it was taken to sit; `known` unless that is a guess."""

    frame: str
    mounting: Mounting
    known: bool


class RobotFrames:
    """Keeps what `/tf_static` and `/tf` say; filled by one thread and asked by another."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._static = StaticFrames()
        self._parents: dict[str, str] = {}  # of frames that move
        self._tracks: dict[str, OdometryTrack] = {}  # of those of them that place the robot
        self._laser: _Laser | None = None
        self._own_map: str | None = None

    def follow(self, own_map: str) -> None:
        """Have moving frames followed, of which `own_map` is what we say ourselves."""
        self._own_map = own_map

    @property
    def followed(self) -> bool:
        """Whether moving frames are to be told."""
        return self._own_map is not None

    def say_fixed(self, message: Any) -> None:  # noqa: ANN401 - made at run time
        """Take a ``TFMessage`` of transforms that do not change."""
        with self._lock:
            self._static.add(message)

    def say_moving(self, message: Any) -> None:  # noqa: ANN401
        """Take a ``TFMessage`` of transforms of a moment."""
        with self._lock:
            for transform in message.transforms:
                child = frame_name(transform.child_frame_id)
                parent = frame_name(transform.header.frame_id)
                if child == parent or parent == self._own_map:
                    continue
                if child in self._parents or len(self._parents) < MAX_FRAMES:
                    self._parents[child] = parent
                pose = planar(transform.transform) if child in self._tracks else None
                if pose is not None:
                    stamp = transform.header.stamp
                    self._tracks[child].add(stamp.sec + stamp.nanosec * 1e-9, pose)

    def mounting(self, frame: str) -> Mounting | None:
        """As `StaticFrames.mounting`."""
        with self._lock:
            return self._static.mounting(frame)

    def laser_sits(self, frame: str, mounting: Mounting, *, known: bool) -> None:
        """Note where poses are taken from: a laser in `frame`, its scans turned by `mounting`.

        Parameters
        ----------
        known
            Whether somebody said so; else the laser is taken to be the robot.
        """
        with self._lock:
            self._laser = _Laser(frame_name(frame), mounting, known)

    def laser_in_bag(self, frame: str, fixed: StaticFrames) -> None:
        """Take where poses are taken from of a bag, which turns its scans by what it holds."""
        mounting = fixed.mounting(frame)
        with self._lock:
            self._static = fixed
        self.laser_sits(frame, mounting or Mounting(), known=mounting is not None)

    def of_robot(self, default: str) -> str:
        """Return the frame that is where the robot is."""
        with self._lock:
            named = self._laser and self._on_the_robot(self._laser, se2.IDENTITY)[0]
            return named or default

    def placed(self, pose: FloatArray, stamp: float, default: str) -> tuple[str, FloatArray] | None:
        """Return which frame the map is the parent of, and where that is in the map.

        Parameters
        ----------
        pose
            (3,) where a scan was taken, turned as the robot is [m, m, rad].
        stamp
            When [s].
        default
            The robot's frame where no transform is known of any.

        Returns
        -------
        None where the robot's frame moves in another, and nothing says where it was then.
        """
        with self._lock:
            if self._laser is None:
                return default, pose
            child, place = self._on_the_robot(self._laser, pose)
            return self._above(child, place, stamp) if child else (default, place)

    def _on_the_robot(self, laser: _Laser, pose: FloatArray) -> tuple[str, FloatArray]:
        """Return the robot's frame, empty where it has no name, and where it is."""
        fixed = self._static.fixed(laser.frame)
        mounting = laser.mounting
        if laser.known:
            on_robot = np.array([mounting.x, mounting.y, 0.0])
            return "" if fixed is None else fixed[0], se2.compose(pose, se2.inverse(on_robot))
        if fixed is None:
            return laser.frame, pose
        return fixed[0], se2.compose(pose, se2.inverse(fixed[1]))

    def _above(self, child: str, place: FloatArray, stamp: float) -> tuple[str, FloatArray] | None:
        """Return the topmost frame, and where it is, from `child` on, which is at `place`."""
        passed: set[str] = set()
        unknown = False
        while child in self._parents and child not in passed:
            passed.add(child)
            moved = self._tracks.setdefault(child, OdometryTrack(REMEMBERED)).at(stamp)
            if moved is None:  # on to those above: from now on they are followed, too
                unknown, moved = True, se2.IDENTITY
            child, place = self._parents[child], se2.compose(place, se2.inverse(moved))
            fixed = self._static.fixed(child)
            if fixed is not None:
                child, place = fixed[0], se2.compose(place, se2.inverse(fixed[1]))
        return None if unknown else (child, place)
