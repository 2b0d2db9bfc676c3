"""What a ROS 2 network is told comes back by another's definitions, and shows the same walls."""

import json
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
import zenoh

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.mapper import Mapper
from mapweave.maps import JointComponent, JointMap, RobotMap
from mapweave.marks import PlacedMark
from mapweave.scan.mounting import Mounting
from mapweave_protocol.link.session import open_session
from mapweave_protocol.wire.messages import PoseMessage
from mapweave_protocol.wire.pose_message import JointPose
from mapweave_ros.network import Ros2Network
from mapweave_ros.output import Ros2Output
from mapweave_ros.robot.frames import RobotFrames
from mapweave_ros.speaker import Speaker, topic_name
from tests.mapweave.buildings import BUILDING, scans_along
from tests.ros.listeners import STORE, listening

GRID, MARKERS, TF = (
    "nav_msgs/msg/OccupancyGrid",
    "visualization_msgs/msg/MarkerArray",
    "tf2_msgs/msg/TFMessage",
)
PEER = Path(__file__).with_name("peer_listener.py")
PATIENCE = 20.0  # [s]
CELL = 0.05  # [m]
COVARIANCE = (0.0,) * 6


@pytest.fixture(scope="module")
def mapped() -> RobotMap:
    """Return the map of a robot that has driven through some rooms."""
    mapper = Mapper("r1")
    for scan in scans_along(BUILDING, [(1, 1), (3.5, 1), (3.5, -2)], 1)[0]:
        mapper.add(scan)
    return mapper.finish()


@pytest.fixture
def session(endpoint: str) -> Iterator[zenoh.Session]:
    """Return a session of whoever listens."""
    with open_session([endpoint], patience=PATIENCE) as opened:
        yield opened


def occupied(grid: Any) -> FloatArray:  # noqa: ANN401
    """(n, 2) the middles of the occupied cells [m]."""
    cells = grid.data.reshape(grid.info.height, grid.info.width)
    row, column = np.nonzero(cells == 100)
    origin = grid.info.origin.position
    middles: FloatArray = np.column_stack(
        [origin.x + CELL * (column + 0.5), origin.y + CELL * (row + 0.5)]
    )
    return middles


def distance_to(points: FloatArray, segments: FloatArray) -> FloatArray:
    """(n,) the distance [m] of points (n, 2) to the nearest of segments (m, 4)."""
    start, along = segments[:, :2], segments[:, 2:] - segments[:, :2]
    offset = points[:, None] - start
    share = np.clip((offset * along).sum(axis=2) / (along**2).sum(axis=1), 0, 1)
    apart: FloatArray = np.linalg.norm(offset - share[:, :, None] * along, axis=2).min(axis=1)
    return apart


def segments_of(markers: Any, name: str) -> FloatArray:  # noqa: ANN401
    """(n, 4) the segments that markers show under a name [m]."""
    shown = [marker for marker in markers.markers if marker.ns == name and marker.points]
    points = [(point.x, point.y) for marker in shown for point in marker.points]
    return np.array(points).reshape(-1, 4)


def test_who_comes_late_gets_the_grid_and_the_walls_of_the_last_map(
    endpoint: str, session: zenoh.Session, mapped: RobotMap
) -> None:
    walls = mapped.lines(0).segments
    with Ros2Output.of_robot(Ros2Network((endpoint,), 21), "r1") as output:
        with listening(session, 21, "/r1/map", GRID) as first:
            output.tell(mapped)
            first.wait(1)
        with (
            listening(session, 21, "/r1/map", GRID) as late,
            listening(session, 21, "/r1/walls", MARKERS) as late_walls,
        ):
            grid = late.wait(1)
            markers = late_walls.wait(1)
    assert (grid.header.frame_id, grid.info.resolution) == ("r1/map", pytest.approx(CELL))
    assert distance_to(occupied(grid), walls).max() <= CELL
    ends = walls.reshape(-1, 2)
    assert np.linalg.norm(ends[:, None] - occupied(grid)[None], axis=2).min(axis=1).max() <= CELL
    assert set(np.unique(grid.data)) == {-1, 0, 100}
    np.testing.assert_array_equal(segments_of(markers, "walls"), walls)
    labels = [(m.text, m.header.frame_id) for m in markers.markers if m.ns == "robots"]
    assert labels == [("r1", "r1/base_link")]


def test_an_independent_ros_2_peer_sees_the_same_walls_in_grid_and_markers(
    endpoint: str, mapped: RobotMap, tmp_path: Path
) -> None:
    host, port = endpoint.removeprefix("tcp/").split(":")
    peer = [sys.executable, str(PEER), host, port, str(tmp_path), "29"]
    walls = mapped.lines(0).segments
    at_start = pose().model_copy(update={"robot": "r1", "component": "r1/0"})
    heard = tmp_path / "heard"
    with (
        Ros2Output.of_robot(Ros2Network((endpoint,), 29), "r1") as output,
        heard.open("w") as file,
        subprocess.Popen(peer, stdout=file) as process,
    ):
        while process.poll() is None:  # transforms are not kept for who is late
            output.tell(mapped)
            output.tell(at_start)
            time.sleep(0.2)
    said = {told.pop("topic"): told for told in map(json.loads, heard.read_text().splitlines())}
    assert said.keys() == {"/r1/map", "/r1/walls", "/tf"}
    np.testing.assert_allclose(np.reshape(said["/r1/walls"]["ends"], (-1, 4)), walls, atol=1e-3)
    (width, height), origin = said["/r1/map"]["size"], said["/r1/map"]["origin"]
    row, column = np.nonzero(np.reshape(said["/r1/map"]["cells"], (height, width)) == 100)
    middles = np.column_stack([origin[0] + CELL * (column + 0.5), origin[1] + CELL * (row + 0.5)])
    assert len(middles) > 100
    assert distance_to(middles, walls).max() < CELL
    assert said["/tf"]["frames"] == [["r1/map", "r1/base_link"]]


def test_what_is_said_carries_what_rmw_zenoh_attaches(
    endpoint: str, session: zenoh.Session, mapped: RobotMap
) -> None:
    with (
        Ros2Output.of_robot(Ros2Network((endpoint,), 22), "r1") as output,
        listening(session, 22, "/r1/walls", MARKERS) as walls,
    ):
        for count in (1, 2):
            output.tell(mapped)
            walls.wait(count)
    said = [struct.unpack("<qqB16s", attached) for attached in walls.attachments]
    assert [(number, length) for number, _, length, _ in said] == [(1, 16), (2, 16)]
    assert len({gid for *_, gid in said}) == 1
    assert abs(said[0][1] / 1e9 - time.time()) < PATIENCE


def test_its_topics_are_in_the_graph_that_ros_2_sees_while_it_is_there(
    endpoint: str, session: zenoh.Session
) -> None:
    def tokens() -> list[list[str]]:
        replies = session.liveliness().get("@ros2_lv/23/**", timeout=1.0)
        return [str(reply.ok.key_expr).split("/") for reply in replies if reply.ok is not None]

    with Ros2Output.of_robot(Ros2Network((endpoint,), 23), "r-1"):
        deadline = time.monotonic() + PATIENCE
        while len(tokens()) < 4 and time.monotonic() < deadline:
            time.sleep(0.05)
        found = sorted(tokens(), key=lambda token: (token[5], token[9:]))
    node, *publishers = found[-1:] + found[:-1]
    assert [node[5], node[8]] == ["NN", "mapweave_r_1"]
    assert [(one[9], one[10], one[12]) for one in publishers] == [
        ("%r_1%map", "nav_msgs::msg::dds_::OccupancyGrid_", ":1:,1:,:,:,,"),
        ("%r_1%walls", "visualization_msgs::msg::dds_::MarkerArray_", ":1:,1:,:,:,,"),
        ("%tf", "tf2_msgs::msg::dds_::TFMessage_", "::,10:,:,:,,"),
    ]
    assert all(one[11] == STORE.hash_rihs01(kind) for one, kind in zip(
        publishers, (GRID, MARKERS, TF), strict=True
    ))  # fmt: skip
    assert tokens() == []


def test_humble_hears_under_its_own_words(
    endpoint: str, session: zenoh.Session, mapped: RobotMap
) -> None:
    network = Ros2Network((endpoint,), 24, hashed=False)
    with (
        Ros2Output.of_robot(network, "r1") as output,
        listening(session, 24, "/r1/map", GRID, "TypeHashNotSupported") as grids,
    ):
        output.tell(mapped)
        assert len(occupied(grids.wait(1))) > 0


def transform_of(message: Any, child: str) -> FloatArray:  # noqa: ANN401
    """(3,) where a frame is in its parent."""
    (found,) = (t for t in message.transforms if t.child_frame_id == child)
    moved = found.transform
    heading = 2 * np.arctan2(moved.rotation.z, moved.rotation.w)
    return np.array([moved.translation.x, moved.translation.y, heading])


def pose(joint: JointPose | None = None, stamp: float | None = 5.5) -> PoseMessage:
    return PoseMessage(
        robot="r2", boot="b", stamp=stamp, sent=9.0, scan_index=0, found=True, component="r2/0",
        pose=(1.0, 2.0, 0.5), covariance=COVARIANCE, joint=joint,
    )  # fmt: skip


def test_maps_are_of_the_time_of_the_robots_clock_which_may_be_simulated(mapped: RobotMap) -> None:
    node = Mock()
    speaker = Speaker(node, RobotFrames())
    speaker.pose(pose(stamp=0.0))
    speaker.pose(pose(stamp=5.5))
    speaker.robot_map(mapped)
    said = dict(call.args for call in node.put.call_args_list)
    grid: Any = STORE.deserialize_cdr(said["/r1/map"], GRID)
    told: Any = STORE.deserialize_cdr(said["/r1/walls"], MARKERS)
    stamps = [grid.header.stamp, *(m.header.stamp for m in told.markers if m.ns == "walls")]
    assert len(stamps) > 1
    assert {(stamp.sec, stamp.nanosec) for stamp in stamps} == {(5, 500_000_000)}


def test_a_robot_is_where_its_pose_and_the_mounting_of_its_sensor_say(
    endpoint: str, session: zenoh.Session
) -> None:
    mounting, frames = np.array([0.3, -0.1, 0.0]), RobotFrames()
    frames.laser_sits("laser", Mounting(0.3, -0.1, 2.0), known=True)
    with (
        Ros2Output.of_robot(Ros2Network((endpoint,), 25), "r2", frames) as output,
        listening(session, 25, "/tf", TF) as heard,
    ):
        while not heard.messages:  # nobody keeps it for who is late
            output.tell(pose())
            time.sleep(0.05)
    (said,) = heard.messages[0].transforms
    assert (said.header.frame_id, said.header.stamp.sec) == ("r2/map", 5)
    base = transform_of(heard.messages[0], "r2/base_link")
    np.testing.assert_allclose(se2.compose(base, mounting), [1.0, 2.0, 0.5])


def test_the_frames_of_a_team_put_each_robot_where_it_is_in_the_joint_map(
    endpoint: str, session: zenoh.Session, mapped: RobotMap
) -> None:
    lines = mapped.lines(0)
    confidence = np.linspace(0, 1, len(lines.segments))
    there = {"r1/0": np.zeros(3), "r2/0": np.array([4.0, 0.0, np.pi / 2])}
    victim = PlacedMark("m1", "victim", "r2", 1.0, "r2/0", np.array([3.0, -2.0]))
    joint = JointMap(3, (JointComponent(there, 1.0, lines, confidence, marks=(victim,)),), ())
    at = se2.compose(there["r2/0"], np.array([1.0, 2.0, 0.5]))
    told = pose(JointPose(frame="r1/0", since=3, pose=tuple(at)))
    with (
        Ros2Output.of_team(Ros2Network((endpoint,), 26), "rescue") as output,
        listening(session, 26, "/walls", MARKERS) as walls,
        listening(session, 26, "/tf", TF) as heard,
    ):
        output.tell(joint)
        markers = walls.wait(1)
        while not heard.messages:
            output.tell(told)
            time.sleep(0.05)
    message = heard.messages[0]
    base = se2.compose(transform_of(message, "r2/map"), transform_of(message, "r2/sensor"))
    np.testing.assert_allclose(base, at, atol=1e-9)
    np.testing.assert_allclose(transform_of(message, "r2/map"), there["r2/0"], atol=1e-9)
    np.testing.assert_array_equal(segments_of(markers, "walls"), lines.segments)
    (shown,) = (m for m in markers.markers if m.ns == "walls")
    assert (shown.colors[0].r, shown.colors[-1].g) == (pytest.approx(0.9), pytest.approx(0.6))
    assert shown.colors[-1].r == 0
    (mark,) = (m for m in markers.markers if m.ns == "marks")
    assert (mark.text, mark.header.frame_id) == ("victim", "map")
    assert (mark.pose.position.x, mark.pose.position.y) == (3.0, -2.0)


@pytest.mark.parametrize(
    ("robot", "name"), [("r1", "r1"), ("red-2", "red_2"), ("7of9", "r7of9"), ("_x", "r_x")]
)
def test_a_robots_id_becomes_part_of_a_topic(robot: str, name: str) -> None:
    assert topic_name(robot) == name


def test_who_never_finds_the_network_ends_all_the_same(mapped: RobotMap) -> None:
    with Ros2Output.of_robot(Ros2Network(("tcp/127.0.0.1:1",)), "r1") as output:
        output.tell(mapped)
