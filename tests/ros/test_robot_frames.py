"""What an agent says on `/tf` fits the robot's own tree: no frame gets a second parent."""

import math

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.scan.mounting import Mounting
from mapweave_ros.robot.frames import RobotFrames
from tests.ros.moving import tf, transform

AT = np.array([3.0, 1.0, 0.4])  # where a scan was taken
LASER = 0.2, -0.1, math.pi / 2  # on the robot


def seen_from(
    *fixed: object, frame: str = "laser", mounting: Mounting | None = None
) -> RobotFrames:
    """Return frames of a robot of which `fixed` is said before its first scan."""
    frames = RobotFrames()
    frames.follow("r1/map")
    frames.say_fixed(tf(*fixed))
    sits = mounting or frames.mounting(frame)
    frames.laser_sits(frame, sits or Mounting(), known=sits is not None)
    return frames


def assert_placed(frames: RobotFrames, frame: str, place: FloatArray, stamp: float = 5.0) -> None:
    placed = frames.placed(AT, stamp, "r1/base_link")
    assert placed is not None
    assert placed[0] == frame
    np.testing.assert_allclose(placed[1], place, atol=1e-9)


ON_PLATE = transform("plate", "laser", *LASER)
ON_BASE = transform("/base_link", "plate", 0.5, 0.0, 0.0)
BASE = se2.compose(AT, se2.inverse(np.array([0.7, -0.1, 0.0])))


def test_the_map_is_the_parent_of_what_the_laser_is_fixed_to() -> None:
    frames = seen_from(ON_PLATE, ON_BASE)
    assert_placed(frames, "base_link", BASE)
    assert frames.of_robot("r1/base_link") == "base_link"


def test_a_mounting_that_was_written_goes_before_transforms_and_the_frame_is_theirs() -> None:
    frames = seen_from(ON_PLATE, ON_BASE, mounting=Mounting(0.7, -0.1, 3.0))
    assert_placed(frames, "base_link", BASE)


@pytest.mark.parametrize("mounting", [Mounting(0.3, 0.0, 1.0), Mounting(0.3, 0.0, 0.0, True)])
def test_without_transforms_a_written_mounting_tells_where_the_robot_is(mounting: Mounting) -> None:
    frames = seen_from(mounting=mounting)
    assert_placed(frames, "r1/base_link", se2.compose(AT, [-0.3, 0.0, 0.0]))
    assert frames.of_robot("r1/base_link") == "r1/base_link"


def test_a_laser_of_which_nothing_is_known_is_placed_itself() -> None:
    frames = seen_from()
    assert_placed(frames, "laser", AT)
    assert_placed(seen_from(frame=""), "r1/base_link", AT)
    # What is said later of it leaves the laser where it is.
    frames.say_fixed(tf(ON_PLATE, ON_BASE))
    placed = frames.placed(AT, 5.0, "r1/base_link")
    assert placed is not None and placed[0] == "base_link"
    laser = se2.compose(placed[1], np.array([0.7, -0.1, math.pi / 2]))
    np.testing.assert_allclose(laser, AT, atol=1e-9)


def test_where_odometry_moves_the_robot_the_map_is_the_parent_of_its_frame() -> None:
    frames = seen_from(ON_PLATE, ON_BASE)
    moving = [
        tf(
            transform("odom", "base_link", 2.0 + stamp, 1.0, 0.3, stamp=stamp),
            transform("base_link", "wheel", 0.0, 0.0, 9.0 * stamp, stamp=stamp),
        )
        for stamp in (4.8, 5.0, 5.2)
    ]
    frames.say_moving(moving[0])
    assert frames.placed(AT, 5.0, "r1/base_link") is None  # how it moves is not known yet
    for message in moving:
        frames.say_moving(message)
    in_odom = np.array([7.0, 1.0, 0.3])
    assert_placed(frames, "odom", se2.compose(BASE, se2.inverse(in_odom)))
    assert frames.of_robot("r1/base_link") == "base_link"
    assert frames.placed(AT, 99.0, "r1/base_link") is None


def test_what_is_above_odometry_is_fixed_or_moves_too() -> None:
    frames = seen_from(transform("world", "odom", 0.0, 0.0, math.pi), ON_PLATE, ON_BASE)
    for stamp in (3.0, 4.0, 5.0):
        footprint = transform("footprint", "base_link", 0.0, 0.0, 0.0, stamp=stamp)
        frames.say_moving(tf(footprint))
        frames.say_moving(tf(transform("odom", "footprint", 1.0, 0.0, 0.0, stamp=stamp)))
        frames.placed(AT, stamp, "")  # by this it is known which are asked for
    in_world = se2.compose([0.0, 0.0, math.pi], np.array([1.0, 0.0, 0.0]))
    assert_placed(frames, "world", se2.compose(BASE, se2.inverse(in_world)))


def test_what_the_agent_says_itself_and_a_ring_of_frames_change_nothing() -> None:
    frames = seen_from(ON_PLATE, ON_BASE)
    frames.say_moving(tf(transform("r1/map", "base_link", 1.0, 1.0, 1.0, stamp=5.0)))
    assert_placed(frames, "base_link", BASE)
    for stamp in (3.0, 4.0, 5.0):
        frames.say_moving(tf(transform("a", "base_link", 0.0, 0.0, 0.0, stamp=stamp)))
        frames.say_moving(tf(transform("base_link", "a", 0.0, 0.0, 0.0, stamp=stamp)))
        frames.placed(AT, stamp, "")
    assert frames.placed(AT, 5.0, "") is not None
