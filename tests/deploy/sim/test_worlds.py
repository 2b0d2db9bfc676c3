"""The built-in worlds and the tours through them."""

from functools import cache

import numpy as np
import pytest
import shapely

from mapweave_deploy.sim.grid import make_grid
from mapweave_deploy.sim.simulation import BUILDERS, TOURS
from mapweave_deploy.sim.trajectories import Tour, plan_tours
from mapweave_deploy.sim.visibility_graph import VisibilityGraph
from mapweave_deploy.sim.world import World

WORLDS = pytest.mark.parametrize("name", ["office", "arena"])


@cache
def place_and_tours(name: str, seed: int = 5, robots: int = 3) -> tuple[World, list[Tour]]:
    """Return a world and a team's tours through it."""
    world = BUILDERS[name](seed)
    return world, plan_tours(world, robots, TOURS[name], np.random.default_rng(seed))


@WORLDS
def test_the_left_of_every_wall_is_free_and_its_right_is_solid(name: str) -> None:
    world = BUILDERS[name](5)
    along = world.walls[:, 2:] - world.walls[:, :2]
    middle = (world.walls[:, :2] + world.walls[:, 2:]) / 2
    left = np.column_stack([-along[:, 1], along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
    assert np.all(shapely.contains_xy(world.free, *(middle + 1e-5 * left).T))
    assert not np.any(shapely.contains_xy(world.free, *(middle - 1e-5 * left).T))


@WORLDS
def test_a_world_does_not_look_like_itself_turned_or_mirrored(name: str) -> None:
    free = BUILDERS[name](5).free
    centre = free.envelope.centroid
    for matrix in ([[-1, 0], [0, -1]], [[-1, 0], [0, 1]], [[1, 0], [0, -1]]):
        around = (shapely.get_coordinates(centre), np.array(matrix))
        turned = shapely.transform(free, lambda p, a=around: (p - a[0]) @ a[1] + a[0])
        assert free.symmetric_difference(turned).area > 0.1 * free.area


@WORLDS
def test_no_tour_comes_nearer_to_a_wall_than_the_robot_is_wide(name: str) -> None:
    world, tours = place_and_tours(name)
    for tour in tours:
        path = shapely.LineString(tour.pose[:, :2])
        assert world.free.contains(path)
        assert world.free.boundary.distance(path) > TOURS[name].radius - 0.06


@WORLDS
def test_robots_keep_to_their_speed_and_turn_rate(name: str) -> None:
    _, tours = place_and_tours(name)
    parameters = TOURS[name]
    for tour in tours:
        seconds = np.diff(tour.stamp)
        moved = np.diff(tour.pose, axis=0)
        assert np.all(np.linalg.norm(moved[:, :2], axis=1) <= parameters.speed * seconds + 1e-9)
        assert np.all(np.abs(moved[:, 2]) <= parameters.turn_rate * seconds + 1e-9)


@WORLDS
@pytest.mark.parametrize("robots", [3, pytest.param(6, marks=pytest.mark.slow)])
def test_every_pair_of_tours_sees_15_m_of_the_same_wall(name: str, robots: int) -> None:
    world, tours = place_and_tours(name, robots=robots)
    centres = make_grid(world, TOURS[name].radius).centres
    visibility = VisibilityGraph(world, centres, TOURS[name].sight)
    seen = [visibility.along(tour.pose[:, :2]) for tour in tours]
    for i in range(robots):
        assert visibility.metres(seen[i]) < 0.8 * np.sum(visibility.piece_length)
        for j in range(i):
            assert visibility.metres(seen[i] & seen[j]) > 15.0
