"""The joint map and robots, live in Foxglove: what a WebSocket client of its protocol hears."""

import base64
import json
import signal
import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from mapweave.errors import MissingExtraError
from mapweave.maps import JointMap
from mapweave_protocol.wire.pose_message import JointPose
from mapweave_ros.foxglove_live import FoxgloveError, FoxgloveOutput
from tests.agent.test_agent import MAPWEAVE, PATIENCE
from tests.mapweave.whole_maps import joint_map, robot_map, true_poses
from tests.ros.test_output import pose

PROTOCOL = Subprotocol("foxglove.sdk.v1")
MESSAGE = 1  # opcode of what is sent on a channel
HEAD = struct.Struct("<BIQ")  # opcode, subscription, time [ns]


class Foxglove:
    """A client that subscribes to all there is, and decodes it by the schemas it is told."""

    def __init__(self, socket: ClientConnection) -> None:
        self._socket = socket
        self._decoders: dict[int, tuple[str, Any]] = {}

    def heard(self) -> Iterator[tuple[str, Any]]:
        """Yield topics and messages as they come, for as long as some come in time."""
        while True:
            said = self._socket.recv(timeout=PATIENCE)
            if isinstance(said, str):
                self._subscribe(json.loads(said))
            elif said[0] == MESSAGE:
                topic, decoder = self._decoders[HEAD.unpack_from(said)[1]]
                yield topic, decoder.FromString(said[HEAD.size :])

    def until(self, topic: str) -> Any:  # noqa: ANN401
        """Return the next message of a topic."""
        return next(message for heard, message in self.heard() if heard == topic)

    def _subscribe(self, told: dict[str, Any]) -> None:
        if told["op"] != "advertise":
            return
        wanted = []
        for channel in told["channels"]:
            self._decoders[channel["id"]] = (channel["topic"], _decoder(channel))
            wanted.append({"id": channel["id"], "channelId": channel["id"]})
        self._socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))


def _decoder(channel: dict[str, Any]) -> Any:  # noqa: ANN401
    """Return the class of a channel's messages, made from the schema that it brings."""
    files = descriptor_pb2.FileDescriptorSet.FromString(base64.b64decode(channel["schema"]))
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(channel["schemaName"]))


def listening(stack: ExitStack, url: str) -> Foxglove:
    return Foxglove(stack.enter_context(connect(url, subprotocols=[PROTOCOL])))


@pytest.fixture
def joint() -> JointMap:
    rng = np.random.default_rng(5)
    maps = [robot_map(rng, "a"), robot_map(rng, "b")]
    return joint_map(maps, true_poses(maps))


def drawn(update: Any) -> dict[str, np.ndarray]:  # noqa: ANN401
    """Return the segments of each entity."""
    return {
        entity.id: np.array([[p.x, p.y] for p in entity.lines[0].points]).reshape(-1, 4)
        for entity in update.entities
    }


def test_whoever_comes_late_is_told_the_newest_map_and_it_replaces_the_one_before(
    joint: JointMap,
) -> None:
    (component,) = joint.components
    fewer = replace(
        component,
        map=replace(component.map, segments=component.map.segments[:3]),
        segment_confidence=component.segment_confidence[:3],
    )
    with ExitStack() as stack:
        output = stack.enter_context(FoxgloveOutput(0))
        output.tell(joint)
        early = listening(stack, output.url)
        (walls,) = drawn(early.until("/walls")).values()
        np.testing.assert_allclose(walls, component.map.segments)
        output.tell(replace(joint, components=(fewer,)))
        while len(walls) != len(fewer.map.segments):
            update = early.until("/walls")
            assert [deletion.type for deletion in update.deletions] == [1]  # all there was
            (walls,) = drawn(update).values()
        (late,) = drawn(listening(stack, output.url).until("/walls")).values()
        np.testing.assert_allclose(late, fewer.map.segments)


def test_a_robot_is_in_the_joint_map_as_soon_as_that_has_it(joint: JointMap) -> None:
    frame = next(iter(joint.components[0].robots))
    with ExitStack() as stack:
        output = stack.enter_context(FoxgloveOutput(0))
        output.tell(joint)
        client = listening(stack, output.url)
        entity = client.until("/walls").entities[0]
        output.tell(pose())
        (alone,) = client.until("/tf").transforms
        there = pose(JointPose(frame=frame, pose=(4.0, 5.0, 0.0), since=1))
        output.tell(there)
        (joined,) = client.until("/tf").transforms
    assert entity.frame_id == frame
    assert (alone.parent_frame_id, alone.child_frame_id) == (
        there.component,
        f"{there.component}/sensor",
    )
    assert (joined.parent_frame_id, joined.child_frame_id) == (frame, alone.child_frame_id)
    assert (joined.translation.x, joined.translation.y) == (4.0, 5.0)


def test_a_bridge_shows_foxglove_what_a_teams_processes_map(
    endpoint: str, team: str, logs: list[Path], tmp_path: Path
) -> None:
    reached = ("--team", team, "--connect", endpoint)
    commands = (
        ("server", *reached, "--store", str(tmp_path / "store.sqlite")),
        ("agent", *reached, "--robot", "a", "--log", str(logs[0]), "--scans", ":150"),
    )
    with ExitStack() as stack:
        to = ("bridge", *reached, "--to", "foxglove:0")
        bridge = stack.enter_context(
            subprocess.Popen([MAPWEAVE, *to], stderr=subprocess.PIPE, text=True)
        )
        stack.callback(bridge.kill)
        assert bridge.stderr is not None
        line = next(line for line in bridge.stderr if "ws://" in line)
        url = next(word for word in line.split() if word.startswith("ws://"))
        client = listening(stack, url)
        for command in commands:
            process = stack.enter_context(subprocess.Popen([MAPWEAVE, *command]))
            stack.callback(process.kill)
        (walls,) = drawn(client.until("/walls")).values()
        assert len(walls) > 0
        bridge.send_signal(signal.SIGINT)
        assert bridge.wait(PATIENCE) == 0


@pytest.mark.parametrize(
    "word", ["foxglove:", "foxglove:x", "foxglove:0.0.0.0:8765", "foxglove:70000"]
)
def test_a_word_without_a_port_is_refused_with_what_is_expected(word: str) -> None:
    with pytest.raises(FoxgloveError, match="expected foxglove:PORT"):
        FoxgloveOutput.parse(word)


def test_a_port_that_is_taken_is_told_of() -> None:
    with FoxgloveOutput(0) as output, pytest.raises(FoxgloveError, match="cannot listen at"):
        FoxgloveOutput(int(output.url.rpartition(":")[2]))


def test_without_the_extra_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "foxglove", None)
    with pytest.raises(MissingExtraError, match=r"mapweave\[foxglove\]"):
        FoxgloveOutput(0)
