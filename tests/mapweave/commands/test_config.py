"""``mapweave config`` shows what is in force; the commands that compute take it."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from mapweave.cli import EXIT_FAILED, main
from mapweave.config import Config, Mapping
from mapweave.io.map_files import read_joint, read_map, write_map
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave.team.joint_map import fuse
from tests.mapweave.buildings import BUILDING, cast, line_map, part, walls_of
from tests.mapweave.commands.test_commands import flaser

CHANGES = "[sensor]\nrange_sigma = 0.03\n[mapping]\nsubmap_length = 2.0\nmin_confidence = 0.9\n"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "robot.toml"
    path.write_text(CHANGES)
    return path


@pytest.fixture(autouse=True)
def _no_variables(monkeypatch: pytest.MonkeyPatch) -> None:
    for setting in Config().settings():
        name = f"MAPWEAVE_{setting.section}_{setting.name}".upper()
        monkeypatch.delenv(name, raising=False)


def said(capsys: pytest.CaptureFixture[str], *words: str | Path) -> str:
    assert main([str(word) for word in words]) == 0
    text = capsys.readouterr()
    assert text.err == ""
    return text.out


def test_what_is_shown_is_a_file_that_says_the_same(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = tmp_path / "shown.toml"
    shown.write_text(said(capsys, "config", "--config", file))
    assert Config.load(shown) == Config.load(file) != Config()
    assert list(tomllib.loads(shown.read_text())) == ["sensor", "robot", "mapping"]


def test_each_value_is_shown_with_its_unit_and_where_it_comes_from(
    file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("MAPWEAVE_ROBOT_MAX_SPEED", "1.5")
    lines = said(capsys, "config", "--config", file).splitlines()
    (sigma,) = (line for line in lines if line.startswith("range_sigma = 0.03 "))
    (speed,) = (line for line in lines if line.startswith("max_speed = 1.5 "))
    (rate,) = (line for line in lines if line.startswith("# rate unset "))
    assert "# [m] " in sigma and sigma.endswith(f"({file})")
    assert "# [m/s] " in speed and speed.endswith("(MAPWEAVE_ROBOT_MAX_SPEED)")
    assert "# [Hz] " in rate and rate.endswith("(default)")


def test_a_program_gets_the_same_as_json(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told = json.loads(said(capsys, "config", "--config", file, "--json"))
    values = {s: {n: each["value"] for n, each in fields.items()} for s, fields in told.items()}
    assert values == Config.load(file).values()
    origin, unit = (told["sensor"]["range_sigma"][key] for key in ("from", "unit"))
    assert (origin, unit) == (str(file), "m")
    assert told["robot"]["max_speed"]["from"] == "default"


@pytest.mark.parametrize(
    "words",
    [
        ["config"],
        ["map", "none.log"],
        ["fuse", "none.json", "other.json"],
        ["agent", "--robot", "a", "--log", "none.log"],
        ["server"],
        ["team", "--world", "arena", "--output", "none"],
    ],
)
def test_a_configuration_that_is_wrong_ends_a_command_before_any_work(
    words: list[str],
    file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    file.write_text("[sensor]\nrate = -1")
    assert main([*words, "--config", str(file)]) == EXIT_FAILED
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"mapweave: {file}: sensor.rate: expected a number ")
    assert list(tmp_path.iterdir()) == [file]


def test_a_map_is_made_with_the_configuration_and_says_so(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    noise = np.random.default_rng(3)
    log, made, plain = (tmp_path / name for name in ("log", "made.json", "plain.json"))
    poses = [[x, 1.0, 0.1] for x in 3 + 0.3 * np.arange(12)]
    scans = [cast(walls_of(BUILDING), p, index=k, noise=noise) for k, p in enumerate(poses)]
    log.write_bytes(b"".join(flaser(scan, np.zeros(3)) for scan in scans))
    said(capsys, "map", log, "--output", made, "--config", file)
    said(capsys, "map", log, "--output", plain)
    for path, config in ((made, Config.load(file)), (plain, Config())):
        told = read_map(path).made_with
        assert told is not None
        assert told.config == config.values()
        assert told.program.startswith("mapweave 0.")
    assert len(read_map(made).submaps) == 2 and len(read_map(plain).submaps) == 1


def robot_map(robot: str, lines: LineMap) -> RobotMap:
    return RobotMap(robot, "x", 1, (Submap(0, 0, np.zeros(3), lines, Trajectory.empty()),))


def test_maps_are_fused_with_the_configuration_and_the_joint_map_says_so(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    seen = {"a": part(BUILDING, 0, 18), "b": part(BUILDING, 8, 30)}
    paths = [tmp_path / f"{robot}.json" for robot in seen]
    for path, (robot, lines) in zip(paths, seen.items(), strict=True):
        write_map(path, robot_map(robot, lines))
    joint = tmp_path / "joint.json"
    said(capsys, "fuse", *paths, "--output", joint, "--config", file)
    told = read_joint(joint).made_with
    assert told is not None
    assert told.config == Config.load(file).values()


def test_the_configuration_decides_how_sure_an_alignment_must_be() -> None:
    maps = [robot_map("a", part(BUILDING, 0, 16)), robot_map("b", part(BUILDING, 12, 30))]
    joined, apart = (
        fuse(maps, config=Config(mapping=Mapping(min_confidence=least))) for least in (0.9, 0.999)
    )
    assert (len(joined.components), len(apart.components)) == (1, 2)


def test_the_joint_map_groups_its_lines_as_the_configuration_says() -> None:
    walls = np.array([[0.0, 0, 5, 0], [6, 0, 11, 0]])  # a metre apart
    maps = [robot_map(name, line_map(walls)) for name in ("a", "b")]
    for gap, polylines in ((0.9, 2), (1.1, 1)):
        joint = fuse(maps, config=Config(mapping=Mapping(max_gap=gap)))
        assert [len(c.map.polylines) for c in joint.components] == [polylines] * 2
