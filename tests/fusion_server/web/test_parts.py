"""Where robots drove, as the page is told."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mapweave.geometry import se2
from mapweave.maps import RobotMap, Trajectory
from mapweave_fusion_server.web.parts import TOLERANCE, paths_content, scene_of


def driven(robot_map: RobotMap, poses: np.ndarray) -> RobotMap:
    count = len(poses)
    trajectory = Trajectory(np.arange(count), np.arange(count, dtype=float), poses)
    submaps = tuple(replace(s, trajectory=trajectory) for s in robot_map.submaps)
    return replace(robot_map, submaps=submaps)


def test_a_path_is_where_the_robot_was_in_the_frame_of_its_component(
    make_map: Callable[..., RobotMap],
) -> None:
    poses = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 3, 1.5]])
    robot_map = driven(make_map("a"), poses)
    moved = np.array([5.0, 1.0, np.pi / 2])
    (submap,) = robot_map.submaps
    robot_map = replace(robot_map, submaps=(replace(submap, pose=moved),))
    content = paths_content(7, [robot_map])
    expected = se2.compose(moved, poses)
    ((path,),) = (content["components"]["a/0"]["paths"],)
    # What lies straight between two others says nothing.
    assert np.allclose(path, expected[[0, 2, 3], :2], atol=1e-3)
    assert np.allclose(content["components"]["a/0"]["last"], expected[-1], atol=1e-3)
    assert content["robots"] == {"a": "a/0"}


def test_a_path_is_told_to_less_than_the_width_of_its_line(
    make_map: Callable[..., RobotMap],
) -> None:
    angle = np.linspace(0, 2 * np.pi, 400)
    poses = np.column_stack([3 * np.cos(angle), 3 * np.sin(angle), angle])
    ((path,),) = (paths_content(1, [driven(make_map("a"), poses)])["components"]["a/0"]["paths"],)
    assert len(path) < 100
    middles = (np.array(path)[1:] + np.array(path)[:-1]) / 2
    assert np.abs(np.hypot(*middles.T) - 3).max() <= TOLERANCE + 1e-3


def test_a_robot_is_in_the_component_of_its_latest_run(make_map: Callable[..., RobotMap]) -> None:
    before = driven(make_map("a"), np.zeros((2, 3)))
    now = driven(make_map("a", boot="second", first=1), np.ones((2, 3)))
    for maps in ([before, now], [now, before]):
        content = paths_content(1, maps)
        assert content["robots"] == {"a": "a/1"}
        assert "last" in content["components"]["a/1"]


def test_a_component_is_found_by_its_whole_name(make_map: Callable[..., RobotMap]) -> None:
    maps = [make_map("a"), make_map("ab", components=2)]
    found = scene_of(maps, "ab/1")
    assert found is not None
    assert found.name == "ab/1"
    assert scene_of(maps, "a/1") is None
