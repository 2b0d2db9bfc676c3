"""ICP on oriented points finds a motion back, and is held only by what holds (paper, V)."""

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.matching.icp import IcpParameters, Target, align, partners
from mapweave.scan.points import OrientedPoints, join_points, points_on_lines
from tests.mapweave.buildings import BUILDING, line_map, random_pose, rectangle, walls_of

P = IcpParameters()


def surface_of(walls: FloatArray, spacing: float = 0.1) -> OrientedPoints:
    return points_on_lines(line_map(walls), spacing)[0]


ROOMS = surface_of(walls_of(BUILDING))


def assert_same_pose(found: FloatArray, true: FloatArray, metres: float, degrees: float) -> None:
    x, y, turn = se2.between(true, found)
    assert np.hypot(x, y) < metres
    assert abs(np.degrees(turn)) < degrees


@pytest.mark.parametrize("seed", range(8))
def test_a_seeded_small_motion_is_found_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    near = ROOMS.at(np.hypot(*(ROOMS.points - [13, 0]).T) < 7)
    motion = np.array([*rng.uniform(-0.3, 0.3, 2), rng.uniform(-0.15, 0.15)])
    # Turn about the middle of what moves, as a robot does that stands there.
    origin = np.array([13.0, 0.0, 0.0])
    true = se2.compose(origin, motion)
    moving = near.moved(se2.inverse(true))
    fit = align(moving, Target.of(ROOMS, P), origin, P)
    assert_same_pose(fit.pose, true, 0.002, 0.02)


def test_noise_on_every_point_hardly_moves_the_pose(rng: Generator) -> None:
    true = np.array([0.15, -0.1, 0.05])
    near = ROOMS.at(ROOMS.points[:, 0] < 9)
    moving = near.moved(se2.inverse(true))
    noisy = OrientedPoints(
        moving.points + rng.normal(0, 0.02, moving.points.shape), moving.normals, moving.polyline
    )
    assert_same_pose(align(noisy, Target.of(ROOMS, P), se2.IDENTITY, P).pose, true, 0.01, 0.1)


def test_where_the_target_is_changes_nothing(rng: Generator) -> None:
    """The same motion is found in any frame: target and start move, the pose moves along."""
    true, frame = np.array([0.2, 0.1, -0.08]), random_pose(rng)
    moving = ROOMS.moved(se2.inverse(true))
    here = align(moving, Target.of(ROOMS, P), se2.IDENTITY, P).pose
    there = align(moving, Target.of(ROOMS.moved(frame), P), frame, P).pose
    np.testing.assert_allclose(se2.between(frame, there), here, atol=1e-3)


def test_a_wall_holds_across_and_not_along() -> None:
    """Two parallel walls: the information along them is nil, and the start is kept there."""
    walls = surface_of(np.array([[0.0, 0, 20, 0], [20, 2, 0, 2]]))
    moving = walls.at((walls.points[:, 0] > 5) & (walls.points[:, 0] < 15))
    fit = align(moving.moved(np.array([0.0, -0.1, 0.0])), Target.of(walls, P), np.zeros(3), P)
    np.testing.assert_allclose(fit.pose, [0, 0.1, 0], atol=2e-3)
    assert fit.information[0, 0] < 1e-6 * fit.information[1, 1]


def test_the_prior_decides_the_direction_that_walls_leave_open() -> None:
    """A corner far along pulls weakly; a firm prior holds against it, a loose one does not."""
    walls = surface_of(np.array([[0.0, 0, 20, 0], [20, 2, 0, 2]]))
    stub = surface_of(np.array([[12.0, 2, 12, 1.7]]))
    target = Target.of(join_points([walls, stub]), P)
    moving = join_points([walls, stub]).moved(np.array([-0.15, 0.0, 0.0]))
    loose = align(moving, target, np.zeros(3), P, np.diag([1e-3, 1e-3, 1e-3])).pose
    firm = align(moving, target, np.zeros(3), P, np.diag([1e6, 1e6, 1e6])).pose
    assert loose[0] == pytest.approx(0.15, abs=0.01)
    assert firm[0] == pytest.approx(0.0, abs=0.01)


def test_a_prior_as_strong_as_the_walls_holds_a_pose_half_way() -> None:
    """The walls pull across by 0.1 m, every point at full weight."""
    parameters = IcpParameters(start_scale=1e6, end_scale=1e6)
    walls = surface_of(np.array([[0.0, 0, 20, 0], [20, 2, 0, 2]]))
    moving = walls.moved(np.array([0.0, -0.1, 0.0]))
    strength = len(walls) / parameters.noise**2
    prior = np.diag([strength, strength, 1e9])
    fit = align(moving, Target.of(walls, parameters), np.zeros(3), parameters, prior)
    assert fit.pose[1] == pytest.approx(0.05, abs=1e-3)


def test_what_was_moved_in_a_room_hardly_pulls(rng: Generator) -> None:
    """A fifth of the points lie 0.1 m before their wall: they count for little, not for a fifth."""
    room = surface_of(walls_of(rectangle(0, 0, 6, 4)))
    moved = rng.random(len(room)) < 0.2
    points = room.points + np.where(moved[:, None], 0.1 * np.array([1.0, 1.0]), 0.0)
    seen = OrientedPoints(points, room.normals, room.polyline)
    assert_same_pose(align(seen, Target.of(room, P), se2.IDENTITY, P).pose, np.zeros(3), 0.003, 0.1)


def test_the_other_side_of_a_wall_does_not_pull() -> None:
    """A wall 0.2 m thick, seen from one side: its far side is nearer, and faces away."""
    near_side = surface_of(np.array([[0.0, 0, 6, 0], [6, 0, 6, 3]]))
    far_side = surface_of(np.array([[6.0, -0.2, 0, -0.2]]))
    target = Target.of(join_points([near_side, far_side]), P)
    fit = align(near_side, target, np.array([0.0, -0.18, 0.0]), P)
    np.testing.assert_allclose(fit.pose, 0, atol=2e-3)


def test_a_polyline_that_does_not_correspond_does_not_pull() -> None:
    """A decoy lies nearer than the true wall; the correspondence rules it out (paper, V)."""
    corner = np.array([[0.0, 0, 4, 0], [4, 0, 4, 3]])
    true = points_on_lines(line_map(corner), 0.1)[0]
    decoy = surface_of(np.array([[0.0, 0.25, 4, 0.25]]))
    decoy = OrientedPoints(decoy.points, decoy.normals, decoy.polyline + 1)
    target = Target.of(join_points([true, decoy]), P)
    start = np.array([0.0, 0.2, 0.0])
    misled = align(true, target, start, P).pose
    led = align(true, target, start, P, None, np.array([[True], [False]])).pose
    assert misled[1] > 0.24
    assert led[1] < 0.2 + 1e-6


def test_points_on_no_polyline_have_no_part_where_a_correspondence_is_given() -> None:
    corner = points_on_lines(line_map(np.array([[0.0, 0, 4, 0], [4, 0, 4, 3]])), 0.1)[0]
    stray = OrientedPoints(corner.points, corner.normals, np.full(len(corner), -1))
    target = Target.of(corner, P)
    start = np.array([0.0, 0.1, 0.0])
    fit = align(stray, target, start, P, None, np.array([[True]]))
    np.testing.assert_array_equal(fit.information, 0)
    np.testing.assert_array_equal(fit.pose, start)


def test_partners_are_the_nearest_in_place_and_normal(rng: Generator) -> None:
    moving = ROOMS.at(slice(None, None, 7)).moved(np.array([0.05, -0.02, 0.01]))
    distance, index = partners(moving, Target.of(ROOMS, P), 0.3)
    for k in rng.integers(0, len(moving), 40):
        place = ((ROOMS.points - moving.points[k]) ** 2).sum(axis=1)
        normal = ((ROOMS.normals - moving.normals[k]) ** 2).sum(axis=1)
        brute = np.sqrt(place + P.normal_weight**2 * normal)
        assert distance[k] == pytest.approx(brute.min())
        assert brute[index[k]] == pytest.approx(brute.min())


def test_what_is_out_of_reach_has_no_partner() -> None:
    room = surface_of(walls_of(rectangle(0, 0, 3, 3)))
    distance, index = partners(room.moved(np.array([50.0, 0, 0])), Target.of(room, P), 0.5)
    assert np.isinf(distance).all() and (index == len(room)).all()
