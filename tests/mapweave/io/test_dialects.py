"""Logs are read as their writers meant them; what they do not say is assumed, and said once."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mapweave.errors import FileError
from mapweave.geometry.arrays import FloatArray
from mapweave.io.readers import count_scans, read_reference_poses, read_scans
from mapweave.scan.scan import Scan
from tests.mapweave import dialects
from tests.mapweave.dialects import NO_TIMES, TIMES, Sensor

FOV, RESOLUTION = "PARAM laser_front_laser_fov", "PARAM laser_front_laser_resolution"


def read(
    tmp_path: Path, text: str, *, step: float | None = None, odometry: bool = False
) -> tuple[list[Scan], list[str]]:
    path = tmp_path / "log"
    path.write_text(text)
    said: list[str] = []
    scans = read_scans(path, angular_step=step, odometry=odometry, on_warning=said.append)
    return list(scans), said


def beams(count: int, head: str = "", times: str = " 1 host 1") -> str:
    return f"{head}FLASER {count} {' '.join(['1.5'] * count)} 0 0 0 0 0 0{times}\n"


def robotlaser(start: float, field: float, resolution: float, readings: str) -> str:
    count = len(readings.split())
    tail = "0 " + "0 " * 11 + "1 host 1"
    return f"ROBOTLASER1 0 {start} {field} {resolution} 30 0 0 {count} {readings} {tail}\n"


def degrees(scan: Scan) -> FloatArray:
    return np.degrees(scan.angles)


def test_a_clockwise_sensor_has_its_readings_turned_round(tmp_path: Path) -> None:
    text = robotlaser(0.5, 1.0, -0.25, "1 2 3 4 5")
    (scan,), said = read(tmp_path, text)
    np.testing.assert_allclose(scan.angles, [-0.5, -0.25, 0, 0.25, 0.5])
    assert scan.ranges.tolist() == [5, 4, 3, 2, 1]
    assert said == []


@pytest.mark.parametrize("beams", [8, 180, 361, 682, 1080])
@pytest.mark.parametrize("field", [180, 240, 270, 360])
@pytest.mark.parametrize("start", [0.5, 1.0])
def test_a_clockwise_scan_is_the_mirror_of_one_that_turns_the_other_way(
    beams: int, field: float, start: float, tmp_path: Path
) -> None:
    readings = np.random.default_rng(beams).uniform(1, 9, beams)
    first, step = math.radians(start * field), math.radians(field) / (beams - 1)
    words = " ".join(f"{r:.3f}" for r in readings)
    (one,), _ = read(tmp_path, robotlaser(first, 1, -step, words))
    (other,), _ = read(tmp_path, robotlaser(-first, 1, step, words))
    np.testing.assert_allclose(one.angles, -other.angles[::-1], atol=1e-12)
    np.testing.assert_array_equal(one.ranges, other.ranges[::-1])


def test_beams_that_go_round_clockwise_more_than_once_are_damage(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="within one turn"):
        read(tmp_path, robotlaser(0.0, 1.0, -3.0, "1 2 3 4 5"))


def test_the_last_beam_of_a_turn_may_look_where_the_first_does(tmp_path: Path) -> None:
    text = robotlaser(-math.pi, 2 * math.pi, math.pi / 180, " ".join(["2"] * 361))
    (scan,), said = read(tmp_path, text)
    np.testing.assert_allclose(degrees(scan)[[0, -1]], [-180, 180], atol=1e-9)
    assert said == []


@pytest.mark.parametrize(
    ("field", "readings", "expected"),
    [(1.0, "1 2 3", [-0.5, 0, 0.5]), (-1.0, "1 2 3", [-1.5, -1, -0.5]),
     (2 * math.pi, "1 2 3 4", -0.5 + math.pi / 2 * np.arange(4)),
     (2 * math.pi, "1 2 3 4 5", -0.5 + math.pi / 2 * np.arange(5))],
)  # fmt: skip
def test_without_a_resolution_beams_are_spread_over_the_field_of_view_and_this_is_said(
    field: float, readings: str, expected: list[float], tmp_path: Path
) -> None:
    (scan,), (said,) = read(tmp_path, robotlaser(-0.5, field, 0, readings))
    np.testing.assert_allclose(scan.angles, expected, atol=1e-12)
    assert said.endswith("assumed: beams are spread over the field of view, as the resolution is 0")


@pytest.mark.parametrize(
    ("start", "field", "resolution", "count"),
    [(-90, 180, 1, 181), (-135, 270, 0.25, 1081), (0, 360, 1, 360), (120, 240, -0.5, 481),
     (-180, 360, 0, 360), (0, 359, 1, 360)],
)  # fmt: skip
def test_angles_that_can_only_be_degrees_are_read_as_degrees_and_this_is_said(
    start: float, field: float, resolution: float, count: int, tmp_path: Path
) -> None:
    (scan,), (said,) = read(tmp_path, robotlaser(start, field, resolution, "1 " * count))
    step = resolution or 1
    expected = np.sort(start + step * np.arange(count))
    np.testing.assert_allclose(degrees(scan), expected, atol=1e-9)
    assert "assumed: angles beyond a turn are degrees" in said


@pytest.mark.parametrize(
    ("start", "field", "resolution"), [(-90, 180, 0.0175), (-90, 3.14, 1), (-90, 500, 2.8)]
)
def test_angles_that_agree_in_no_unit_are_damage(
    start: float, field: float, resolution: float, tmp_path: Path
) -> None:
    with pytest.raises(FileError, match="expected two or more"):
        read(tmp_path, robotlaser(start, field, resolution, "1 " * 181))


@pytest.mark.parametrize(
    ("count", "first", "last", "step"),
    [(271, -135, 135, 1), (541, -135, 135, 0.5), (1081, -135, 135, 0.25),
     (681, -119.53, 119.53, 0.35156), (682, -119.53, 119.88, 0.35156),
     (683, -119.53, 120.23, 0.35156), (721, -90, 90, 0.25),
     (726, -135, 119.88, 0.35156), (769, -135, 135, 0.35156), (1440, -180, 179.75, 0.25)],
)  # fmt: skip
def test_a_number_of_beams_that_only_another_scanner_has_is_read_as_its_and_said_once(
    count: int, first: float, last: float, step: float, tmp_path: Path
) -> None:
    scans, (said,) = read(tmp_path, beams(count) * 3)
    for scan in scans:
        np.testing.assert_allclose(degrees(scan)[[0, -1]], [first, last], atol=0.01)
        np.testing.assert_allclose(np.diff(degrees(scan)), step, atol=1e-4)
    assert said.count(f"the {count} beams of a FLASER look over") == 1
    assert "set [sensor] angular_step, or state PARAM laser_front_laser_fov" in said


@pytest.mark.parametrize("count", [90, 180, 181, 360, 361, 401])
def test_nothing_is_said_of_the_beams_that_flaser_was_made_for(count: int, tmp_path: Path) -> None:
    assert read(tmp_path, beams(count) * 3)[1] == []


@pytest.mark.parametrize(
    ("count", "head", "first", "last"),
    [(721, f"{FOV} 180\n", -90, 90), (721, f"{FOV} 360\n", -180, 180),
     (720, f"{FOV} 360\n", -180, 179.5), (541, f"{RESOLUTION} 0.5\n", -135, 135),
     (541, f"{FOV} 180 1.5 host 1.5\n", -90, 90), (682, f"{FOV} 240\n", -119.53, 119.88),
     (682, f"{FOV} 240\n{RESOLUTION} 0.36\n", -119.53, 119.88),
     (180, f"{FOV} 180\n{RESOLUTION} 1.0\n", -90, 89), (360, f"{RESOLUTION} 1.0\n", -180, 179),
     (401, f"{FOV} 180\n{RESOLUTION} 0.25\n", -50, 50), (101, f"{RESOLUTION} 1.0\n", -50, 50),
     (600, f"{FOV} 240\n{RESOLUTION} 0.4\n", -120, 119.6),
     (541, f"{FOV} 20\n{FOV} 270\n", -135, 135)],
)  # fmt: skip
def test_a_log_may_state_the_field_of_view_of_its_front_laser_in_degrees(
    count: int, head: str, first: float, last: float, tmp_path: Path
) -> None:
    (scan,), said = read(tmp_path, beams(count, head))
    np.testing.assert_allclose(degrees(scan)[[0, -1]], [first, last], atol=0.01)
    assert said == []


def test_a_negative_resolution_of_the_front_laser_turns_its_readings_round(tmp_path: Path) -> None:
    text = f"{FOV} 4\n{RESOLUTION} -1\nFLASER 5 1 2 3 4 5 0 0 0 0 0 0 1 host 1\n"
    (scan,), said = read(tmp_path, text)
    np.testing.assert_allclose(degrees(scan), [-2, -1, 0, 1, 2], atol=1e-9)
    assert scan.ranges.tolist() == [5, 4, 3, 2, 1]
    assert said == []


@pytest.mark.parametrize("head", [f"{FOV} 4.712389\n", f"{RESOLUTION} 0.0087266\n"])
def test_a_field_of_view_of_a_few_degrees_is_radians_and_this_is_said(
    head: str, tmp_path: Path
) -> None:
    (scan,), (said,) = read(tmp_path, beams(541, head))
    np.testing.assert_allclose(degrees(scan)[[0, -1]], [-135, 135], atol=0.01)
    assert "are radians" in said


@pytest.mark.parametrize("value", ["nan", "0", "1e9", "wide", "-inf", "\xff"])
def test_a_field_of_view_that_is_none_does_not_count_and_this_is_said(
    value: str, tmp_path: Path
) -> None:
    (scan,), (said,) = read(tmp_path, beams(181, f"{FOV} {value}\nPARAM\n{FOV}\n"))
    np.testing.assert_allclose(degrees(scan)[[0, -1]], [-90, 90])
    assert "PARAM laser_front_laser_fov is no angle in degrees and is ignored" in said


@pytest.mark.parametrize(
    ("count", "head", "last"),
    [(541, f"{RESOLUTION} 1.0\n", 135), (501, f"{FOV} 250\n{RESOLUTION} 1\n", 125)],
)  # fmt: skip
def test_a_resolution_that_does_not_fit_the_beams_does_not_count_and_this_is_said(
    count: int, head: str, last: float, tmp_path: Path
) -> None:
    (scan,), (said,) = read(tmp_path, beams(count, head))
    assert degrees(scan)[-1] == pytest.approx(last)
    assert f"PARAM laser_front_laser_resolution does not fit {count} beams and is ignored" in said


def test_what_the_user_knows_of_the_beams_goes_before_what_the_log_says(tmp_path: Path) -> None:
    (scan,), said = read(tmp_path, beams(541, f"{FOV} 180\n"), step=math.radians(0.5))
    np.testing.assert_allclose(degrees(scan)[[0, -1]], [-135, 135])
    assert said == []


def test_a_flaser_may_end_after_its_poses(tmp_path: Path) -> None:
    line = "FLASER 3 1 2 3 4 5 0.5 6 7 0.25\n"
    (scan, other), (said,) = read(tmp_path, line * 2, odometry=True)
    assert scan.ranges.tolist() == other.ranges.tolist() == [1, 2, 3]
    assert math.isnan(scan.stamp)
    np.testing.assert_array_equal(scan.odometry, [6, 7, 0.25])
    np.testing.assert_array_equal(read_reference_poses(tmp_path / "log")[1], [[4, 5, 0.5]] * 2)
    assert said.endswith("assumed: scans follow each other evenly, as they have no stamps")


def test_where_other_lines_have_times_a_flaser_without_is_cut_off(tmp_path: Path) -> None:
    line = "FLASER 3 1 2 3 4 5 0.5 6 7 0.25"
    scans, (said,) = read(tmp_path, f"{line} 1 host 1\n{line}\n")
    assert len(scans) == 1
    assert "dropped 1 damaged line, the first line 2: FLASER has 11 words, expected 14" in said


@pytest.mark.parametrize(
    "stamps",
    [range(10, 0, -1), [5.0] * 12, ["nan"] * 3, ["inf", "nan"], [5 + k / 1000 for k in range(12)]],
)
def test_stamps_that_tell_no_time_stay_and_what_is_assumed_is_said(
    stamps: list[object], tmp_path: Path
) -> None:
    text = "".join(beams(5, times=f" {stamp} host 1") for stamp in stamps)
    scans, (said,) = read(tmp_path, text)
    recorded = [float(str(stamp)) for stamp in stamps]
    expected = [stamp if math.isfinite(stamp) else math.nan for stamp in recorded]
    np.testing.assert_array_equal([scan.stamp for scan in scans], expected)
    assert "assumed: scans follow each other evenly, as " in said


@pytest.mark.parametrize(
    "stamps", [[*range(60), *range(-900, -860)],
               [1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 5], [1, 2, 3, 9, 1, 2, 3, 4, 5, 6, 7], [7, 7, 7],
               [1, "nan", 2, "nan", "nan", 3, 3, 3, 3, 3, 4], [1]]
)  # fmt: skip
def test_stamps_some_of_which_repeat_or_run_back_are_no_matter(
    stamps: list[object], tmp_path: Path
) -> None:
    text = "".join(beams(5, times=f" {stamp} host 1") for stamp in stamps)
    assert read(tmp_path, text)[1] == []


def test_damage_and_what_was_assumed_are_told_in_one_line(tmp_path: Path) -> None:
    text = beams(541) * 12 + "FLASER 541 1\n" + beams(1081) * 2
    _, (said,) = read(tmp_path, text)
    assert said.index("dropped 1 damaged line") < said.index("the 541 beams")
    assert said.index("the 541 beams") < said.index("the 1081 beams") < said.index("the stamp 1")
    assert said.isprintable()


def test_a_log_of_ever_other_scanners_makes_no_endless_warning(tmp_path: Path) -> None:
    text = "".join(beams(5, f"{RESOLUTION} nan\n{FOV} {k}\n") + beams(k + 900) for k in range(300))
    _, (said,) = read(tmp_path, text)
    assert len(said) < 1500


@pytest.mark.parametrize("pose", [False, True])
def test_a_player_log_is_read_as_its_documentation_has_it(pose: bool, tmp_path: Path) -> None:
    sensor = Sensor(-90, 1, 181)
    scans, said = read(tmp_path, dialects.player(sensor, pose), odometry=True)
    stated, _ = read(tmp_path, dialects.robotlaser(sensor))
    assert said == []
    assert [scan.stamp for scan in scans] == [scan.stamp for scan in stated]
    assert scans[0].odometry is None or scans[0].odometry.tolist() == [1, 2, 0.5]
    assert (scans[0].odometry is not None) == pose
    for scan, other in zip(scans, stated, strict=True):
        np.testing.assert_allclose(scan.angles, other.angles, atol=1e-5)
        np.testing.assert_array_equal(scan.ranges, other.ranges)


def test_a_damaged_line_of_a_player_log_is_told(tmp_path: Path) -> None:
    text = dialects.player(Sensor(-90, 1, 181))
    scans, (said,) = read(tmp_path, text[:-40])
    assert len(scans) == len(dialects.drive()) - 1
    assert "dropped 1 damaged line, the first line 25: laser has" in said


def test_a_log_of_dpslam_has_its_odometry_before_each_scan_and_no_times(tmp_path: Path) -> None:
    sensor = Sensor(-90, 1, 181)
    scans, (said,) = read(tmp_path, dialects.dpslam(sensor), odometry=True)
    stated, _ = read(tmp_path, dialects.robotlaser(sensor))
    assert said.endswith("assumed: scans follow each other evenly, as they have no stamps")
    for k, (scan, other) in enumerate(zip(scans, stated, strict=True)):
        np.testing.assert_allclose(scan.angles, other.angles, atol=1e-5)
        np.testing.assert_array_equal(scan.ranges, other.ranges)
        np.testing.assert_array_equal(scan.odometry, [k / 4, -0.5, 0.25])
        assert math.isnan(scan.stamp)


@pytest.mark.parametrize("odometry", ["", "Odometry\n", "Odometry 1 2 x\n", "Odometry 1 2\n"])
def test_a_log_of_dpslam_without_sound_odometry_has_none(odometry: str, tmp_path: Path) -> None:
    (scan,), _ = read(tmp_path, f"{odometry}Laser 3 1 2 3\n", odometry=True)
    assert scan.odometry is None and scan.ranges.tolist() == [1, 2, 3]


def test_a_scan_of_dpslam_that_is_cut_off_is_told(tmp_path: Path) -> None:
    scans, (said,) = read(tmp_path, "Laser 3 1 2 3\nLaser 3 1 2\nLaser\nLaser on\n")
    assert len(scans) == 1
    assert "dropped 1 damaged line, the first line 2: Laser has 4 words, expected 5" in said


SENSOR = Sensor(-135, 45, 7)
LOGS = [
    dialects.robotlaser(SENSOR),
    dialects.robotlaser(Sensor(135, -45, 7)),
    dialects.robotlaser(SENSOR, unit=float),
    dialects.flaser(SENSOR, f"{FOV} 270\n{RESOLUTION} 45\n", NO_TIMES),
    dialects.flaser(SENSOR, f"{FOV} 4.7\n", TIMES),
    dialects.player(SENSOR),
    dialects.dpslam(SENSOR),
]
WORDS = st.sampled_from(
    ["", " ", "\n", "0", "-1", "nan", "inf", "-inf", "1e999", "1e-320", "360", "541", "9" * 30,
     "FLASER", "ROBOTLASER1", "PARAM", "laser", "\n0.5 1 1 laser 00 001 001 ", f"\n{FOV} ",
     f"\n{RESOLUTION} "]
)  # fmt: skip


@settings(max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    log=st.sampled_from(LOGS),
    changes=st.lists(
        st.tuples(st.integers(0, 1 << 20), WORDS | st.text(max_size=3)), min_size=1, max_size=12
    ),
    step=st.none() | st.floats(1e-4, 0.2),
)
def test_no_words_in_whatever_places_of_a_log_raise_anything_but_a_file_error(
    log: str, changes: list[tuple[int, str]], step: float | None, tmp_path: Path
) -> None:
    words = log.replace("\n", " \n ").split(" ")
    for place, word in changes:
        words[place % min(len(words), 120)] = word
    path = tmp_path / "log"
    path.write_bytes(" ".join(words).encode(errors="surrogatepass"))
    said: list[str] = []
    try:
        scans = list(read_scans(path, angular_step=step, on_warning=said.append))
    except FileError as error:
        assert str(error).isprintable()
        return
    assert count_scans(path, step) == len(scans)
    if step is None:
        assert set(read_reference_poses(path)[0].tolist()) <= set(range(len(scans)))
    assert len(said) <= 1 and all(line.isprintable() for line in said)
    for scan in scans:
        assert scan.angles.shape == scan.ranges.shape
        assert (np.diff(scan.angles) > 0).all()
        assert scan.angles[-1] - scan.angles[0] < 3 * 2 * math.pi
