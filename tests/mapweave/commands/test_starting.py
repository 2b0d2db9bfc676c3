"""``--continue`` and ``--localize``, and a stored joint map among those to fuse."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mapweave.anchors import anchored, placed_marks
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.io.map_files import read_joint, read_map, write_joint, write_map
from mapweave.maps import JointMap, LineMap, RobotMap, Submap, Trajectory
from mapweave.marks import Mark
from mapweave.scan.scan import Scan
from tests.mapweave.buildings import (
    AROUND,
    BUILDING,
    SLANTED,
    part,
    random_pose,
    scans_along,
    shaken,
)
from tests.mapweave.commands.test_commands import assert_fails_in_one_line, main_here, mapweave

THERE = [(3, 1), (13, 1), (13, -3), (13, 1), (18, 1), (18, 4), (18, 1), (28, 1)]


def as_g2o(scans: list[Scan]) -> str:
    """Return ROBOTLASER1 lines: they say at which angles their beams are."""
    lines = []
    for scan in scans:
        first, step = scan.angles[0], scan.angles[1] - scan.angles[0]
        ranges = " ".join(f"{r:.4f}" for r in np.nan_to_num(scan.ranges, nan=81.0))
        head = f"ROBOTLASER1 0 {first:.9f} {len(scan.ranges) * step:.9f} {step:.9f} 80 0.01 0"
        tail = f"0 {' '.join(['0'] * 6)} 0 0 0 0 0 {scan.stamp:.3f} host {scan.stamp:.3f}"
        lines.append(f"{head} {len(scan.ranges)} {ranges} {tail}\n")
    return "".join(lines)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "drive.log"
    path.write_text(as_g2o(scans_along(BUILDING, THERE, 1)[0]))
    return path


@pytest.fixture(scope="module")
def first(log: Path) -> Path:
    path = log.with_name("first.json")
    assert mapweave("map", log, "--scans", ":70", "--robot", "r7", "--output", path).returncode == 0
    return path


def test_a_log_is_mapped_on_from_a_stored_map_under_its_robots_name(
    log: Path, first: Path, tmp_path: Path
) -> None:
    output = tmp_path / "all.json"
    done = mapweave("map", log, "--scans", "40:", "--continue", first, "--output", output)
    assert (done.returncode, done.stderr) == (0, "")
    before, after = read_map(first), read_map(output)
    assert after.robot == "r7"
    assert after.components == [0]
    count = len(after.submaps[-1].trajectory.scan_index)
    new = after.submaps[len(before.submaps) :]
    placed = sum(len(s.trajectory.scan_index) for s in new)
    assert count and done.stdout.startswith(f"{placed} of {placed} scans placed")
    # Those mapped twice were taken at the same places.
    stored = {
        int(k): se2.compose(s.pose, pose)
        for s in before.submaps
        for k, pose in zip(s.trajectory.scan_index, s.trajectory.pose, strict=True)
    }
    shift = 1 + max(stored) - 40
    for s in new:
        for k, pose in zip(s.trajectory.scan_index, s.trajectory.pose, strict=True):
            if k - shift in stored:
                apart = se2.between(stored[int(k) - shift], se2.compose(s.pose, pose))
                assert np.hypot(*apart[:2]) < 0.1


def test_a_map_and_the_one_that_goes_on_from_it_are_no_two_witnesses(
    log: Path, first: Path, tmp_path: Path
) -> None:
    output = tmp_path / "all.json"
    words = ("--scans", "40:", "--robot", "r8", "--continue", first, "--output", output)
    assert main_here("map", log, *words).returncode == 0
    done = main_here("fuse", first, output)
    assert_fails_in_one_line(done, output, f"has submaps of {first} as they are")


def test_a_log_is_followed_in_a_stored_map_that_stays_as_it_is(
    log: Path, first: Path, tmp_path: Path
) -> None:
    output = tmp_path / "path.json"
    done = mapweave("map", log, "--scans", "10:40", "--localize", first, "--output", output)
    assert done.returncode == 0
    assert done.stderr == "mapweave: the robot has found itself in component 0 of the map\n"
    assert done.stdout.startswith("30 of 30 scans placed")
    known, found = read_map(first), read_map(output)
    for then, now in zip(known.submaps, found.submaps, strict=False):
        np.testing.assert_array_equal(then.map.segments, now.map.segments)
    assert found.robot == "r1"
    (path,) = [s.trajectory for s in found.submaps if len(s.trajectory.scan_index)]
    assert path.scan_index.tolist() == list(range(10, 40))
    exported = tmp_path / "path.tum"
    assert main_here("export", output, exported).returncode == 0
    assert len([row for row in exported.read_text().splitlines() if row[0] != "#"]) == 30


def test_a_robot_that_is_nowhere_in_the_map_fails_in_one_line(log: Path, tmp_path: Path) -> None:
    room = part(BUILDING, 22, 30)
    stored = tmp_path / "room.json"
    write_map(stored, RobotMap("a", "0", 1, (Submap(0, 0, np.zeros(3), room, Trajectory.empty()),)))
    done = main_here("map", log, "--scans", "0:20", "--localize", stored)
    assert_fails_in_one_line(done, log, "none of its 20", str(stored), "expected")


@pytest.mark.parametrize("option", ["--continue", "--localize"])
def test_a_map_without_walls_and_a_file_that_is_none_are_refused(
    option: str, log: Path, tmp_path: Path
) -> None:
    empty = tmp_path / "empty.json"
    write_map(empty, RobotMap("a", "0", 1, ()))
    done = main_here("map", log, option, empty)
    assert_fails_in_one_line(done, empty, "has no walls", "expected")
    assert_fails_in_one_line(main_here("map", log, option, log), log, "expected a map file")


def test_only_a_robots_map_is_gone_on_from(log: Path, tmp_path: Path) -> None:
    joint = tmp_path / "joint.json"
    write_joint(joint, JointMap(1, (), ()))
    done = main_here("map", log, "--continue", joint)
    assert_fails_in_one_line(done, joint, "format")


def seen(robot: str, lines: LineMap, seed: int, folder: Path) -> Path:
    """Return the file of a robot's noisy map that started at a random place."""
    rng = np.random.default_rng(seed)
    own = shaken(lines, rng).moved(random_pose(rng))
    path = folder / f"{robot}.json"
    submap = Submap(0, 0, np.zeros(3), own, Trajectory.empty())
    write_map(path, RobotMap(robot, "0", 1, (submap,)))
    return path


def test_a_stored_joint_map_is_fused_with_another_map_and_its_robots_come_along(
    tmp_path: Path,
) -> None:
    parts = {"c": (0, 18), "d": (8, 30), "b": (10, 30)}
    c, d, b = (
        seen(robot, part(BUILDING, *span), seed, tmp_path)
        for seed, (robot, span) in enumerate(parts.items())
    )
    stored, output, at_once = (tmp_path / f"{name}.json" for name in ("joint", "out", "at_once"))
    assert main_here("fuse", c, d, "--output", stored).returncode == 0
    done = mapweave("fuse", stored, b, "--output", output)
    assert (done.returncode, done.stderr) == (0, "")
    assert main_here("fuse", b, c, d, "--output", at_once).returncode == 0
    (one,), (other,) = read_joint(output).components, read_joint(at_once).components
    assert list(one.robots) == list(other.robots) == ["b/0", "c/0", "d/0"]
    for name in one.robots:
        x, y, turn = se2.between(one.robots[name], other.robots[name])
        assert np.hypot(x, y) < 0.1 and abs(turn) < 0.01
    pairs = {(a.reference, a.other) for a in read_joint(output).alignments}
    assert pairs == {("c/0", "d/0"), ("c/0", "b/0")}


def test_a_robot_that_is_in_the_joint_map_already_is_refused(tmp_path: Path) -> None:
    c = seen("c", part(BUILDING, 0, 18), 0, tmp_path)
    d = seen("d", part(BUILDING, 8, 30), 1, tmp_path)
    stored = tmp_path / "joint.json"
    assert main_here("fuse", c, d, "--output", stored).returncode == 0
    done = main_here("fuse", stored, d)
    assert_fails_in_one_line(done, d, "robot 'd' was given already")


def test_beams_of_the_drive_are_evenly_spread() -> None:
    """What `as_g2o` relies on."""
    np.testing.assert_allclose(np.diff(AROUND[45:316:2]), AROUND[2] - AROUND[0])


def marked(path: Path, label: str, position: tuple[float, float]) -> FloatArray:
    """Mark a place [m], in the frame of component 0, in a stored map; return where it is."""
    stored = read_map(path)
    place = np.array(position)
    held = anchored(stored.submaps, 0, place)
    assert held is not None
    mark = Mark("m1", label, "ann", 17.0, *held)
    write_map(path, replace(stored, marks=(mark,)))
    return place


@pytest.mark.parametrize("option", ["--continue", "--localize"])
def test_marks_of_the_stored_map_stay_where_they_were(
    option: str, log: Path, first: Path, tmp_path: Path
) -> None:
    stored, output = tmp_path / "marked.json", tmp_path / "out.json"
    stored.write_bytes(first.read_bytes())
    place = marked(stored, "victim", (4.0, 0.5))
    done = main_here("map", log, "--scans", "20:60", option, stored, "--output", output)
    assert done.returncode == 0
    (mark,) = placed_marks(read_map(output))
    assert (mark.label, mark.by, mark.component[-2:]) == ("victim", "ann", "/0")
    np.testing.assert_allclose(mark.position, place, atol=0.05)


def test_marks_of_a_stored_joint_map_come_along(tmp_path: Path) -> None:
    c = seen("c", part(BUILDING, 0, 18), 0, tmp_path)
    d = seen("d", part(BUILDING, 8, 30), 1, tmp_path)
    b = seen("b", part(BUILDING, 10, 30), 2, tmp_path)
    marked(d, "victim", (1.0, 2.0))
    stored, output, at_once = (tmp_path / f"{name}.json" for name in ("joint", "out", "at_once"))
    assert main_here("fuse", c, d, "--output", stored).returncode == 0
    assert main_here("fuse", stored, b, "--output", output).returncode == 0
    assert main_here("fuse", b, c, d, "--output", at_once).returncode == 0
    (one,), (other,) = (read_joint(path).components[0].marks for path in (output, at_once))
    assert one.component == other.component == "d/0"
    np.testing.assert_allclose(one.position, other.position, atol=0.1)


def test_a_map_servers_grid_becomes_a_robots_map_and_takes_no_start(tmp_path: Path) -> None:
    room = part(SLANTED, 0, 18)
    stored, grid, output = (tmp_path / name for name in ("a.json", "grid.yaml", "g.json"))
    write_map(stored, RobotMap("a", "0", 1, (Submap(0, 0, np.zeros(3), room, Trajectory.empty()),)))
    assert main_here("export", stored, grid).returncode == 0
    done = mapweave("map", grid, "--robot", "g", "--output", output)
    assert (done.returncode, done.stderr) == (0, "")
    assert "polylines" in done.stdout
    found = read_map(output)
    assert (found.robot, found.components) == ("g", [0])
    assert main_here("fuse", stored, output).returncode == 0
    done = main_here("map", grid, "--localize", stored)
    assert_fails_in_one_line(done, grid, "is a grid; expected a log", "--localize")


def test_a_stored_joint_map_that_is_fused_with_an_unrelated_map_stays_as_it_was(
    tmp_path: Path,
) -> None:
    c = seen("c", part(BUILDING, 0, 18), 0, tmp_path)
    d = seen("d", part(BUILDING, 8, 30), 1, tmp_path)
    crate = LineMap(np.array([[0.0, 0.0, 1.0, 0.0]]), np.zeros(1, np.int64), np.ones(1, np.int64))
    u = seen("u", crate, 2, tmp_path)
    stored, output = tmp_path / "joint.json", tmp_path / "out.json"
    assert main_here("fuse", c, d, "--output", stored).returncode == 0
    assert main_here("fuse", stored, u, "--output", output).returncode == 3
    before, after = read_joint(stored).components[0], read_joint(output).components[0]
    assert list(after.robots) == ["c/0", "d/0"] and after.confidence == before.confidence
    np.testing.assert_allclose(after.map.segments, before.map.segments, atol=1e-3)
    np.testing.assert_array_equal(after.map.support, before.map.support)
    np.testing.assert_allclose(after.segment_confidence, before.segment_confidence, atol=1e-3)
    for ring, other in zip(after.map.free_space, before.map.free_space, strict=True):
        np.testing.assert_allclose(ring, other, atol=1e-3)


def test_a_robot_that_only_followed_in_a_map_is_no_second_witness_of_its_walls(
    tmp_path: Path,
) -> None:
    a = seen("a", part(BUILDING, 0, 18), 0, tmp_path)
    b = seen("b", part(BUILDING, 10, 30), 2, tmp_path)
    known = read_map(a)
    driven = Trajectory(np.arange(3), np.arange(3.0), np.zeros((3, 3)))
    path = Submap(1, 0, np.zeros(3), LineMap.empty(), driven)
    located, output, mapped = (tmp_path / f"{name}.json" for name in ("loc", "out", "mapped"))
    write_map(located, replace(known, robot="r", submaps=(*known.submaps, path)))
    assert main_here("fuse", a, b, "--output", mapped).returncode == 0
    done = main_here("fuse", located, b, "--output", output)
    assert (done.returncode, "only followed" in done.stderr) == (0, True)
    assert "accepted" in done.stdout and "follows in" in done.stdout
    (one,), (other,) = read_joint(output).components, read_joint(mapped).components
    once = read_map(b).submaps[0].map.support.max()
    assert one.map.support.max() == once < other.map.support.max()
    between = se2.between(one.robots["b/0"], one.robots["r/0"])
    expected = se2.between(other.robots["b/0"], other.robots["a/0"])
    np.testing.assert_allclose(between, expected, atol=0.05)
