"""Logs of every kind are read as they say, and no pose in them leaks into a run."""

import gzip
import io
import math
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from mapweave.errors import FileError
from mapweave.geometry import se2
from mapweave.io.readers import count_scans, read_reference_poses, read_scans
from mapweave.scan.scan import Scan

FLASER = b"FLASER 5 1.5 2.5 3.5 4.5 5.5 1 2 0.5 3 4 0.25 17.5 host 0.1\n"
ROBOTLASER = (
    b"ROBOTLASER1 0 -0.5 1.0 0.25 30.0 0.01 0 5 1.5 2.5 3.5 4.5 5.5 0"
    b" 0.96 2 0 1 2 0 0 0 0 0 0 17.5 host 0.1\n"
)
TORO = b"VERTEX2 0 5 6 1.5707963267948966\n" + ROBOTLASER + b"EDGE2 0 1 0 0 0 1 0 1 1 0 0\n"
G2O = b"VERTEX_SE2 0 5 6 1.5707963267948966\n" + ROBOTLASER + b"EDGE_SE2 0 1 0 0 0 1 0 0 1 0 1\n"

COUNTS = {  # The table of the folder's README: scans and beams.
    "fr079.log.gz": (1464, 360),
    "fr079-dense.log.gz": (4791, 360),
    "intel-lab.log.gz": (2672, 180),
    "intel.log.gz": (910, 180),
    "mit-csail.clf.gz": (1988, 361),
    "mit-csail-corrected.log.gz": (1051, 361),
    "seattle.log.gz": (241, 361),
}


def fail_on_warning(message: str) -> None:
    pytest.fail(message)


def read(path: Path, *, odometry: bool = False) -> list[Scan]:
    return list(read_scans(path, odometry=odometry, on_warning=fail_on_warning))


def read_text(tmp_path: Path, text: bytes, *, odometry: bool = False) -> list[Scan]:
    path = tmp_path / "log"
    path.write_bytes(text)
    return read(path, odometry=odometry)


def zipped(text: bytes, method: int = zipfile.ZIP_DEFLATED) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        archive.writestr("notes/", b"")
        archive.writestr("notes/readme.txt", b"a note")
        archive.writestr("the.log", text)
    return buffer.getvalue()


PACKINGS: dict[str, Callable[[bytes], bytes]] = {
    "plain": lambda text: text,
    "gzip": gzip.compress,
    "two gzip streams": lambda text: gzip.compress(text[:40]) + gzip.compress(text[40:]),
    "zip": zipped,
    "stored zip": lambda text: zipped(text, zipfile.ZIP_STORED),
}


@pytest.mark.parametrize("name", COUNTS)
def test_a_real_log_has_the_scans_and_beams_its_readme_states(name: str, data_dir: Path) -> None:
    scans = read(data_dir / name)
    count, beams = COUNTS[name]
    assert [scan.index for scan in scans] == list(range(count))
    assert {len(scan.ranges) for scan in scans} == {beams}
    assert {len(scan.angles) for scan in scans} == {beams}
    # Nothing measured in these buildings is farther, so no code was taken for a wall.
    assert np.nanmax([scan.ranges for scan in scans]) < 45
    assert np.mean([scan.hits.mean() for scan in scans]) > 0.95


@pytest.mark.parametrize(
    ("flaser", "robotlaser"),
    [("fr079-dense.log.gz", "fr079.log.gz"), ("intel.log.gz", "intel-lab.log.gz"),
     ("mit-csail.clf.gz", "mit-csail-corrected.log.gz")],
)  # fmt: skip
def test_the_angles_a_flaser_leaves_unsaid_are_those_the_same_laser_stated(
    flaser: str, robotlaser: str, data_dir: Path
) -> None:
    unsaid = next(read_scans(data_dir / flaser, on_warning=fail_on_warning))
    stated = next(read_scans(data_dir / robotlaser, on_warning=fail_on_warning))
    np.testing.assert_allclose(unsaid.angles, stated.angles, atol=2e-4)


def test_two_recordings_of_one_run_give_the_same_scans(data_dir: Path) -> None:
    raw = {scan.stamp: scan for scan in read(data_dir / "mit-csail.clf.gz")}
    for scan in read(data_dir / "mit-csail-corrected.log.gz"):
        np.testing.assert_array_equal(scan.ranges, raw[scan.stamp].ranges)


@pytest.mark.parametrize("packing", PACKINGS)
@pytest.mark.parametrize(
    "log", [FLASER, ROBOTLASER, TORO, G2O], ids=["flaser", "rl", "toro", "g2o"]
)
def test_a_log_is_recognised_by_its_content_however_packed(
    log: bytes, packing: str, tmp_path: Path
) -> None:
    (scan,) = read_text(tmp_path, PACKINGS[packing](b"# a comment\n\nPARAM x 1\n" + log))
    assert (scan.index, scan.stamp, scan.odometry) == (0, 17.5, None)
    np.testing.assert_array_equal(scan.ranges, [1.5, 2.5, 3.5, 4.5, 5.5])


@pytest.mark.parametrize(
    ("beams", "first", "step"),
    [
        (180, -90, 1),
        (181, -90, 1),
        (360, -90, 0.5),
        (361, -90, 0.5),
        (401, -50, 0.25),
        (5, -90, 45),
    ],
)
def test_a_flaser_spreads_its_beams_over_the_front(
    beams: int, first: float, step: float, tmp_path: Path
) -> None:
    text = b"FLASER %d %s 0 0 0 0 0 0 1 host 1\n" % (beams, b"1 " * beams)
    (scan,) = read_text(tmp_path, text)
    np.testing.assert_allclose(np.degrees(scan.angles), first + step * np.arange(beams), atol=1e-9)


def test_a_robotlaser_states_its_angles(tmp_path: Path) -> None:
    (scan,) = read_text(tmp_path, ROBOTLASER)
    np.testing.assert_allclose(scan.angles, [-0.5, -0.25, 0, 0.25, 0.5])


def test_remissions_are_skipped(tmp_path: Path) -> None:
    with_remissions = ROBOTLASER.replace(b"5.5 0 0.96", b"5.5 3 100 200 300 0.96")
    (scan,) = read_text(tmp_path, with_remissions, odometry=True)
    assert scan.stamp == 17.5
    np.testing.assert_array_equal(scan.odometry, [1, 2, 0])


@pytest.mark.parametrize("reading", [b"nan", b"inf", b"-inf", b"0", b"-1.5", b"1e999"])
@pytest.mark.parametrize("log", [FLASER, ROBOTLASER])
def test_what_is_no_distance_is_no_return(log: bytes, reading: bytes, tmp_path: Path) -> None:
    (scan,) = read_text(tmp_path, log.replace(b"3.5", reading))
    np.testing.assert_array_equal(scan.ranges, [1.5, 2.5, math.nan, 4.5, 5.5])


@pytest.mark.parametrize(
    "reading", [b"81.91", b"81.83", b"51.15", b"50.0", b"50.000000", b"32.76", b"32.767", b"100"]
)
def test_the_codes_for_no_return_are_no_distance_where_no_maximum_is_stated(
    reading: bytes, tmp_path: Path
) -> None:
    (scan,) = read_text(tmp_path, FLASER.replace(b"3.5", reading))
    assert scan.hits.tolist() == [True, True, False, True, True]


@pytest.mark.parametrize(
    ("maximum", "reading", "hit"),
    [(b"30.0", b"30.0", False), (b"30.0", b"31", False), (b"30.0", b"29.9", True),
     (b"8.191", b"8.19", False), (b"120", b"100", True), (b"120", b"81.83", False),
     (b"0", b"40", True), (b"nan", b"81.91", False), (b"-1", b"50", False)],
)  # fmt: skip
def test_a_reading_at_the_stated_maximum_is_no_return(
    maximum: bytes, reading: bytes, hit: bool, tmp_path: Path
) -> None:
    text = ROBOTLASER.replace(b"30.0", maximum).replace(b"3.5", reading)
    (scan,) = read_text(tmp_path, text)
    assert scan.hits[2] == hit


def test_stamps_are_handed_through_however_odd_and_are_nan_where_they_are_none(
    tmp_path: Path,
) -> None:
    stamps = [b"5", b"5", b"-3", b"1e10", b"1e300", b"inf", b"nan", b"1e999"]
    scans = read_text(tmp_path, b"".join(FLASER.replace(b"17.5", stamp) for stamp in stamps))
    np.testing.assert_array_equal(
        [scan.stamp for scan in scans], [5, 5, -3, 1e10, math.nan, math.nan, math.nan, math.nan]
    )


@pytest.mark.parametrize(("log", "pose"), [(FLASER, [3, 4, 0.25]), (TORO, [1, 2, 0])])
def test_a_pose_is_handed_out_only_when_asked_for(
    log: bytes, pose: list[float], tmp_path: Path
) -> None:
    assert read_text(tmp_path, log)[0].odometry is None
    np.testing.assert_array_equal(read_text(tmp_path, log, odometry=True)[0].odometry, pose)


def test_without_odometry_the_poses_in_a_log_change_nothing(data_dir: Path, tmp_path: Path) -> None:
    path = tmp_path / "scrambled.log"
    with gzip.open(data_dir / "intel.log.gz") as log, path.open("wb") as scrambled:
        for line in log:
            words = line.split()
            if words[0] == b"FLASER":
                words[-9:-3] = [b"7"] * 6
            scrambled.write(b" ".join(words) + b"\n")
    for one, other in zip(read(data_dir / "intel.log.gz"), read(path), strict=True):
        assert (one.index, one.stamp, one.odometry) == (other.index, other.stamp, other.odometry)
        np.testing.assert_array_equal(one.points, other.points)


@pytest.mark.parametrize("asked", [{"topic": "/scan"}, {"odometry": "/odom"}])
@pytest.mark.parametrize(
    "content", [FLASER, b'{"angle_min": 0, "angle_increment": 1, "ranges": []}']
)
def test_a_topic_of_what_is_no_bag_is_refused(
    content: bytes, asked: dict[str, str], tmp_path: Path
) -> None:
    path = tmp_path / "log"
    path.write_bytes(content)
    (topic,) = asked.values()
    with pytest.raises(FileError, match=f"log: is no bag, which alone has topics, such as {topic}"):
        read_scans(path, topic=asked.get("topic"), odometry=asked.get("odometry", False))


def test_an_odometry_that_is_not_finite_is_none(tmp_path: Path) -> None:
    (scan,) = read_text(tmp_path, FLASER.replace(b"3 4 0.25", b"nan 4 0.25"), odometry=True)
    assert scan.odometry is None


def test_scans_come_before_the_log_is_read_to_its_end(tmp_path: Path) -> None:
    path = tmp_path / "log"
    path.write_bytes(FLASER * 100_000)
    scans = read_scans(path, on_warning=lambda _: None)
    assert next(scans).index == 0
    path.write_bytes(b"")  # What was not read yet is gone.
    assert sum(1 for _ in scans) < 5_000


def test_counting_agrees_with_reading(data_dir: Path) -> None:
    assert count_scans(data_dir / "seattle.log.gz") == 241


def test_the_reference_of_a_carmen_scan_is_its_laser_pose(tmp_path: Path) -> None:
    path = tmp_path / "log"
    path.write_bytes(
        FLASER + b"FLASER damaged\n" + FLASER.replace(b" 1 2 0.5", b" nan 2 0.5") + FLASER
    )
    indices, poses = read_reference_poses(path)
    assert indices.tolist() == [0, 2]
    np.testing.assert_array_equal(poses, [[1, 2, 0.5], [1, 2, 0.5]])


@pytest.mark.parametrize("log", [TORO, G2O])
def test_the_reference_in_a_graph_is_the_laser_on_its_vertex(log: bytes, tmp_path: Path) -> None:
    path = tmp_path / "log"
    path.write_bytes(log + ROBOTLASER)  # The second scan follows no vertex.
    indices, poses = read_reference_poses(path)
    assert indices.tolist() == [0]
    # The laser sits 4 cm behind the robot's origin, and the robot looks along y.
    np.testing.assert_allclose(poses, [[5, 5.96, math.pi / 2]])


def test_the_references_of_a_real_log_agree_with_its_relations(data_dir: Path) -> None:
    path = data_dir / "fr079.log.gz"
    indices, poses = read_reference_poses(path)
    scans = read(path)
    assert indices.tolist() == list(range(len(scans)))
    place = {scan.stamp: scan.index for scan in scans}
    rows = np.loadtxt(data_dir / "fr079.relations.gz")
    known = np.array([row for row in rows if row[0] in place and row[1] in place])
    origins, targets = ([place[stamp] for stamp in known[:, column]] for column in (0, 1))
    moves = se2.between(poses[origins], poses[targets])
    errors = np.linalg.norm(moves[:, :2] - known[:, 2:4], axis=1)
    assert len(known) == 136
    assert errors.mean() == pytest.approx(0.051, abs=0.001)  # As the README of the logs states.


def test_where_a_log_does_not_state_the_angle_between_beams_it_can_be_given(
    tmp_path: Path,
) -> None:
    for name, text in (("flaser", FLASER), ("stated", ROBOTLASER)):
        (tmp_path / name).write_bytes(text)
    (scan,) = read_scans(tmp_path / "flaser", angular_step=0.006, on_warning=fail_on_warning)
    np.testing.assert_allclose(scan.angles, 0.006 * np.arange(-2, 3))
    (given,) = read_scans(tmp_path / "stated", angular_step=0.006, on_warning=fail_on_warning)
    (stated,) = read_scans(tmp_path / "stated", on_warning=fail_on_warning)
    np.testing.assert_array_equal(given.angles, stated.angles)


def test_beams_beyond_a_whole_turn_are_damage_however_the_angle_is_known(tmp_path: Path) -> None:
    path = tmp_path / "log"
    path.write_bytes(FLASER)
    with pytest.raises(FileError, match="within one turn"):
        count_scans(path, angular_step=2.5)
    assert count_scans(path, angular_step=0.1) == count_scans(path) == 1
