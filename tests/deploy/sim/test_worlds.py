"""The built-in worlds and the tours through them."""

from functools import cache

import numpy as np
import pytest
import shapely

from mapweave_deploy.sim.grid import make_grid
from mapweave_deploy.sim.settings import SETTINGS
from mapweave_deploy.sim.trajectories import Tour, plan_tours
from mapweave_deploy.sim.visibility_graph import VisibilityGraph
from mapweave_deploy.sim.world import World

WORLDS = pytest.mark.parametrize("name", ["office", "arena"])
PLACES = [name for name in SETTINGS if name not in ("crowd", "body", "doors", "moved")]
ALL = pytest.mark.parametrize("name", [*PLACES, pytest.param("moved", marks=pytest.mark.slow)])


@cache
def place_and_tours(name: str, seed: int = 5, robots: int = 3) -> tuple[World, list[Tour]]:
    """Return a world and a team's tours through it."""
    world, _ = SETTINGS[name].places(seed, robots)
    return world, plan_tours(world, robots, SETTINGS[name].tours, np.random.default_rng(seed))


@ALL
def test_the_left_of_every_wall_is_free_and_its_right_is_solid(name: str) -> None:
    world = SETTINGS[name].build(5, 0)
    walls = np.vstack([world.walls, world.glass, world.mirrors])
    along = walls[:, 2:] - walls[:, :2]
    middle = (walls[:, :2] + walls[:, 2:]) / 2
    left = np.column_stack([-along[:, 1], along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
    assert np.all(shapely.contains_xy(world.free, *(middle + 1e-5 * left).T))
    assert not np.any(shapely.contains_xy(world.free, *(middle - 1e-5 * left).T))


@WORLDS
def test_a_world_does_not_look_like_itself_turned_or_mirrored(name: str) -> None:
    free = SETTINGS[name].build(5, 0).free
    centre = free.envelope.centroid
    for matrix in ([[-1, 0], [0, -1]], [[-1, 0], [0, 1]], [[1, 0], [0, -1]]):
        around = (shapely.get_coordinates(centre), np.array(matrix))
        turned = shapely.transform(free, lambda p, a=around: (p - a[0]) @ a[1] + a[0])
        assert free.symmetric_difference(turned).area > 0.1 * free.area


@ALL
def test_no_tour_comes_nearer_to_a_wall_than_the_robot_is_wide(name: str) -> None:
    world, tours = place_and_tours(name)
    for tour in tours:
        path = shapely.LineString(tour.pose[:, :2])
        assert world.free.contains(path)
        assert world.free.boundary.distance(path) > SETTINGS[name].tours.radius - 0.06


@ALL
def test_robots_keep_to_their_speed_and_turn_rate(name: str) -> None:
    _, tours = place_and_tours(name)
    parameters = SETTINGS[name].tours
    for tour in tours:
        seconds = np.diff(tour.stamp)
        moved = np.diff(tour.pose, axis=0)
        assert np.all(np.linalg.norm(moved[:, :2], axis=1) <= parameters.speed * seconds + 1e-9)
        assert np.all(np.abs(moved[:, 2]) <= parameters.turn_rate * seconds + 1e-9)


@WORLDS
@pytest.mark.parametrize("robots", [3, pytest.param(6, marks=pytest.mark.slow)])
def test_every_pair_of_tours_sees_15_m_of_the_same_wall(name: str, robots: int) -> None:
    world, tours = place_and_tours(name, robots=robots)
    centres = make_grid(world, SETTINGS[name].tours.radius).centres
    visibility = VisibilityGraph(world, centres, SETTINGS[name].tours.sight)
    seen = [visibility.along(tour.pose[:, :2]) for tour in tours]
    for i in range(robots):
        assert visibility.metres(seen[i]) < 0.8 * np.sum(visibility.piece_length)
        for j in range(i):
            assert visibility.metres(seen[i] & seen[j]) > 15.0


@ALL
def test_another_seed_builds_another_place_and_the_same_seed_the_same(name: str) -> None:
    first, again, other = (SETTINGS[name].build(seed, 0) for seed in (5, 5, 6))
    assert shapely.equals(first.free, again.free)
    assert not shapely.equals(first.free, other.free)
    assert len(first.stops) >= 3


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1, 6))
@ALL
def test_a_robot_can_drive_to_most_of_a_place_whatever_the_seed(name: str, seed: int) -> None:
    world = SETTINGS[name].build(seed, 0)
    grid = make_grid(world, SETTINGS[name].tours.radius)
    reached = len(grid.centres) * 0.1**2
    assert reached > 0.5 * world.free.buffer(-SETTINGS[name].tours.radius).area > 10
    assert np.all(np.diff(shapely.bounds(world.free).reshape(2, 2), axis=0) > 4)


def test_panes_are_where_they_are_built() -> None:
    glass, mirrors = (SETTINGS[name].build(5, 0) for name in ("glass", "mirrors"))
    assert len(glass.glass) >= 12 and len(glass.mirrors) == 0
    assert len(mirrors.mirrors) >= 3 and len(mirrors.glass) == 0
    assert not SETTINGS["ramps"].build(5, 0).terrain.is_level
