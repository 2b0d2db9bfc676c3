"""What ROS 2 is told of maps and poses: grids, walls, and where everything is.

Frames: ``map`` is the joint map's component of the most wall; ``<robot>/map`` is the component
that a robot is in now. An agent says where the robot's own frames are in it, of which it is told
(``<robot>/base_link`` where it has none); for a team, ``<robot>/sensor`` is where scans are taken.
"""

import logging
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from mapweave.anchors import placed_marks
from mapweave.errors import FileError
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.geometry.segments import lengths
from mapweave.io.exporters.map_server import grid_of
from mapweave.maps import (
    JointComponent,
    JointMap,
    LineMap,
    RobotMap,
    component_name,
    parse_component,
)
from mapweave.marks import PlacedMark
from mapweave_protocol.wire.messages import PoseMessage
from mapweave_ros.messages import (
    MARKER_ARRAY,
    OCCUPANCY_GRID,
    TF_MESSAGE,
    Lines,
    Messages,
    Transform,
    base_frame,
    map_frame,
    sensor_frame,
)
from mapweave_ros.node import Node
from mapweave_ros.robot.frames import RobotFrames

TF = "/tf"
PATIENCE = 50  # scans in a row whose place no transform can tell
MAX_STAMP = 2.0**31 - 1  # [s] that a ROS time holds
JOINT_FRAME = "map"
_log = logging.getLogger(__name__)

RELIED_ON, NOT_RELIED_ON = (0.1, 0.6, 0.1), (0.9, 0.5, 0.0)  # colours of links


def robot_topics(robot: str) -> Mapping[str, tuple[str, bool]]:
    """Return the topics of a robot's own map, their types, and which are latched."""
    return {
        f"/{topic_name(robot)}/map": (OCCUPANCY_GRID, True),
        f"/{topic_name(robot)}/walls": (MARKER_ARRAY, True),
        TF: (TF_MESSAGE, False),
    }


def joint_topics() -> Mapping[str, tuple[str, bool]]:
    """Return the topics of the joint map, likewise."""
    return {"/map": (OCCUPANCY_GRID, True), "/walls": (MARKER_ARRAY, True), TF: (TF_MESSAGE, False)}


def topic_name(robot: str) -> str:
    """Return a robot's id as part of a topic, which has no hyphens and begins with a letter."""
    name = robot.replace("-", "_")
    return name if name[0].isalpha() else f"r{name}"


class Speaker:
    """Puts maps and poses in ROS's words.

    Parameters
    ----------
    node
        With the topics of `robot_topics` or `joint_topics`.
    frames
        The robot's own; None where what is told is of a team, of whose robots no frame is known.
    """

    def __init__(self, node: Node, frames: RobotFrames | None = None) -> None:
        self._node = node
        self._frames = frames
        self._untold = 0  # poses in a row
        self._messages = Messages()
        self._frame = ""  # of the joint map's component that is shown
        self._stamp: float | None = None  # [s] of the newest pose: by the robots' own clock

    def robot_map(self, robot_map: RobotMap) -> None:
        """Tell the component that a robot is in."""
        if not robot_map.submaps:
            return
        number = robot_map.submaps[-1].component
        lines, component = robot_map.lines(number), component_name(robot_map.robot, number)
        marks = [mark for mark in placed_marks(robot_map) if mark.component == component]
        certain = np.ones(len(lines.segments))
        topic, frame = f"/{topic_name(robot_map.robot)}", map_frame(robot_map.robot)
        walls = Lines("walls", lines.segments, _by_confidence(certain))
        self._tell_map(topic, frame, lines, [walls], [robot_map.robot], marks)

    def joint_map(self, joint: JointMap) -> None:
        """Tell the component of the most wall."""
        if not joint.components:
            return
        shown = max(joint.components, key=lambda one: lengths(one.map.segments).sum())
        self._frame = min(shown.robots, key=parse_component)
        walls = Lines("walls", shown.map.segments, _by_confidence(shown.segment_confidence))
        robots = sorted({parse_component(name)[0] for name in shown.robots})
        lines = [walls, _links(joint, shown)]
        self._tell_map("", JOINT_FRAME, shown.map, lines, robots, shown.marks)

    def pose(self, pose: PoseMessage) -> None:
        """Tell where a robot is: in its own map, and where that is in the joint map, if shown."""
        stamp = pose.sent if pose.stamp is None or not 0 <= pose.stamp <= MAX_STAMP else pose.stamp
        self._stamp = stamp
        at = np.array(pose.pose)
        own = map_frame(pose.robot)
        placed = self._placed(pose.robot, at, stamp)
        if placed is None:
            return
        child, place = placed
        told = [Transform(own, child, place, stamp)]
        if pose.joint is not None and pose.joint.frame == self._frame:
            to_joint = se2.compose(np.array(pose.joint.pose), se2.inverse(at))
            told.append(Transform(JOINT_FRAME, own, to_joint, stamp))
        self._node.put(TF, self._messages.transforms(told))

    def _frame_of(self, robot: str) -> str:
        """Return the frame that is where a robot is."""
        if self._frames is None:
            return sensor_frame(robot)
        return self._frames.of_robot(base_frame(robot))

    def _placed(self, robot: str, at: FloatArray, stamp: float) -> tuple[str, FloatArray] | None:
        """Return a frame of the robot, and where it is when its sensor is `at` (3,)."""
        if self._frames is None:
            return sensor_frame(robot), at
        placed = self._frames.placed(at, stamp, base_frame(robot))
        self._untold = 0 if placed is not None else self._untold + 1
        if self._untold == PATIENCE:
            _log.warning(
                "%s: no transform is told: of the times of its scans /tf does not say how its"
                " frames lie to each other; expected stamps of the same clock",
                robot,
            )
        return placed

    def _tell_map(
        self,
        topic: str,
        frame: str,
        lines: LineMap,
        shown: list[Lines],
        robots: Sequence[str],
        marks: Sequence[PlacedMark],
    ) -> None:
        # Where robots go by simulated time, ours is in their future: nobody could place it.
        now = time.time() if self._stamp is None else self._stamp
        named = [(robot, self._frame_of(robot)) for robot in robots]
        self._node.put(f"{topic}/walls", self._messages.markers(shown, named, marks, frame, now))
        if len(lines.segments) == 0:
            return
        try:
            grid = grid_of(lines, Path(f"{topic}/map"))
        except FileError as error:
            _log.warning("%s", error)
            return
        self._node.put(f"{topic}/map", self._messages.grid(grid, frame, now))


def _by_confidence(confidence: FloatArray) -> FloatArray:
    """(n, 3) colours from red to dark green for (n,) confidences."""
    return np.column_stack([0.9 * (1 - confidence), 0.6 * confidence, np.zeros(len(confidence))])


def _links(joint: JointMap, shown: JointComponent) -> Lines:
    """Return lines between the starts of components that alignments join."""
    found = [
        (shown.robots[a.reference], shown.robots[a.other], a.status)
        for a in joint.alignments
        if a.reference in shown.robots and a.other in shown.robots and a.status is not None
    ]
    segments = [[*one[:2], *other[:2]] for one, other, _ in found]
    colours = [RELIED_ON if status.kind == "relied_on" else NOT_RELIED_ON for _, _, status in found]
    return Lines("links", np.array(segments).reshape(-1, 4), np.array(colours).reshape(-1, 3))
