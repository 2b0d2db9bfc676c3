"""Whose maps are here, and which of a robot's runs count."""

import numpy as np

from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave_agent.comparing.team_maps import TeamMaps


def run(boot: str, version: int, component: int) -> RobotMap:
    submap = Submap(0, component, np.zeros(3), LineMap.empty(), Trajectory.empty())
    return RobotMap("a", boot, version, (submap,))


def test_the_map_of_a_run_is_current_while_it_is_alive_or_the_last() -> None:
    team = TeamMaps()
    assert team.current_version_of("a", "first") is None
    team.take(run("first", 7, 0))
    assert team.current_version_of("a", "first") == 7
    team.take(run("second", 3, 1))
    assert team.current_version_of("a", "second") == 3
    assert team.current_version_of("a", "first") is None and team.version_of("a", "first") == 7
    team.here("a", "first")
    assert team.current_version_of("a", "first") == 7
    team.left("a", "first")
    assert team.current_version_of("a", "first") is None
