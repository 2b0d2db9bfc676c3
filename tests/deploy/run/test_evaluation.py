"""Joined rightly or not: against truths that are known."""

from pathlib import Path

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import JointComponent, JointMap, LineMap, RobotMap, Submap, Trajectory
from mapweave_deploy.run.evaluation import (
    Limits,
    PairEvaluation,
    judge,
    main_component,
    scan_counts,
)
from mapweave_deploy.run.team_plan import Member

LIMITS = Limits(0.3, np.radians(3.0))


def drive(rng: np.random.Generator) -> FloatArray:
    """Return (50, 3) poses of a random path [m, m, rad]."""
    steps = np.column_stack([rng.normal(0, 0.3, (50, 2)), rng.normal(0, 0.2, 50)])
    return np.cumsum(steps, axis=0)


def team(
    rng: np.random.Generator,
    error: FloatArray,
    places: tuple[str, str] = ("x", "x"),
    known: slice = slice(None),
) -> list[PairEvaluation]:
    """Judge robots a and b, joined with `error` (3,) in the frame of b; the truth of `known`."""
    frames = {"a": rng.normal(0, 3, 3), "b": rng.normal(0, 3, 3)}  # in the world
    paths = {robot: drive(rng) for robot in frames}
    world_to_joint = rng.normal(0, 3, 3)
    robots = {f"{robot}/0": se2.compose(world_to_joint, frame) for robot, frame in frames.items()}
    robots["b/0"] = se2.compose(robots["b/0"], error)
    component = JointComponent(robots, 1.0, LineMap.empty(), np.empty(0))
    index = np.arange(50)[known]
    members = [
        Member(r, Path("log"), (0, 50), place, index, se2.compose(frames[r], paths[r][known]))
        for r, place in zip("ab", places, strict=True)
    ]
    maps = {robot: robot_map(robot, path, rng) for robot, path in paths.items()}
    return list(judge(JointMap(1, (component,), ()), maps, members, LIMITS))


def robot_map(robot: str, path: FloatArray, rng: np.random.Generator) -> RobotMap:
    """Return a robot map of two submaps along `path`."""
    submaps = []
    for number, part in enumerate(np.split(np.arange(50), 2)):
        frame = rng.normal(0, 3, 3)
        trajectory = Trajectory(part, np.zeros(25), se2.between(frame, path[part]))
        submaps.append(Submap(number, 0, frame, LineMap.empty(), trajectory))
    return RobotMap(robot, "boot", 1, tuple(submaps))


def test_robots_joined_as_in_truth_are_right_wherever_the_frames_are() -> None:
    for seed in range(10):
        [verdict] = team(np.random.default_rng(seed), np.zeros(3))
        assert verdict.right
        assert verdict.distance < 1e-9
        assert verdict.angle < 1e-9


def test_the_error_of_a_wrong_place_is_its_shift() -> None:
    [verdict] = team(np.random.default_rng(2), np.array([0.3, 0.4, 0.0]))
    assert not verdict.right
    assert verdict.distance == pytest.approx(0.5)
    assert verdict.angle == pytest.approx(0.0, abs=1e-9)


def test_the_error_of_a_wrong_turn_is_its_angle() -> None:
    [verdict] = team(np.random.default_rng(3), np.array([0.0, 0.0, -0.06]))
    assert verdict.angle == pytest.approx(0.06)
    assert not verdict.right


@pytest.mark.parametrize("known", [slice(None), slice(0)])
def test_a_join_across_places_is_not_judged_whatever_is_known_of_each(known: slice) -> None:
    rng = np.random.default_rng(4)
    [verdict] = team(rng, np.zeros(3), ("x", "y"), known)
    assert (verdict.reference, verdict.other, verdict.right) == ("a/0", "b/0", None)


def test_where_no_truth_is_known_a_join_is_left_out() -> None:
    assert team(np.random.default_rng(5), np.zeros(3), known=slice(0)) == []


def test_the_component_with_most_scans_stands_for_a_robot() -> None:
    parts = [(0, 3), (1, 5), (0, 4)]
    submaps = tuple(
        Submap(
            number,
            part,
            np.zeros(3),
            LineMap.empty(),
            Trajectory(np.arange(scans), np.zeros(scans), np.zeros((scans, 3))),
        )
        for number, (part, scans) in enumerate(parts)
    )
    whole = RobotMap("a", "boot", 1, submaps)
    assert scan_counts(whole) == {"a/0": 7, "a/1": 5}
    assert main_component(whole) == "a/0"
