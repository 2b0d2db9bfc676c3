"""A bag that is played says where its robot is as the robot itself would."""

import math
from pathlib import Path

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.io.readers.options import ReadOptions
from mapweave.io.sources import Recording
from mapweave_agent.live.ros2_output import frames_of_recording
from tests.mapweave.io.test_beside_scans import said, write
from tests.ros.moving import ROS1, ROS2, TF_MESSAGE, tf, transform

AT = np.array([3.0, 1.0, 0.4])  # where a scan was taken, turned as the robot is


@pytest.mark.parametrize("form", ["bag", "db3", "mcap"])
def test_the_map_is_the_parent_of_what_the_bag_fixes_the_laser_to(
    form: str, tmp_path: Path
) -> None:
    store = ROS1 if form == "bag" else ROS2
    plate = transform("base_link", "plate", 0.5, 0.0, 0.0, store=store)
    laser = transform("plate", "laser", 0.2, -0.1, math.pi / 2, store=store)
    messages = [("/tf_static", TF_MESSAGE, tf(plate, laser, store=store)), *said(store)]
    bag = Recording(write(tmp_path, form, messages), ReadOptions())
    placed = frames_of_recording(bag).placed(AT, 5.0, "r1/base_link")
    assert placed is not None
    assert placed[0] == "base_link"
    laser_there = se2.compose(placed[1], np.array([0.7, -0.1, 0.0]))
    np.testing.assert_allclose(laser_there, AT, atol=1e-9)


def test_of_a_bag_without_transforms_the_laser_itself_is_placed(tmp_path: Path) -> None:
    bag = Recording(write(tmp_path, "mcap", said(ROS2)), ReadOptions())
    assert frames_of_recording(bag).of_robot("r1/base_link") == "laser"


def test_of_a_log_no_frame_is_known(tmp_path: Path) -> None:
    log = tmp_path / "some.log"
    log.write_text("FLASER 4 1.0 1.0 1.0 1.0 0 0 0 0 0 0 1.0 host 1.0\n" * 3)
    frames = frames_of_recording(Recording(log, ReadOptions()))
    assert frames.of_robot("r1/base_link") == "r1/base_link"
