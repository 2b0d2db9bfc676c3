"""A team's joint map and poses, live in Foxglove: a WebSocket on this machine.

Topics are those of a recording (`mapweave.io.exporters.mcap`): ``/walls``, ``/free_space``,
``/marks`` and ``/tf``. Foxglove's server remembers nothing, so whoever comes later is told the
newest map again (foxglove-sdk 0.30.3).
"""

from __future__ import annotations

import queue
import re
import threading
import time
from types import TracebackType
from typing import TYPE_CHECKING, Self, TypeAlias

import numpy as np

from mapweave.errors import MapweaveError, MissingExtraError
from mapweave.io.exporters.foxglove_scenes import (
    is_time,
    nanoseconds,
    scene_updates,
    sensor_frame,
    transform_message,
)
from mapweave.maps import JointMap
from mapweave.pictures.scene import scenes_of
from mapweave_protocol.wire.messages import PoseMessage

if TYPE_CHECKING:
    from foxglove.websocket import ChannelView, Client, ServerListener

SCHEME = "foxglove:"
HOST = "127.0.0.1"  # neither encrypted nor guarded: this machine only
MAX_PORT = 65535
TF = "/tf"


News: TypeAlias = "queue.SimpleQueue[JointMap | PoseMessage | str | None]"
"""What is to be told: a map, a pose, the newest of a topic again; None ends it."""


class FoxgloveError(MapweaveError):
    """A word ``foxglove:PORT`` that is none, or a port that cannot be had."""


class FoxgloveOutput:
    """Tells Foxglove what it is given; a context manager.

    Parameters
    ----------
    port
        Where it listens, on the loopback interface; 0 for any that is free.

    Raises
    ------
    MissingExtraError
        If `foxglove-sdk` is not installed.
    FoxgloveError
        If the port cannot be had.
    """

    def __init__(self, port: int) -> None:
        try:
            from foxglove import Context, start_server
            from foxglove.channels import FrameTransformsChannel, SceneUpdateChannel
        except ImportError as error:
            raise MissingExtraError("Foxglove", "foxglove") from error
        self._context = context = Context()  # its channels close when nobody holds it any more
        self._scenes = {
            topic: SceneUpdateChannel(topic, context=context) for topic in scene_updates([], 0.0)
        }
        self._tf = FrameTransformsChannel(TF, context=context)
        self._news: News = queue.SimpleQueue()
        self._latest: JointMap | None = None
        self._thread = threading.Thread(target=self._tell_all, name="foxglove")
        try:
            self._server = start_server(
                name="mapweave",
                host=HOST,
                port=port,
                server_listener=_listener(self._news),
                context=context,
            )
        except (RuntimeError, OSError) as error:
            raise FoxgloveError(f"cannot listen at {HOST}:{port}: {error}") from error

    @classmethod
    def parse(cls, word: str) -> FoxgloveOutput:
        """Return the output that ``foxglove:PORT`` names.

        Raises
        ------
        FoxgloveError
            If it is no such word, or the port cannot be had.
        """
        port = word.removeprefix(SCHEME)
        if not re.fullmatch(r"[0-9]{1,5}", port) or int(port) > MAX_PORT:
            raise FoxgloveError(
                f"{word!r} names no port; expected foxglove:PORT, such as foxglove:8765 (it is"
                " served on this machine only; from elsewhere: ssh -L)"
            )
        return cls(int(port))

    @property
    def url(self) -> str:
        """Where Foxglove finds it."""
        return f"ws://{HOST}:{self._server.port}"

    def tell(self, news: JointMap | PoseMessage) -> None:
        """Leave what is new; returns at once."""
        self._news.put(news)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._news.put(None)
        self._thread.join()
        self._server.stop()

    def _tell_all(self) -> None:
        while (news := self._news.get()) is not None:
            if isinstance(news, PoseMessage):
                self._tell_pose(news)
            elif isinstance(news, JointMap):
                self._latest = news
                self._tell_map(news, *self._scenes)
            elif self._latest is not None and news in self._scenes:
                self._tell_map(self._latest, news)

    def _tell_map(self, joint: JointMap, *topics: str) -> None:
        now = time.time()
        updates = scene_updates(scenes_of(joint), now, replacing=True)
        for topic in topics:
            self._scenes[topic].log(updates[topic], log_time=nanoseconds(now))

    def _tell_pose(self, told: PoseMessage) -> None:
        """Tell where a robot is: in the joint map where that has it, else in its own."""
        stamp = told.sent if told.stamp is None or not is_time(told.stamp) else told.stamp
        frame, pose = told.component, told.pose
        if told.joint is not None:
            frame, pose = told.joint.frame, told.joint.pose
        message = transform_message(stamp, frame, sensor_frame(told.component), np.array(pose))
        self._tf.log(message, log_time=nanoseconds(stamp))


def _listener(news: News) -> ServerListener:
    """Return what has the newest of a topic told again to `news` when somebody subscribes."""
    from foxglove.websocket import ServerListener

    class Latching(ServerListener):
        def on_subscribe(self, client: Client, channel: ChannelView) -> None:  # noqa: ARG002
            news.put(channel.topic)  # from a thread of the server's: no more than that

    return Latching()
