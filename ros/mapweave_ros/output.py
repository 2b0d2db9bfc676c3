"""Tells a ROS 2 network what an agent or a team knows, in a thread of its own.

Who maps only leaves what is new: the newest of each kind is told, as soon as the network is there.
"""

import logging
import threading
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from types import TracebackType
from typing import Self

import zenoh

from mapweave.maps import JointMap, RobotMap
from mapweave_protocol.errors import UnreachableError
from mapweave_protocol.link.security.settings import LinkSettings
from mapweave_protocol.link.session import open_session
from mapweave_protocol.wire.messages import PoseMessage
from mapweave_ros.messages import Messages, map_frame
from mapweave_ros.network import Ros2Network
from mapweave_ros.node import Node
from mapweave_ros.robot.frames import RobotFrames
from mapweave_ros.speaker import Speaker, joint_topics, robot_topics, topic_name

Told = RobotMap | JointMap | PoseMessage

_log = logging.getLogger(__name__)


class Ros2Output:
    """Tells what it is given; a context manager.

    Parameters
    ----------
    network
        Where.
    name
        The node's.
    topics
        As of `Node`.
    frames
        As of `Speaker`.

    Raises
    ------
    MissingExtraError
        If `rosbags` is not installed.
    """

    def __init__(
        self,
        network: Ros2Network,
        name: str,
        topics: Mapping[str, tuple[str, bool]],
        frames: RobotFrames | None = None,
    ) -> None:
        Messages()  # so that what is missing is said at once
        self._network = network
        self._name = name
        self._topics = topics
        self._frames = frames
        self._news: dict[str, Told] = {}
        self._changed = threading.Condition()
        self._closed = False
        self._thread = threading.Thread(target=self._tell_all, name="ros2")

    @classmethod
    def of_robot(
        cls, network: Ros2Network, robot: str, frames: RobotFrames | None = None
    ) -> "Ros2Output":
        """Return the output of an agent; `frames` are the robot's, followed from now on."""
        known = RobotFrames() if frames is None else frames
        known.follow(map_frame(robot))
        return cls(network, f"mapweave_{topic_name(robot)}", robot_topics(robot), known)

    @classmethod
    def of_team(cls, network: Ros2Network, team: str) -> "Ros2Output":
        """Return the output of a team."""
        return cls(network, f"mapweave_team_{team.replace('-', '_')}", joint_topics())

    def tell(self, news: Told) -> None:
        """Leave what is new; returns at once."""
        kind = f"pose/{news.robot}" if isinstance(news, PoseMessage) else "map"
        with self._changed:
            self._news.pop(kind, None)  # so that it is last in turn
            self._news[kind] = news
            self._changed.notify()

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join()

    def _tell_all(self) -> None:
        with ExitStack() as stack:
            session = open_when_there(stack, self._network, lambda: self._closed)
            if session is None:
                return
            node = stack.enter_context(Node(session, self._network, self._name, self._topics))
            speaker = Speaker(node, self._frames)
            while (news := self._next()) is not None:
                if isinstance(news, PoseMessage):
                    speaker.pose(news)
                elif isinstance(news, RobotMap):
                    speaker.robot_map(news)
                else:
                    speaker.joint_map(news)

    def _next(self) -> Told | None:
        """Return what has waited longest; None once all is told and no more comes."""
        with self._changed:
            self._changed.wait_for(lambda: self._news or self._closed)
            return self._news.pop(next(iter(self._news))) if self._news else None


def open_when_there(
    stack: ExitStack, network: Ros2Network, stopping: Callable[[], bool]
) -> zenoh.Session | None:
    """Return a session as soon as the router is there; None where nobody waits any more."""
    told = False
    while not stopping():
        try:
            # The team's keys are for the team's router, which is an encrypted one.
            link = None if all(e.startswith("tls/") for e in network.endpoints) else LinkSettings()
            return stack.enter_context(open_session(network.endpoints, patience=0.0, link=link))
        except UnreachableError:
            if not told:
                _log.info("waiting for ROS 2's router at %s", ", ".join(network.endpoints))
            told = True
    return None
