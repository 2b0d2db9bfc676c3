"""Where robots are is heard from the network, past the coordinator."""

import time

from mapweave_fusion_server.web.positions import MAX_ROBOTS, Positions
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.keys import POSE
from tests.fusion_server.conftest import PATIENCE, Network
from tests.fusion_server.web.conftest import make_pose


def test_of_each_robot_the_newest_pose_is_known_and_what_is_not_valid_is_left_out(
    network: Network,
) -> None:
    session, positions = network.connect(), Positions()
    keys = {robot: POSE.build(team=network.team, robot=robot) for robot in ("r1", "r2")}
    with positions.heard_on(network.connect(), network.team):
        deadline = time.monotonic() + PATIENCE
        while len(positions.content()["robots"]) < 2:
            assert time.monotonic() < deadline
            session.put(keys["r1"], encode(make_pose("r2", 6.0)))  # under another's key
            session.put(keys["r1"], encode(make_pose("r1", 5.0)))
            session.put(keys["r2"], b"no message")
            session.put(keys["r2"], encode(make_pose("r2", 7.0)))
            time.sleep(0.02)
    told = positions.content()["robots"]
    assert {robot: one["pose"][0] for robot, one in told.items()} == {"r1": 5.0, "r2": 7.0}
    assert told["r1"]["component"] == "r1/0"


def test_of_too_many_robots_the_one_that_was_silent_longest_is_forgotten() -> None:
    positions = Positions()
    for number in range(MAX_ROBOTS):
        positions.take(make_pose(f"r{number}", 0.0))
    positions.take(make_pose("r0", 1.0))
    positions.take(make_pose("late", 0.0))
    told = positions.content()["robots"]
    assert len(told) == MAX_ROBOTS
    assert "r1" not in told
    assert told["r0"]["pose"] == (1.0, 0.0, 0.0)
