"""Where robots drove, as the page is told."""

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from mapweave.geometry import se2
from mapweave.maps import RobotMap, Trajectory
from mapweave_fusion_server.web.versions.paths import TOLERANCE, Paths


def driven(robot_map: RobotMap, poses: np.ndarray) -> RobotMap:
    count = len(poses)
    trajectory = Trajectory(np.arange(count), np.arange(count, dtype=float), poses)
    submaps = tuple(replace(s, trajectory=trajectory) for s in robot_map.submaps)
    return replace(robot_map, submaps=submaps)


def told(*maps: RobotMap) -> Any:  # noqa: ANN401  # JSON
    """Return what is told of a version that was made of `maps`."""
    paths = Paths()
    paths.keep(1, maps)
    kept = paths.of(1)
    assert kept is not None
    return json.loads(kept.json())


def test_a_path_is_where_the_robot_was_in_the_frame_of_its_component(
    make_map: Callable[..., RobotMap],
) -> None:
    poses = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 3, 1.5]])
    robot_map = driven(make_map("a"), poses)
    moved = np.array([5.0, 1.0, np.pi / 2])
    (submap,) = robot_map.submaps
    robot_map = replace(robot_map, submaps=(replace(submap, pose=moved),))
    content = told(robot_map)
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
    ((path,),) = (told(driven(make_map("a"), poses))["components"]["a/0"]["paths"],)
    assert len(path) < 100
    middles = (np.array(path)[1:] + np.array(path)[:-1]) / 2
    assert np.abs(np.hypot(*middles.T) - 3).max() <= TOLERANCE + 1e-3


def test_a_robot_is_in_the_component_of_its_latest_run(make_map: Callable[..., RobotMap]) -> None:
    before = driven(make_map("a"), np.zeros((2, 3)))
    now = driven(make_map("a", boot="second", first=1), np.ones((2, 3)))
    for maps in ([before, now], [now, before]):
        content = told(*maps)
        assert content["robots"] == {"a": "a/1"}
        assert "last" in content["components"]["a/1"]


def test_of_a_version_that_follows_only_what_changed_is_told(
    make_map: Callable[..., RobotMap],
) -> None:
    a, b, c = (driven(make_map(name), np.zeros((2, 3))) for name in "abc")
    paths = Paths()
    paths.keep(1, (a, b, c))
    paths.keep(2, (a, driven(b, np.ones((3, 3)))))
    first, second = paths.of(1), paths.of(2)
    assert first is not None
    assert second is not None
    changes, whole = json.loads(second.json(first)), json.loads(second.json())
    assert set(changes["components"]) == {"b/0"}
    assert changes["gone"] == ["c/0"]
    assert changes["robots"] == whole["robots"] == {"a": "a/0", "b": "b/0"}
    before = json.loads(first.json())["components"]
    del before["c/0"]
    assert {**before, **changes["components"]} == whole["components"]


def test_paths_of_old_versions_go_when_there_are_too_many() -> None:
    paths = Paths(limit=4000)
    for version in range(1, 50):
        paths.keep(version, ())
    assert paths.latest == 49
    assert paths.of(49) is not None
    assert paths.of(1) is None


def test_what_many_versions_share_takes_room_once(make_map: Callable[..., RobotMap]) -> None:
    """And what each adds counts: of maps that differ, fewer versions are kept."""
    angle = np.cumsum(np.random.default_rng(1).normal(0, 1, 3000))
    poses = np.column_stack([np.cumsum(np.cos(angle)), np.cumsum(np.sin(angle)), angle])
    kept = {}
    for same in (True, False):
        paths, robot_map = Paths(limit=200_000), driven(make_map("a"), poses)
        for version in range(1, 101):
            step = np.array([0.0 if same else 0.01 * version, 0.0, 0.0])
            paths.keep(version, (driven(robot_map, poses + step),))
        kept[same] = sum(paths.of(version) is not None for version in range(1, 101))
    assert kept[True] == 100
    assert 1 < kept[False] < 20
