"""The simulated lidar against closed forms and an independent intersection."""

import numpy as np
import pytest
import shapely

from mapweave.geometry.arrays import FloatArray
from mapweave_deploy.sim.effects.rays import cast_rays
from mapweave_deploy.sim.lidar import LidarParameters, measure
from mapweave_deploy.sim.office import office
from mapweave_deploy.sim.world import World, make_world

PERFECT = LidarParameters(noise=0.0, dropout=0.0, grazing=0.0, mixed=0.0)


def hall(dark: shapely.Polygon | None = None) -> World:
    """Return a bare hall of 10 × 6 m."""
    return make_world(
        "hall", shapely.box(0, 0, 10, 6), dark or shapely.Polygon(), np.array([[1.0, 1.0]])
    )


def test_range_in_a_rectangular_hall_is_the_closed_form() -> None:
    rng = np.random.default_rng(1)
    angles = PERFECT.angles
    for x, y, theta in rng.uniform((0.5, 0.5, -np.pi), (9.5, 5.5, np.pi), size=(20, 3)):
        c, s = np.cos(theta + angles), np.sin(theta + angles)
        to_sides = np.where(c > 0, 10 - x, x) / np.abs(c)
        to_ends = np.where(s > 0, 6 - y, y) / np.abs(s)
        ranges = measure(hall(), np.array([x, y, theta]), PERFECT, rng)
        np.testing.assert_allclose(ranges, np.minimum(to_sides, to_ends), atol=1e-9)


def test_a_ray_ends_where_an_independent_intersection_says() -> None:
    world = office(3)
    rng = np.random.default_rng(2)
    for origin in world.stops[::4]:
        directions = rng.uniform(-np.pi, np.pi, size=40)
        hits = cast_rays(world.walls, origin, directions)
        np.testing.assert_allclose(hits.range, shapely_ranges(world, origin, directions), atol=1e-6)


def shapely_ranges(world: World, origin: FloatArray, directions: FloatArray) -> FloatArray:
    """Return the distance to the nearest wall along each direction, by shapely."""
    here = shapely.Point(origin)
    ends = origin + 100 * np.column_stack([np.cos(directions), np.sin(directions)])
    return np.array(
        [
            here.distance(shapely.LineString([origin, end]).intersection(world.free.boundary))
            for end in ends
        ]
    )


def test_a_wall_is_seen_from_its_left_only() -> None:
    wall = np.array([[2.0, 1.0, 2.0, -1.0]])  # runs towards -y: its left is +x
    assert cast_rays(wall, np.array([5.0, 0.0]), np.array([np.pi])).range[0] == pytest.approx(3.0)
    assert np.isinf(cast_rays(wall, np.array([0.0, 0.0]), np.array([0.0])).range[0])


def test_the_grazing_angle_is_that_between_ray_and_wall() -> None:
    wall = np.array([[-50.0, 2.0, 50.0, 2.0]])[:, [2, 3, 0, 1]]
    directions = np.radians([10.0, 45.0, 90.0, 170.0])
    hits = cast_rays(wall, np.zeros(2), directions)
    np.testing.assert_allclose(np.degrees(hits.grazing), [10.0, 45.0, 90.0, 10.0])


def test_noise_has_the_size_it_is_given() -> None:
    noisy = PERFECT.model_copy(update={"noise": 0.02})
    pose, rng = np.array([4.0, 3.0, 0.3]), np.random.default_rng(3)
    exact = measure(hall(), pose, PERFECT, rng)
    errors = np.array([measure(hall(), pose, noisy, rng) - exact for _ in range(50)])
    assert np.std(errors) == pytest.approx(0.02, rel=0.05)
    assert abs(np.mean(errors)) < 0.001


def test_dark_walls_beyond_reach_and_dropouts_read_the_maximum() -> None:
    rng, pose = np.random.default_rng(4), np.array([5.0, 3.0, 0.0])
    dark = measure(hall(shapely.box(-1, -1, 11, 7)), pose, _with(dark_return=0.0), rng)
    far = measure(hall(), pose, _with(maximum_range=1.0), rng)
    lost = measure(hall(), pose, _with(dropout=1.0), rng)
    assert np.all(dark == PERFECT.maximum_range)
    assert np.all(far == 1.0)
    assert np.all(lost == PERFECT.maximum_range)


def _with(**changes: float) -> LidarParameters:
    return PERFECT.model_copy(update=changes)


def test_a_mixed_reading_lies_between_the_two_surfaces_of_its_edge() -> None:
    pillar = shapely.box(0, 0, 10, 6).difference(shapely.box(6, 2.5, 7, 3.5))
    world = make_world("pillar", pillar, shapely.Polygon(), np.array([[1.0, 1.0]]))
    rng, pose = np.random.default_rng(5), np.array([3.0, 3.0, 0.0])
    exact = measure(world, pose, PERFECT, rng)
    mixed = measure(world, pose, _with(mixed=1.0), rng)
    changed = np.flatnonzero(mixed != exact)
    low = np.minimum(exact[changed], exact[changed + 1])
    high = np.maximum(exact[changed], exact[changed + 1])
    assert len(changed) == 2
    assert np.all((low < mixed[changed]) & (mixed[changed] < high))
