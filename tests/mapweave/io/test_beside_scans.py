"""What a bag says beside its scans: where the laser sits, and the robot's odometry."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2

from mapweave.errors import FileError
from mapweave.geometry import se2
from mapweave.io.readers import read_scans
from mapweave.io.readers.odometry_track import OdometryTrack
from mapweave.io.readers.options import OdometryChoice
from mapweave.io.readers.ros_bags.frames import StaticFrames, TiltedError
from mapweave.io.readers.ros_bags.laser_messages import LASER_SCAN
from mapweave.scan.mounting import Mounting
from tests.mapweave.io.bag_files import Laser
from tests.ros.moving import ODOMETRY, ROS1, ROS2, TF_MESSAGE, Made, odometry, tf, transform

LASER = Laser(np.arange(1.0, 9.0), angle_min=-0.4, angle_increment=0.1)  # stamps 100.25, 101.25…
Said = list[tuple[str, str, Made]]  # topic, type and message


def said(store: Made, scans: int = 3) -> Said:
    return [("/scan", LASER_SCAN, LASER.message(k, ros1=store is ROS1)) for k in range(scans)]


def write(path: Path, form: str, messages: Said) -> Path:
    """Write a bag of one form, its messages in their order."""
    if form == "bag":
        with Writer1(path := path / "some.bag") as writer:
            made = {}
            for count, (topic, kind, message) in enumerate(messages):
                if topic not in made:
                    made[topic] = writer.add_connection(topic, kind, typestore=ROS1)
                data = ROS1.serialize_ros1(message, kind)
                writer.write(made[topic], count * 10**7, data)
        return path
    plugin = StoragePlugin.MCAP if form == "mcap" else StoragePlugin.SQLITE3
    with Writer2(path / "some", version=9, storage_plugin=plugin) as recorder:
        declared = {}
        for count, (topic, kind, message) in enumerate(messages):
            if topic not in declared:
                declared[topic] = recorder.add_connection(topic, kind, typestore=ROS2)
            recorder.write(declared[topic], count * 10**7, ROS2.serialize_cdr(message, kind))
    return path / "some"


@pytest.mark.parametrize("form", ["bag", "db3", "mcap"])
def test_a_laser_that_hangs_turned_is_set_right_by_the_bags_own_transforms(
    form: str, tmp_path: Path
) -> None:
    store = ROS1 if form == "bag" else ROS2
    plate = transform("base_link", "plate", 0.1, 0.0, math.pi / 2, store=store)
    laser = transform("plate", "laser", 0.2, 0.0, 0.0, math.pi, store=store)
    messages = [("/tf_static", TF_MESSAGE, tf(plate, laser, store=store)), *said(store)]
    scans = list(read_scans(write(tmp_path, form, messages)))
    assert len(scans) == 3
    for scan in scans:
        np.testing.assert_allclose(scan.angles, np.pi / 2 + np.arange(-0.3, 0.45, 0.1), atol=1e-6)
        np.testing.assert_allclose(scan.ranges, np.arange(8.0, 0.0, -1.0))


def test_a_transform_that_cannot_be_read_is_told_of_and_scans_are_read_without_it(
    tmp_path: Path,
) -> None:
    warned: list[str] = []
    with Writer2(tmp_path / "some", version=9, storage_plugin=StoragePlugin.MCAP) as recorder:
        for topic, kind, message in [
            ("/tf_static", TF_MESSAGE, tf(transform("base_link", "laser", 0, 0, 0.5))),
            *said(ROS2, scans=1),
        ]:
            data = bytes(ROS2.serialize_cdr(message, kind))
            half = data[: len(data) // 2] if kind == TF_MESSAGE else data
            connection = recorder.add_connection(topic, kind, typestore=ROS2)
            recorder.write(connection, 0, half)
    (scan,) = read_scans(tmp_path / "some", on_warning=warned.append)
    assert scan.angles[0] == pytest.approx(-0.4, abs=1e-6)
    (line,) = warned
    assert "assumed: messages of /tf_static that cannot be read say nothing" in line


def test_transforms_that_come_last_count_as_well_and_those_of_others_do_not(
    tmp_path: Path,
) -> None:
    other = tf(transform("base_link", "camera", 0, 0, 1.0))
    turned = tf(transform("base_link", "laser", 0, 0, 0.5))
    messages = [
        ("/tf_static", TF_MESSAGE, other),
        *said(ROS2),
        ("/r1/tf_static", TF_MESSAGE, turned),
    ]
    first, *_ = read_scans(write(tmp_path, "mcap", messages))
    assert first.angles[0] == pytest.approx(0.1, abs=1e-6)


SIDES = {"/front": (0.3, 0.0), "/rear": (-0.3, math.pi)}  # metres ahead, and where each looks


def two_lasers(store: Made, distance: float = 1.0) -> Said:
    """A robot whose lasers see half a turn each, and everywhere the same distance."""
    half = Laser(np.full(181, distance), angle_min=-math.pi / 2, angle_increment=math.radians(1))
    ros1 = store is ROS1
    fixed = [
        transform("base_link", topic[1:], x, 0.0, turn, store=store)
        for topic, (x, turn) in SIDES.items()
    ]
    scans = [
        (topic, LASER_SCAN, replace(half, frame=topic[1:]).message(k, ros1=ros1))
        for k in range(3)
        for topic in SIDES
    ]
    return [("/tf_static", TF_MESSAGE, tf(*fixed, store=store)), *scans]


@pytest.mark.parametrize("form", ["bag", "db3", "mcap"])
def test_two_lasers_of_a_bag_are_one_that_sees_a_whole_turn_from_the_middle(
    form: str, tmp_path: Path
) -> None:
    bag = write(tmp_path, form, two_lasers(ROS1 if form == "bag" else ROS2))
    scans = list(read_scans(bag, topic="/front+rear"))
    assert [scan.index for scan in scans] == [0, 1, 2]
    assert [scan.stamp for scan in scans] == [100.25, 101.25, 102.25]
    for scan in scans:
        seen = scan.points[scan.hits]
        ahead = np.where(seen[:, 0] > 0, 0.3, -0.3)
        near = np.hypot(seen[:, 0] - ahead, seen[:, 1])
        np.testing.assert_allclose(near, 1.0, atol=0.02)
        assert np.ptp(np.arctan2(seen[:, 1], seen[:, 0])) > math.radians(355)


def test_two_lasers_need_to_be_known_where_they_sit_and_are_named_once(tmp_path: Path) -> None:
    bag = write(tmp_path, "mcap", two_lasers(ROS2)[1:])
    with pytest.raises(FileError, match=r"several lasers, .* with --topic, or all: /front\+/rear"):
        list(read_scans(bag))
    with pytest.raises(FileError, match="says where the laser of /front sits, in frame 'front'"):
        list(read_scans(bag, topic="/front+/rear"))
    with pytest.raises(FileError, match=r"no laser scans on topic /left; there are /front \(3"):
        list(read_scans(bag, topic="/front+/left"))
    assert len(list(read_scans(bag, topic="/front+/front"))) == 3


def test_a_tilted_laser_is_refused_in_one_line(tmp_path: Path) -> None:
    messages = [("/tf_static", TF_MESSAGE, tf(transform("b", "laser", 0, 0, 0, 0.5))), *said(ROS2)]
    bag = write(tmp_path, "mcap", messages)
    with pytest.raises(FileError, match=r"'laser' is tilted by 29°; expected one that looks level"):
        list(read_scans(bag))


@pytest.mark.parametrize("form", ["bag", "db3", "mcap"])
@pytest.mark.parametrize("how", [True, "/odom", "/tf"])
def test_odometry_is_that_of_the_moment_and_of_where_the_laser_is(
    form: str, how: bool | str, tmp_path: Path
) -> None:
    store = ROS1 if form == "bag" else ROS2
    stamps, x = np.arange(100.0, 104.0, 0.1), np.arange(0.0, 4.0, 0.1)
    if how == "/tf":
        moving = [
            (
                "/tf",
                TF_MESSAGE,
                tf(transform("odom", "base_link", a, 0, 0.1, 0, t, store), store=store),
            )
            for t, a in zip(stamps, x, strict=True)
        ]
    else:
        moving = [
            ("/odom", ODOMETRY, odometry(t, a, 0.0, 0.1, store))
            for t, a in zip(stamps, x, strict=True)
        ]
    place = tf(transform("base_link", "laser", 0.5, 0.0, 0.0, store=store), store=store)
    bag = write(tmp_path, form, [*said(store), ("/tf_static", TF_MESSAGE, place), *moving])
    scans = list(read_scans(bag, odometry=how))
    for k, scan in enumerate(scans):
        assert scan.odometry is not None
        expected = se2.compose([0.25 + k, 0.0, 0.1], [0.5, 0.0, 0.0])
        np.testing.assert_allclose(scan.odometry, expected, atol=1e-4)
    assert all(scan.odometry is None for scan in read_scans(bag))


def test_which_odometry_there_is_is_told_where_it_is_not_plain(tmp_path: Path) -> None:
    pose = odometry(100.0, 0, 0, 0)
    one, two = tmp_path / "one", tmp_path / "two"
    one.mkdir()
    two.mkdir()
    several = write(
        one, "mcap", [*said(ROS2), ("/odom", ODOMETRY, pose), ("/wheels/odom", ODOMETRY, pose)]
    )
    with pytest.raises(FileError, match=r"/odom \(1\), /wheels/odom \(1\); name one with --odom"):
        list(read_scans(several, odometry=True))
    with pytest.raises(FileError, match=r"no odometry at /gps; there is /odom \(1\), /wheels"):
        list(read_scans(several, odometry="/gps"))
    with pytest.raises(FileError, match="has no nav_msgs/msg/Odometry; expected one, or"):
        list(read_scans(write(two, "mcap", said(ROS2)), odometry=True))
    moving = tf(transform("odom", "base_link", 1, 0, 0, 0, 100.0, ROS2), store=ROS2)
    three = tmp_path / "three"
    three.mkdir()
    bag = write(three, "mcap", [*said(ROS2), ("/tf", TF_MESSAGE, moving)])
    with pytest.raises(FileError, match="no odometry at /odom; there is none; its /tf has: --od"):
        list(read_scans(bag, odometry="/odom"))


def test_between_two_poses_the_robot_is_on_its_way_and_long_after_nowhere() -> None:
    track = OdometryTrack()
    assert track.at(1.0) is None
    for stamp, pose in ((1.0, [0, 0, 3.0]), (2.0, [1, 0, -3.0])):
        track.add(stamp, np.array(pose, dtype=float))
    middle = track.at(1.5)
    assert middle is not None
    assert abs(middle[2]) == pytest.approx(np.pi)  # the short way round
    assert track.at(0.9) is None and track.at(2.3) is None and track.at(math.nan) is None
    on = track.at(2.1)
    assert on is not None and on[0] > 1.0
    first = track.at(1.0)
    assert first is not None and first[2] == 3.0
    track.add(0.5, np.zeros(3))  # a clock that was set back: what was before counts no more
    assert track.at(1.5) is None


def test_only_so_much_odometry_is_remembered() -> None:
    track = OdometryTrack(10)
    for stamp in range(100):
        track.add(float(stamp), np.array([stamp, 0.0, 0.0]))
    assert track.at(50.5) is None
    late = track.at(95.5)
    assert late is not None and late[0] == pytest.approx(95.5)


def test_frames_that_are_fixed_to_each_other_and_motions_that_are_none_say_nothing() -> None:
    frames = StaticFrames()
    broken = transform("base", "laser", math.nan, 0, 0)
    flat = transform("base", "laser", 0, 0, 0)
    flat.transform.rotation.w = 0.0
    frames.add(tf(broken, flat, transform("laser", "laser", 0, 0, 0)))
    assert frames.mounting("laser") is None
    frames.add(tf(transform("a", "b", 0, 0, 0), transform("b", "a", 0, 0, 0)))
    assert frames.mounting("a") is None
    frames.add(tf(transform("/base", "/laser", 1.0, 2.0, 0.5)))
    found = frames.mounting("laser")
    assert found is not None
    assert (found.x, found.y, found.theta) == pytest.approx((1.0, 2.0, 0.5))
    assert found != Mounting()
    frames.add(tf(transform("base", "up", 0, 0, 0, 1.0)))
    with pytest.raises(TiltedError, match="57°"):
        frames.mounting("up")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("none", OdometryChoice()),
        ("prior", OdometryChoice(True)),
        ("/odom", OdometryChoice(True, "/odom")),
        ("ros2:/r1/tf", OdometryChoice(True, "/r1/tf", True)),
    ],
)
def test_a_word_says_which_odometry_may_help(text: str, expected: OdometryChoice) -> None:
    assert OdometryChoice.parse(text) == expected


@pytest.mark.parametrize("text", ["", "odom", "ros2:odom", "ros1:/odom", "/odom/", "maybe"])
def test_other_words_say_nothing_of_odometry(text: str) -> None:
    with pytest.raises(ValueError, match="expected none, prior, or a topic"):
        OdometryChoice.parse(text)
