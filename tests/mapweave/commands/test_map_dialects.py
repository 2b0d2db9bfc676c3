"""``mapweave map`` on logs of sensors and programs other than those it grew up with."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from mapweave.cli import main
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.io.map_files import read_map
from mapweave.maps import RobotMap
from tests.mapweave import dialects
from tests.mapweave.dialects import NO_TIMES, Sensor

CASES = Path(__file__).parents[2] / "cases"
FOV, RESOLUTION = "PARAM laser_front_laser_fov", "PARAM laser_front_laser_resolution"

CLOCKWISE = {
    "a full turn from ahead, as a cheap lidar's": Sensor(0, -0.8, 450),
    "a full turn from behind, ending where it began": Sensor(180, -1, 361),
    "a SICK upside down": Sensor(90, -0.5, 361),
    "a Hokuyo upside down": Sensor(119.88, -360 / 1024, 682),
    "270° of a sensor that looks aside": Sensor(200, -0.5, 541),
}
UNTIMED = {
    "180 beams": dialects.flaser(Sensor(-90, 1, 180), times=NO_TIMES),
    "361 beams": dialects.flaser(Sensor(-90, 0.5, 361), times=NO_TIMES),
    "another sensor's": dialects.flaser(Sensor(-135, 0.5, 541), times=NO_TIMES),
    "240° as stated": dialects.flaser(Sensor(-120, 0.5, 481), f"{FOV} 240\n", NO_TIMES),
    "DP-SLAM's": dialects.dpslam(Sensor(-90, 1, 181)),
    "other ends of lines": dialects.flaser(Sensor(-90, 1, 181), "# a\n\n", " \t\r"),
}
OTHER_SCANNERS = {
    "270° by its number": Sensor(-135, 1, 271),
    "240° by its number": Sensor(-340 * 360 / 1024, 360 / 1024, 682),
    "more behind on one side": Sensor(-135, 360 / 1024, 726),
    "270° of 1081": Sensor(-135, 0.25, 1081),
    "a full turn by its number": Sensor(-180, 0.25, 1440),
}
STATED = {
    "a full turn": (Sensor(-180, 0.5, 720), f"{FOV} 360.0 1 host 1\n"),
    "240°": (Sensor(-120, 0.8, 301), f"{FOV} 240\n{RESOLUTION} 0.8\n"),
    "270° by its resolution": (Sensor(-135, 0.75, 361), f"{FOV} 270\n{RESOLUTION} 0.75\n"),
    "clockwise": (Sensor(135, -0.5, 541), f"{FOV} 270\n{RESOLUTION} -0.5\n"),
}


def run_map(log: Path, tmp_path: Path) -> RobotMap:
    output = tmp_path / "map.json"
    assert main(["map", str(log), "--output", str(output)]) == 0
    return read_map(output)


def poses(robot_map: RobotMap) -> FloatArray:
    """Return the (n, 3) poses of the scans in the map's only component, in their order."""
    assert len(robot_map.components) == 1
    placed = [
        (index, se2.compose(submap.pose, pose))
        for submap in robot_map.submaps
        for index, pose in zip(submap.trajectory.scan_index, submap.trajectory.pose, strict=True)
    ]
    return np.array([pose for _, pose in sorted(placed, key=lambda each: each[0])])


def assert_is_the_drive(robot_map: RobotMap) -> None:
    """Check that the robot is where it was, to either side, at each scan: nothing is mirrored."""
    found, truth = poses(robot_map), dialects.drive()
    assert found.shape == truth.shape
    error = se2.between(se2.between(truth[0], truth), se2.between(found[0], found))
    assert np.hypot(error[:, 0], error[:, 1]).max() < 0.1
    assert np.abs(error[:, 2]).max() < 0.05


def write(tmp_path: Path, text: str) -> Path:
    log = tmp_path / "a.log.gz"
    log.write_bytes(gzip.compress(text.encode()))
    return log


@pytest.mark.parametrize(
    ("case", "log", "words"),
    [
        ("clockwise", "clockwise.log", []),
        ("flaser_no_times", "no_times.log", ["no stamps"]),
        (
            "flaser_other_fov",
            "flaser541of270.log",
            ["541 beams", "over 270°", "all have the stamp"],
        ),
    ],
)
def test_a_log_that_an_engineer_reported_is_mapped_in_one_piece_and_says_what_was_assumed(
    case: str, log: str, words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert len(poses(run_map(CASES / case / log, tmp_path))) == 40
    done = capsys.readouterr()
    assert done.out.startswith("40 of 40 scans placed, 40 in the largest of 1 component; ")
    assert done.err.count("\n") == bool(words)
    for word in words:
        assert done.err.count(word) == 1


@pytest.mark.parametrize("kind", CLOCKWISE)
def test_a_sensor_that_turns_clockwise_maps_what_any_other_would(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert_is_the_drive(run_map(write(tmp_path, dialects.robotlaser(CLOCKWISE[kind])), tmp_path))
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("kind", UNTIMED)
def test_a_log_without_times_is_mapped(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert_is_the_drive(run_map(write(tmp_path, UNTIMED[kind]), tmp_path))
    assert "scans follow each other evenly, as they have no stamps" in capsys.readouterr().err


@pytest.mark.parametrize("kind", OTHER_SCANNERS)
def test_a_flaser_of_a_scanner_known_by_its_beams_is_mapped_and_this_is_said(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sensor = OTHER_SCANNERS[kind]
    assert_is_the_drive(run_map(write(tmp_path, dialects.flaser(sensor)), tmp_path))
    assert capsys.readouterr().err.count(f"the {sensor.beams} beams of a FLASER look over") == 1


@pytest.mark.parametrize("kind", STATED)
def test_a_flaser_whose_field_of_view_the_log_states_is_mapped_without_a_word(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sensor, head = STATED[kind]
    assert_is_the_drive(run_map(write(tmp_path, dialects.flaser(sensor, head)), tmp_path))
    assert capsys.readouterr().err == ""


def test_a_log_in_degrees_and_one_of_player_are_mapped(tmp_path: Path) -> None:
    sensor = Sensor(-90, 1, 181)
    degrees = write(tmp_path, dialects.robotlaser(sensor, unit=float))
    assert_is_the_drive(run_map(degrees, tmp_path))
    assert_is_the_drive(run_map(write(tmp_path, dialects.player(sensor)), tmp_path))


def test_the_largest_range_that_a_sensor_is_set_to_holds_whichever_way_it_turns(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = write(tmp_path, dialects.robotlaser(CLOCKWISE["a SICK upside down"]))
    free = run_map(log, tmp_path)
    monkeypatch.setenv("MAPWEAVE_SENSOR_MAX_RANGE", "8")
    near = run_map(log, tmp_path)
    assert_is_the_drive(near)
    assert reach(near) < reach(free) - 1


def test_what_the_sensor_sees_of_its_own_robot_is_left_out_where_it_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sensor = Sensor(-180, 1, 360)
    log = write(tmp_path, with_body(dialects.robotlaser(sensor)))
    monkeypatch.setenv("MAPWEAVE_SENSOR_MASKS", "[[120, -120]]")
    masked = run_map(log, tmp_path)
    assert_is_the_drive(masked)
    assert masked.made_with is not None
    assert masked.made_with.config["sensor"]["masks"] == [[120.0, -120.0]]
    monkeypatch.delenv("MAPWEAVE_SENSOR_MASKS")
    monkeypatch.setenv("MAPWEAVE_SENSOR_RANGE_MIN", "0.4")
    assert_is_the_drive(run_map(log, tmp_path))


def with_body(text: str) -> str:
    """Return a log of 360 beams, from behind on, that see the robot itself 60° to either side."""
    changed = []
    for line in text.splitlines():
        words = line.split()
        for beam in [*range(60), *range(301, 360)]:
            words[9 + beam] = "0.300"
        changed.append(" ".join(words) + "\n")
    return "".join(changed)


def reach(robot_map: RobotMap) -> float:
    """Return how far [m] from the first submap's origin a wall was seen."""
    return float(np.abs(robot_map.submaps[0].map.segments).max())
