"""``mapweave team`` from scans to the joint map, with real processes."""

import json
import re
import subprocess
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import pytest

from mapweave.config import Config, Mapping
from mapweave.io.map_files import read_joint
from mapweave.maps import parse_component
from mapweave_deploy.keys.team_keys import make_keys
from mapweave_fusion_server.store import Store
from mapweave_protocol.link.security.roster import Roster
from mapweave_protocol.wire.codec import decode
from mapweave_protocol.wire.messages import JointMapMessage

PROGRAM = [sys.executable, "-c", "import sys; from mapweave.cli import main; sys.exit(main())"]


@dataclass(frozen=True)
class Run:
    """A team that has run to its end."""

    folder: Path
    said: str
    as_json: str = ""


def run_team(folder: Path, *arguments: str) -> Run:
    """Run a team to its end."""
    done = subprocess.run(
        [*PROGRAM, "team", *arguments, "--output", str(folder), "--timeout", "900"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return (
        Run(folder, done.stderr, done.stdout) if "--json" in arguments else Run(folder, done.stdout)
    )


@pytest.fixture(scope="module")
def arena(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Return what two robots came to, under keys, a little more patient than others."""
    folder = tmp_path_factory.mktemp("arena")
    config = folder / "patient.toml"
    config.write_text("[mapping]\npatience = 6\n")
    keys = folder / "keys"
    list(make_keys(Roster("team", ("r1", "r2")), keys, datetime.now(UTC), 1, []))
    given = ["--config", str(config), "--tls", str(keys)]
    return run_team(folder, "--world", "arena", "--robots", "2", *given, "--json")


def test_the_robots_end_in_one_component_rightly(arena: Run) -> None:
    joint = read_joint(arena.folder / "joint.json")
    assert [sorted(component.robots) for component in joint.components] == [["r1/0", "r2/0"]]
    last_lines = arena.said.splitlines()[-3:]
    assert last_lines[0] == "2 robots in 1 component."
    expected = "1 of 1 joined pairs are right within 0.3 m and 3° of the simulated truth."
    assert last_lines[-1] == expected


def test_words_say_who_joined_whom_with_which_confidence(arena: Run) -> None:
    assert re.search(r"r1/0 and r2/0, confidence (over )?\d+%: \d+ m of wall in common", arena.said)


def test_words_name_the_files_which_are_there(arena: Run) -> None:
    for name in ("joint.png", "joint.json", "store.sqlite"):
        assert str(arena.folder / name) in arena.said
        assert (arena.folder / name).stat().st_size > 0


def test_words_count_what_each_robot_sent_and_its_scans_as_a_grid(arena: Run) -> None:
    for robot in ("r1", "r2"):
        assert re.search(
            rf"  {robot}: [\d.]+ kB, \d+ B a metre: map \d+ B in \d+ messages,.*\n"
            r" +the same drive as scans every 0.5 m, deflated: [\d.]+ kB, \d+ B a metre\n"
            r" +the same scans as an occupancy grid of 5 cm, once: [\d.]+ kB, deflated",
            arena.said,
        )


def test_the_joint_map_written_is_the_last_version_of_the_store(arena: Run) -> None:
    written = json.loads((arena.folder / "joint.json").read_text())
    with Store(arena.folder / "store.sqlite", "team") as store:
        messages = list(store.versions_since(0))
        last = decode(JointMapMessage, messages[-1])
    assert last.version == written["version"] == len(messages)
    assert len(last.components) == len(written["components"])


def test_the_joint_map_written_says_what_it_was_made_with(arena: Run) -> None:
    made_with = read_joint(arena.folder / "joint.json").made_with
    assert made_with is not None
    assert made_with.config == Config(mapping=Mapping(patience=6)).values()


def test_a_program_gets_what_came_of_it_in_one_line_of_json(arena: Run) -> None:
    content = json.loads(arena.as_json)
    joint = read_joint(arena.folder / "joint.json")
    assert content["version"] == joint.version
    assert [c["robots"] for c in content["components"]] == [["r1/0", "r2/0"]]
    [judged] = content["judged"]
    assert judged["right"] is True
    assert judged["distance_m"] < 0.3
    assert all(robot["placed"] > 0 and not robot["lost"] for robot in content["robots"].values())
    assert all(Path(path).exists() for path in content["files"].values())


def test_of_the_versions_those_were_told_that_changed_who_is_together(arena: Run) -> None:
    told = re.findall(r"^joint map (\d+): (?!.* sure)(.*)$", arena.said, re.MULTILINE)
    assert int(told[0][0]) == 1
    assert [int(version) for version, _ in told] == sorted({int(version) for version, _ in told})
    assert len({who for _, who in told}) == len(told)
    assert "r1/0 + r2/0" in told[-1][1]


@pytest.mark.slow
def test_three_robots_in_the_office_end_in_one_component_rightly(tmp_path: Path) -> None:
    said = run_team(tmp_path, "--world", "office").said
    assert "3 robots in 1 component." in said
    assert "3 of 3 joined pairs are right within 0.3 m and 3° of the simulated truth." in said


@pytest.mark.slow
def test_a_real_log_in_three_stretches_is_joined_and_not_wrongly(
    tmp_path: Path, data_dir: Path
) -> None:
    run = run_team(tmp_path, str(data_dir / "fr079.log.gz"))
    joint = read_joint(run.folder / "joint.json")
    assert max(len(component.robots) for component in joint.components) >= 2
    assert "WRONG" not in run.said


@pytest.mark.slow
def test_six_robots_on_four_laps_of_a_building_end_in_one_component(
    tmp_path: Path, data_dir: Path
) -> None:
    run = run_team(tmp_path, str(data_dir / "intel.log.gz"), "--robots", "6")
    largest = read_joint(run.folder / "joint.json").components[0]
    assert {f"r{number}/0" for number in range(1, 7)} <= largest.robots.keys()
    assert "WRONG" not in run.said


@pytest.mark.slow
def test_robots_in_two_buildings_end_in_two_components(tmp_path: Path, data_dir: Path) -> None:
    logs = [str(data_dir / name) for name in ("intel.log.gz", "seattle.log.gz")]
    run = run_team(tmp_path, *logs, "--robots", "3")
    components = read_joint(run.folder / "joint.json").components
    groups = [{parse_component(name)[0] for name in component.robots} for component in components]
    assert sorted(groups, key=min) == [{"r1", "r2", "r3"}, {"r4", "r5", "r6"}]
    assert "WRONG" not in run.said
