"""Where the robots are, as they say at each scan: beside the coordinator's own work."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import zenoh

from mapweave_protocol.link.inbox import Inbox, pose_reader
from mapweave_protocol.wire.keys import POSE
from mapweave_protocol.wire.messages import PoseMessage

MAX_ROBOTS = 256  # whose poses are kept
NAP = 0.2  # [s] after which the end of the block is noticed


class Positions:
    """Keeps of each robot the newest pose that it said; read from any thread.

    Attributes
    ----------
    count
        How many poses were taken in: another count, another content.
    """

    def __init__(self) -> None:
        self.count = 0
        self._newest: dict[str, PoseMessage] = {}  # replaced, never changed

    @contextmanager
    def heard_on(self, session: zenoh.Session, team: str) -> Iterator[None]:
        """Listen to the poses of `team` while the block lasts."""
        inbox, ending = Inbox(MAX_ROBOTS), threading.Event()
        thread = threading.Thread(target=self._listen, args=(inbox, ending), name="positions")
        with session.declare_subscriber(POSE.pattern(team=team), inbox.put):
            thread.start()
            try:
                yield
            finally:
                ending.set()
                thread.join()

    def take(self, pose: PoseMessage) -> None:
        """Take in a pose; with too many robots the one that was silent longest is forgotten."""
        others = {robot: one for robot, one in self._newest.items() if robot != pose.robot}
        if len(others) >= MAX_ROBOTS:
            others.pop(next(iter(others)))
        self._newest = {**others, pose.robot: pose}
        self.count += 1

    def content(self) -> dict[str, Any]:
        """Return what ``/api/poses`` says."""
        newest = self._newest
        return {"robots": {robot: _content(newest[robot]) for robot in sorted(newest)}}

    def _listen(self, inbox: Inbox, ending: threading.Event) -> None:
        reader = pose_reader()
        while not ending.is_set():
            arrival = inbox.newest(NAP)
            pose = None if arrival is None else reader.read(arrival)
            if pose is not None:
                self.take(pose)


def _content(pose: PoseMessage) -> dict[str, Any]:
    return {
        "component": str(pose.component),
        "pose": pose.pose,
        "found": pose.found,
        "scan_index": pose.scan_index,
        "stamp": pose.stamp,
        "sent": pose.sent,
    }
