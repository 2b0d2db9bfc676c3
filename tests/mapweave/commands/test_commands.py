"""``mapweave map``, ``fuse`` and ``export`` as a person runs them: real processes, real files."""

import fcntl
import gzip
import io
import json
import os
import re
import signal
import subprocess
import sys
import termios
import time
from array import array
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.cli import main
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.io.map_files import read_joint, read_map, write_map
from mapweave.io.readers import count_scans
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave.scan.scan import Scan
from tests.mapweave.buildings import (
    BUILDING,
    FRONT,
    OTHER_BUILDING,
    cast,
    part,
    random_pose,
    shaken,
    walls_of,
)

SCANS = 12


def mapweave(*words: str | Path, typed: str = "") -> subprocess.CompletedProcess[str]:
    """Run the installed program."""
    return subprocess.run(
        [sys.executable, "-m", "mapweave", *map(str, words)],
        input=typed,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        env={**os.environ, "PYTHONWARNINGS": "error"},
    )


def main_here(*words: str | Path) -> subprocess.CompletedProcess[str]:
    """Run the program in this process, a second faster: for more cases of what was shown above."""
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        status = main([str(word) for word in words])
    return subprocess.CompletedProcess(words, status, out.getvalue(), err.getvalue())


def assert_fails_in_one_line(
    done: subprocess.CompletedProcess[str], path: Path, *words: str
) -> None:
    """Check that the one line says which file, what is wrong, and what was expected."""
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1 and "Traceback" not in done.stderr
    assert done.stderr.startswith(f"mapweave: {path}: ")
    for word in words:
        assert word in done.stderr


def flaser(scan: Scan, pose: FloatArray) -> bytes:
    """Return a CARMEN line; `pose` (3,) is what the recording program believed."""
    readings = " ".join(f"{r:.3f}" for r in np.nan_to_num(scan.ranges, nan=81.91))
    where = " ".join(f"{v:.4f}" for v in pose)
    line = f"FLASER {len(scan.ranges)} {readings} {where} {where} {scan.stamp:.2f} host 0.1\n"
    return line.encode()


@pytest.fixture(scope="session")
def scans() -> list[Scan]:
    noise = np.random.default_rng(3)
    poses = [[x, 1.0, 0.1] for x in 3 + 0.3 * np.arange(SCANS)]
    return [
        cast(walls_of(BUILDING), pose, index=k, angles=FRONT, noise=noise)
        for k, pose in enumerate(poses)
    ]


@pytest.fixture(scope="session")
def lines(scans: list[Scan]) -> list[bytes]:
    return [flaser(scan, np.zeros(3)) for scan in scans]


@pytest.fixture
def log(tmp_path: Path, lines: list[bytes]) -> Path:
    path = tmp_path / "log"
    path.write_bytes(b"".join(lines))
    return path


def test_a_log_becomes_a_map_file_and_a_line_of_figures(log: Path, tmp_path: Path) -> None:
    output = tmp_path / "out.json"
    done = mapweave("map", log, "--robot", "r-7", "--scans", "2:10", "--output", output)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("8 of 8 scans placed, 8 in the largest of 1 component; ")
    robot_map = read_map(output)
    assert robot_map.robot == "r-7"
    indices = np.concatenate([s.trajectory.scan_index for s in robot_map.submaps])
    assert indices.tolist() == list(range(2, 10))  # counted from the log's first scan


def test_figures_are_told_as_json_to_a_program(log: Path) -> None:
    done = main_here("map", log, "--scans", "2:10", "--json")
    figures = json.loads(done.stdout)
    assert {name: figures[name] for name in ("scans", "placed", "largest", "components")} == {
        "scans": 8,
        "placed": 8,
        "largest": 8,
        "components": 1,
    }
    assert figures["segments"] > 0 and figures["path_m"] > 1.5


def test_the_poses_in_a_log_change_nothing(
    tmp_path: Path, scans: list[Scan], rng: Generator
) -> None:
    """True, shuffled or absurd: the map is the same to the byte."""
    for name in ("one", "other"):
        believed = [random_pose(rng) for _ in scans]
        log = tmp_path / f"{name}.log"
        log.write_bytes(b"".join(map(flaser, scans, believed)))
        assert main_here("map", log, "--output", tmp_path / f"{name}.json").returncode == 0
    assert (tmp_path / "one.json").read_bytes() == (tmp_path / "other.json").read_bytes()


@pytest.mark.parametrize("zipped", [True, False])
def test_a_recording_that_was_cut_off_gives_its_whole_scans_and_one_warning(
    zipped: bool, tmp_path: Path, lines: list[bytes]
) -> None:
    log, output = tmp_path / "cut.log", tmp_path / "out.json"
    content = b"".join(lines)
    log.write_bytes(gzip.compress(content, mtime=0)[:-700] if zipped else content[:-300])
    done = mapweave("map", log, "--output", output)
    assert done.returncode == 0
    assert re.fullmatch(
        rf"mapweave: {re.escape(str(log))}: dropped 1 damaged line, the first line \d+: .*\n",
        done.stderr,
    )
    placed = sum(len(s.trajectory.scan_index) for s in read_map(output).submaps)
    assert (SCANS // 2 < placed < SCANS) if zipped else placed == SCANS - 1


def test_single_damaged_lines_are_dropped_and_counted(tmp_path: Path, lines: list[bytes]) -> None:
    log = tmp_path / "damaged.log"
    broken = [*lines[:4], lines[4].replace(b" 1", b" x1", 1), *lines[5:9], lines[9][:99] + b"\n"]
    log.write_bytes(b"".join([*broken, *lines[10:]]))
    done = mapweave("map", log)
    assert done.returncode == 0
    assert done.stdout.startswith(f"{SCANS - 2} of {SCANS - 2} scans placed")
    assert done.stderr.count("\n") == 1
    assert "dropped 2 damaged lines, the first line 5: " in done.stderr


def test_readings_that_are_none_count_as_no_return(
    tmp_path: Path, scans: list[Scan], lines: list[bytes]
) -> None:
    """NaN, infinite, zero, negative and maximum: as the same log with the code for no return."""
    nonsense = ["nan", "inf", "-inf", "0", "-1.5", "81.91", "50.0", "1e30"]
    for name, readings in (("plain", ["81.83"] * 8), ("odd", nonsense)):
        damaged = []
        for line in lines:
            words = line.decode().split(" ")
            words[30:38], words[120:128] = readings, readings
            damaged.append(" ".join(words).encode())
        (tmp_path / f"{name}.log").write_bytes(b"".join(damaged))
        done = main_here("map", tmp_path / f"{name}.log", "--output", tmp_path / f"{name}.json")
        assert (done.returncode, done.stderr) == (0, "")
        assert done.stdout.startswith(f"{len(scans)} of {len(scans)} scans placed")
    assert (tmp_path / "odd.json").read_bytes() == (tmp_path / "plain.json").read_bytes()


BLIND = flaser(Scan(np.full(len(FRONT), np.nan), FRONT, 0, 0.0), np.zeros(3))
UNUSABLE = {
    "empty": (b"", "is empty"),
    "of another kind": (b"It was a dark and stormy night.\n", "holds no laser scan"),
    "blind": (BLIND * 3, "in none of its 3 scans did a beam come back"),
    "damaged": (b"FLASER 181 1 2\nFLASER 181 x\n", "2 damaged lines, the first line 1"),
    "cut to nothing": (gzip.compress(BLIND)[:12], "gzip stream is cut off"),
}


@pytest.mark.parametrize("kind", UNUSABLE)
def test_a_log_without_a_usable_scan_fails_in_one_line(kind: str, tmp_path: Path) -> None:
    content, problem = UNUSABLE[kind]
    log, output = tmp_path / "bad.log", tmp_path / "out.json"
    log.write_bytes(content)
    output.write_text("old")
    run = mapweave if kind in ("empty", "damaged") else main_here
    done = run("map", log, "--output", output)
    assert_fails_in_one_line(done, log, problem, "expected a CARMEN, TORO or g2o log")
    assert output.read_text() == "old"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["bad.log", "out.json"]


def test_a_map_is_no_log(tmp_path: Path) -> None:
    path = tmp_path / "map.json"
    path.write_text('{"format": "mapweave/map/1"}')
    done = main_here("map", path)
    assert_fails_in_one_line(done, path, "is of format 'mapweave/map/1'", "mapweave/scans/1")


def test_a_source_of_a_scheme_that_nobody_knows_fails_in_one_line() -> None:
    done = main_here("map", "lidar:/dev/ttyUSB0")
    assert done.returncode == 1
    assert done.stderr.startswith("mapweave: source 'lidar:/dev/ttyUSB0': no such file, and no")
    assert done.stderr.count("\n") == 1


def as_line(scan: Scan) -> str:
    """Return a line of JSON."""
    return json.dumps(
        {
            "stamp": scan.stamp,
            "angle_min": float(scan.angles[0]),
            "angle_increment": float(scan.angles[1] - scan.angles[0]),
            "ranges": [None if np.isnan(r) else r for r in scan.ranges.tolist()],
        }
    )


def test_scans_on_standard_input_make_the_map_that_their_log_does(
    scans: list[Scan], tmp_path: Path
) -> None:
    lines = [as_line(scan) for scan in scans]
    file = tmp_path / "scans.jsonl"
    file.write_text("\n".join(['{"format": "mapweave/scans/1"}', *lines]))
    from_file, from_input = tmp_path / "file.json", tmp_path / "input.json"
    assert main_here("map", file, "--output", from_file).returncode == 0
    done = subprocess.run(
        [sys.executable, "-m", "mapweave", "map", "-", "--output", from_input],
        input=file.read_bytes(),
        capture_output=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, b"")
    assert from_input.read_bytes() == from_file.read_bytes()
    assert len(read_map(from_file).submaps[0].trajectory.scan_index) == SCANS


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_told_twice_ends_scans_that_come_live_and_their_map_is_written(
    scans: list[Scan], tmp_path: Path, how: signal.Signals
) -> None:
    output = tmp_path / "map.json"
    program = [sys.executable, "-m", "mapweave", "map", "-", "--output", str(output)]
    with subprocess.Popen(
        program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as driven:
        assert driven.stdin is not None
        driven.stdin.write("".join(f"{as_line(scan)}\n" for scan in scans))
        driven.stdin.flush()
        waiting = array("i", [1])
        while waiting[0]:  # until all is read
            time.sleep(0.1)
            fcntl.ioctl(driven.stdin, termios.FIONREAD, waiting)
        time.sleep(1.0)
        driven.send_signal(how)
        time.sleep(0.05)
        driven.send_signal(how)
        said, told = driven.communicate()
    assert driven.returncode == 0
    assert "scans placed" in said
    assert told == f"mapweave: ended: what came until now is mapped, for {output}\n"
    assert read_map(output).submaps


@pytest.mark.parametrize("live", [False, True])
def test_what_came_before_a_line_of_another_format_is_mapped_and_the_line_is_named(
    scans: list[Scan], tmp_path: Path, live: bool
) -> None:
    lines = [*map(as_line, scans), '{"format": "mapweave/scans/2"}', *map(as_line, scans)]
    file, output = tmp_path / "scans.jsonl", tmp_path / "map.json"
    file.write_text("\n".join(lines))
    if live:
        done = mapweave("map", "-", "--output", output, typed=file.read_text())
    else:
        done = main_here("map", file, "--output", output)
    assert (done.returncode, done.stderr.count("\n")) == (1, 1)
    name = "standard input" if live else file
    what = f"line {SCANS + 1} is of format 'mapweave/scans/2'"
    assert done.stderr.startswith(f"mapweave: {name}: {what}")
    assert len(read_map(output).submaps[0].trajectory.scan_index) == SCANS


def test_scans_of_too_few_beams_fail_in_one_line_that_says_so(tmp_path: Path) -> None:
    log = tmp_path / "few.log"
    log.write_text("".join(f"FLASER 9{' 2.5' * 9} 0 0 0 0 0 0 {k} host {k}\n" for k in range(5)))
    said = "none of its 5 chosen scans can be mapped; expected 10 beams or more, got 9"
    assert_fails_in_one_line(main_here("map", log), log, said)


def test_the_picture_of_a_grid_is_refused_by_the_name_of_its_settings(tmp_path: Path) -> None:
    picture = tmp_path / "hall.pgm"
    picture.write_bytes(b"P5 2 2 255\n0000")
    (tmp_path / "hall.yaml").write_text("image: hall.pgm\n")
    said = f"is the picture of a grid; expected {tmp_path / 'hall.yaml'}"
    assert_fails_in_one_line(main_here("map", picture), picture, said)


def test_a_missing_log_and_a_folder_fail_in_one_line(tmp_path: Path) -> None:
    missing = tmp_path / "nowhere.log"
    assert_fails_in_one_line(mapweave("map", missing), missing, "no such file", "expected")
    assert_fails_in_one_line(main_here("map", tmp_path), tmp_path, "is a folder", "expected")


def test_scans_beyond_the_logs_end_fail_in_one_line_that_says_how_many_there_are(
    log: Path,
) -> None:
    done = main_here("map", log, "--scans", "50:60")
    assert_fails_in_one_line(done, log, f"has {count_scans(log)} scans, none of them in 50:60")


def test_a_map_that_nobody_asked_to_keep_is_said_to_be_lost(log: Path, tmp_path: Path) -> None:
    told = "The map is not kept: --output MAP.json keeps it."
    assert main_here("map", log).stdout.splitlines()[1:] == [told]
    for words in (
        ["--output", tmp_path / "map.json"],
        ["--plot", tmp_path / "map.png"],
        ["--json"],
    ):
        assert told not in main_here("map", log, *words).stdout


def test_a_robot_id_that_is_none_is_refused_before_any_work(log: Path) -> None:
    done = mapweave("map", log, "--robot", "No Robot")
    assert done.returncode == 1
    assert done.stderr.startswith("mapweave: robot 'No Robot': expected 1 to 32 characters")
    assert done.stderr.count("\n") == 1


def test_a_picture_that_cannot_be_is_refused_before_any_work(log: Path, tmp_path: Path) -> None:
    picture, output = tmp_path / "map.jpg", tmp_path / "out.json"
    done = main_here("map", log, "--output", output, "--plot", picture)
    assert_fails_in_one_line(done, picture, ".png")
    assert not output.exists()


def test_a_picture_without_its_package_is_refused_before_any_work(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    output = tmp_path / "out.json"
    done = main_here("map", log, "--output", output, "--plot", tmp_path / "map.png")
    assert (done.returncode, output.exists()) == (1, False)
    assert done.stderr.endswith("pip install 'mapweave[plot]'\n")
    assert done.stderr.count("\n") == 1


def test_an_output_that_cannot_be_written_fails_in_one_line(log: Path, tmp_path: Path) -> None:
    output = tmp_path / "no" / "out.json"
    assert_fails_in_one_line(main_here("map", log, "--output", output), output, "cannot be written")


def robot_map(robot: str, lines: LineMap, seed: int) -> RobotMap:
    """Return the noisy map of a robot that started somewhere."""
    rng = np.random.default_rng(seed)
    seen = shaken(lines, rng).moved(random_pose(rng))
    trajectory = Trajectory(np.array([0]), np.array([np.nan]), np.zeros((1, 3)))
    return RobotMap(robot, "0", 1, (Submap(0, 0, np.zeros(3), seen, trajectory),))


@pytest.fixture(scope="session")
def maps(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return map files of two robots in one building, and of one in another."""
    folder = tmp_path_factory.mktemp("maps")
    seen = {
        "a": part(BUILDING, 0, 18),
        "b": part(BUILDING, 8, 30),
        "c": part(OTHER_BUILDING, 0, 26),
    }
    for seed, (robot, lines) in enumerate(seen.items()):
        write_map(folder / f"{robot}.json", robot_map(robot, lines, seed))
    return {robot: folder / f"{robot}.json" for robot in seen}


def test_maps_that_share_a_place_are_joined_and_all_is_told(
    maps: dict[str, Path], tmp_path: Path
) -> None:
    output = tmp_path / "joint.json"
    done = mapweave("fuse", maps["a"], maps["b"], "--output", output)
    assert (done.returncode, done.stderr) == (0, "")
    first, second = done.stdout.splitlines()
    assert re.match(r"a/0 - b/0: accepted \((over )?\d+%\): \d+ m of wall in common", first)
    assert re.match(r"component of a/0, b/0: \d+ segments, confidence (over )?\d+%$", second)
    joint = read_joint(output)
    (component,) = joint.components
    # Taken back into the building, both robots' frames are the same.
    rngs = [np.random.default_rng(seed) for seed in (0, 1)]
    frames = []
    for rng, low, high in zip(rngs, (0, 8), (18, 30), strict=True):
        shaken(part(BUILDING, low, high), rng)
        frames.append(random_pose(rng))
    back = [se2.compose(p, f) for p, f in zip(component.robots.values(), frames, strict=True)]
    middle = [se2.transform_points(pose, np.array([13.0, 1.0])) for pose in back]
    assert np.hypot(*(middle[0] - middle[1])) < 0.1


def test_what_was_joined_is_told_as_json_to_a_program(maps: dict[str, Path]) -> None:
    done = main_here("fuse", maps["a"], maps["b"], "--json")
    told = json.loads(done.stdout)
    (alignment,), (component,) = told["alignments"], told["components"]
    assert (alignment["reference"], alignment["other"]) == ("a/0", "b/0")
    assert alignment["decision"] == "accepted" and len(alignment["transform"]) == 3
    assert list(component["robots"]) == ["a/0", "b/0"] and component["segments"] > 0


def test_a_joint_map_that_nobody_asked_to_keep_is_said_to_be_lost(
    maps: dict[str, Path], tmp_path: Path
) -> None:
    told = "The joint map is not kept: --output JOINT.json keeps it."
    assert main_here("fuse", maps["a"], maps["b"]).stdout.splitlines()[-1] == told
    for words in (["--output", tmp_path / "joint.json"], ["--json"]):
        assert told not in main_here("fuse", maps["a"], maps["b"], *words).stdout


def test_maps_that_cannot_all_be_joined_give_status_3_and_the_rest_of_the_work(
    maps: dict[str, Path], tmp_path: Path
) -> None:
    output = tmp_path / "joint.json"
    done = mapweave("fuse", *maps.values(), "--output", output)
    assert (done.returncode, done.stderr) == (3, "")
    for pair in ("a/0 - c/0", "b/0 - c/0"):
        assert re.search(f"^{pair}: (refused|ambiguous) ", done.stdout, re.MULTILINE)
    assert re.search(r"^component of c/0: \d+ segments, alone$", done.stdout, re.MULTILINE)
    assert [list(c.robots) for c in read_joint(output).components] == [["a/0", "b/0"], ["c/0"]]


def without(content: dict[str, Any], field: str) -> dict[str, Any]:
    return {name: value for name, value in content.items() if name != field}


def spoiled(content: dict[str, Any], how: str) -> str:
    """Return a map file as JSON with one thing wrong."""
    submap = content["submaps"][0]
    if how == "missing":
        return json.dumps({**content, "submaps": [without(submap, "support")]})
    if how == "name":
        return json.dumps({**content, "robot": "Robot 1"})
    if how == "version":
        return json.dumps({**content, "format": "mapweave/map/2"})
    if how == "not finite":
        return json.dumps({**content, "submaps": [{**submap, "pose": [0, float("nan"), 0]}]})
    return json.dumps(content)[:-200]


SPOILED = {
    "missing": ["submaps[0].support", "expected a map file"],
    "version": ["format", "mapweave/map/1", "mapweave/map/2"],
    "not finite": ["submaps[0].pose[1]", "finite"],
    "cut off": ["expected a map file"],
    "name": ["robot", "expected 1 to 32 characters", "found 'Robot 1'"],
}


@pytest.mark.parametrize("how", SPOILED)
def test_a_spoiled_map_file_fails_in_one_line_that_names_the_field(
    how: str, maps: dict[str, Path], tmp_path: Path
) -> None:
    bad, output = tmp_path / "bad.json", tmp_path / "out.json"
    bad.write_text(spoiled(json.loads(maps["a"].read_text()), how))
    output.write_text("old")
    run = mapweave if how == "not finite" else main_here
    done = run("fuse", maps["b"], bad, "--output", output)
    assert_fails_in_one_line(done, bad, *SPOILED[how])
    assert output.read_text() == "old"


@pytest.mark.parametrize("how", ["missing", "not finite"])
def test_a_spoiled_map_file_is_not_exported(
    how: str, maps: dict[str, Path], tmp_path: Path
) -> None:
    bad, output = tmp_path / "bad.json", tmp_path / "out.geojson"
    bad.write_text(spoiled(json.loads(maps["a"].read_text()), how))
    output.write_text("old")
    run = mapweave if how == "missing" else main_here
    assert_fails_in_one_line(run("export", bad, output), bad, *SPOILED[how])
    assert output.read_text() == "old"


def test_two_maps_of_one_robot_are_not_two_robots(maps: dict[str, Path]) -> None:
    done = main_here("fuse", maps["a"], maps["a"])
    said = "robot 'a' was given already; expected a map of another robot: give each one an id"
    assert_fails_in_one_line(done, maps["a"], said)


def test_a_map_is_exported_as_geometry(maps: dict[str, Path], tmp_path: Path) -> None:
    output = tmp_path / "map.geojson"
    done = main_here("export", maps["a"], output)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert json.loads(output.read_text())["type"] == "FeatureCollection"
    done = main_here("export", maps["a"], output, "--json")
    assert json.loads(done.stdout) == {"output": str(output)}
