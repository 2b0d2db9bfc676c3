"""A team over two logs: each robot's truth is its own log's, and a join across is not judged."""

import re
from pathlib import Path

import numpy as np
import pytest

from mapweave.geometry.arrays import FloatArray
from mapweave.io.map_files import read_joint
from mapweave.maps import JointComponent, JointMap, LineMap, RobotMap, Submap, Trajectory
from mapweave_deploy.run.launcher import TeamOutcome
from mapweave_deploy.run.recorder import Recorder
from mapweave_deploy.run.report import Verdicts, tell_verdicts
from mapweave_deploy.run.team_plan import Member
from mapweave_deploy.sim.simulation import RobotLog, simulate
from tests.deploy.run.test_team import run_team

EVERY = 3  # scans, of which one is kept: 0.3 m apart
SHARE = 0.6  # of a tour, the rest is left out


def with_truth(log: RobotLog) -> str:
    """Return the lines of a simulated log with the true poses in them."""
    lines = log.log.read_text().splitlines()
    last = round(SHARE * len(lines))
    return "".join(
        _posed(line, pose)
        for line, pose in zip(lines[:last:EVERY], log.tour.pose[:last:EVERY], strict=True)
    )


def _posed(line: str, pose: FloatArray) -> str:
    words = line.split()
    there = [f"{value:.4f}" for value in pose]
    return " ".join([*words[:-14], *there, *there, *words[-8:]]) + "\n"


def record(folder: Path, seed: int) -> Path:
    """Record a drive through the arena that `seed` builds."""
    [robot] = simulate("arena", 1, seed, folder / f"simulated-{seed}")
    path = folder / f"arena-{seed}.log"
    path.write_text(with_truth(robot))
    return path


@pytest.mark.slow
def test_two_buildings_end_in_two_components_rightly(tmp_path: Path) -> None:
    logs = [str(record(tmp_path, seed)) for seed in (1, 2)]
    said = run_team(tmp_path / "team", *logs, "--robots", "2").said
    joint = read_joint(tmp_path / "team" / "joint.json")
    assert [sorted(c.robots) for c in joint.components] == [["r1/0", "r2/0"], ["r3/0", "r4/0"]]
    assert "4 robots in 2 components.\nNothing is joined across the 2 logs.\n" in said
    assert "2 of 2 joined pairs are right within 0.5 m and 5°" in said
    # Why not is told as it happens.
    assert re.search(r"^r[12]/0 and r[34]/0: (refused|ambiguous)", said, re.MULTILINE)


def member(robot: str, place: str) -> Member:
    return Member(robot, Path(place), (0, 2), place, np.arange(0), np.empty((0, 3)))


def robot_map(robot: str, *scans: int) -> RobotMap:
    """Return a map with a component of each of so many `scans`."""
    submaps = [
        Submap(
            number,
            number,
            np.zeros(3),
            LineMap.empty(),
            Trajectory(np.arange(count), np.zeros(count), np.zeros((count, 3))),
        )
        for number, count in enumerate(scans)
    ]
    return RobotMap(robot, "boot", 1, tuple(submaps))


def verdict(groups: list[str], places: tuple[str, str]) -> list[str]:
    """Tell robots a (7 and 2 scans) and b (7 scans), joined as in `groups`."""
    components = tuple(
        JointComponent(
            {name: np.zeros(3) for name in group.split()}, 1.0, LineMap.empty(), np.empty(0)
        )
        for group in groups
    )
    maps = {"a": robot_map("a", 7, 2), "b": robot_map("b", 7)}
    members = [member("a", places[0]), member("b", places[1])]
    outcome = TeamOutcome(JointMap(1, components, ()), maps, Recorder())
    return list(tell_verdicts(outcome, members, Verdicts.of(outcome, members, simulated=False)))


def test_a_join_across_logs_is_named_and_called_neither_right_nor_wrong() -> None:
    lines = verdict(["a/0 b/0", "a/1"], ("x", "y"))
    told = "  a/0 and b/0: joined across logs, which is right only if these are of one building"
    assert lines[-1] == told
    assert "Nothing is joined across the 2 logs." not in lines


def test_what_is_left_over_of_a_robot_is_no_home_of_it_and_named() -> None:
    lines = verdict(["a/0 b/0", "a/1"], ("x", "x"))
    assert lines[:2] == ["2 robots in 1 component.", "  joined to none of them: a/1 (2 scans)"]


@pytest.mark.parametrize("groups", [["a/0", "b/0", "a/1"], ["b/0", "a/0 a/1"]])
def test_robots_apart_are_counted_apart(groups: list[str]) -> None:
    assert verdict(groups, ("x", "y"))[:2] == [
        "2 robots in 2 components.",
        "Nothing is joined across the 2 logs.",
    ]


def test_joins_without_any_truth_are_said_not_to_be_judged() -> None:
    lines = verdict(["a/0 b/0"], ("x", "x"))
    assert lines[-1] == "What was joined cannot be judged: there are no poses in the log."
