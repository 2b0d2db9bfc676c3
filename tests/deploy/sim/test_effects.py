"""Glass, mirrors, doors and floors against closed forms."""

import numpy as np
import pytest
import shapely
from numpy.random import Generator

from mapweave.geometry.arrays import FloatArray
from mapweave_deploy.sim.effects.doors import DoorParameters, doors_at
from mapweave_deploy.sim.effects.panes import look
from mapweave_deploy.sim.effects.rays import cast_rays
from mapweave_deploy.sim.effects.terrain import EYE, Ramp, Terrain, sill
from mapweave_deploy.sim.office import office
from mapweave_deploy.sim.trajectories import Tour
from mapweave_deploy.sim.world import line_segments

NONE = np.empty((0, 4))
ROOM = line_segments(shapely.orient_polygons(shapely.box(0, 0, 10, 6)).boundary)
MIRROR = np.array([[8.0, 5.9, 2.0, 5.9]])  # on the wall at y = 6; seen from below
PANE = np.array([[6.0, 0.0, 6.0, 6.0]])  # seen from x < 6
HERE = np.array([4.0, 2.5])


@pytest.fixture
def rng() -> Generator:
    return np.random.default_rng(1)


def test_glass_is_seen_square_on_and_seen_through_aslant(rng: Generator) -> None:
    square = look(ROOM, PANE, NONE, HERE, np.zeros(50), rng)
    np.testing.assert_allclose(square.range, 2.0)
    aslant = look(ROOM, PANE, NONE, HERE, np.full(2000, np.radians(15)), rng).range
    behind = aslant > 4.0
    np.testing.assert_allclose(aslant[behind], 6 / np.cos(np.radians(15)))
    np.testing.assert_allclose(aslant[~behind], 2 / np.cos(np.radians(15)))
    assert 0.9 < behind.mean() < 1.0


def test_a_mirror_shows_the_room_behind_itself(rng: Generator) -> None:
    """The way to a mirror and on from there is that to the room's picture beyond it."""
    directions = np.radians(np.arange(45.0, 135.0, 3.7))
    seen = look(ROOM, NONE, MIRROR, HERE, directions, rng)
    picture = line_segments(shapely.orient_polygons(shapely.box(0, 5.9, 10, 11.8)).boundary)
    beyond = cast_rays(picture, HERE, directions).range
    at_mirror = HERE[0] + (5.9 - HERE[1]) / np.tan(directions)
    shown = (at_mirror > 2) & (at_mirror < 8)
    assert 5 < shown.sum() < len(shown)
    np.testing.assert_allclose(seen.range[shown], beyond[shown])
    plain = cast_rays(ROOM, HERE, directions).range
    np.testing.assert_allclose(seen.range[~shown], plain[~shown])


def test_a_mirror_shows_nothing_that_is_behind_it(rng: Generator) -> None:
    wall = np.array([[4.5, 6.5, 3.5, 6.5]])  # behind the mirror
    seen = look(np.vstack([ROOM, wall]), NONE, MIRROR, HERE, np.array([np.pi / 2]), rng)
    np.testing.assert_allclose(seen.range, 3.4 + 5.9)


@pytest.mark.parametrize("away", [0.5, 1.0, 2.0])
def test_a_robot_before_a_ramp_sees_it_where_it_is_as_high_as_its_eye(away: float) -> None:
    floor = Terrain((Ramp((5.0, 0.0), (9.0, 0.0), 0.8),))
    pose = np.array([5.0 - away, 1.0, 0.0])
    (ahead, behind, aside) = floor.floor_ranges(pose, np.array([0.0, np.pi, np.pi / 2]), 30.0)
    assert ahead == pytest.approx(away + EYE / 0.2, abs=0.1)
    assert behind == aside == np.inf


def test_a_robot_on_a_ramp_looks_along_it_and_down_at_the_floor_before_it() -> None:
    floor = Terrain((Ramp((5.0, 0.0), (9.0, 0.0), 0.8),))
    down = np.array([6.0, 0.0, np.pi])
    (ahead, behind) = floor.floor_ranges(down, np.array([np.pi, 0.0]), 30.0)
    assert ahead == pytest.approx(1.0 + EYE / 0.2, abs=0.1)
    assert behind == np.inf  # over the head of the ramp


def test_a_robot_whose_wheels_are_on_a_sill_sees_the_floor_on_the_other_side() -> None:
    floor = Terrain(sill(3.0, 0.0, 0.0, height=0.03))
    front = np.array([3.0 - 0.15, 0.0, 0.0])  # its front wheels are on top
    (ahead, behind) = floor.floor_ranges(front, np.array([0.0, np.pi]), 30.0)
    assert ahead == np.inf
    assert behind == pytest.approx(EYE / 0.1, abs=0.1)


def test_a_level_floor_is_never_seen(rng: Generator) -> None:
    assert Terrain().is_level
    flat = Terrain((Ramp((5.0, 0.0), (9.0, 0.0), 0.0),))
    pose = np.array([*rng.uniform(0, 12, 2), 0.3])
    assert np.isinf(flat.floor_ranges(pose, np.linspace(-3, 3, 50), 30.0)).all()


def standing(x: float, y: float, seconds: float = 300.0) -> Tour:
    stamp = np.arange(0.0, seconds, 0.25)
    return Tour(stamp, np.tile([x, y, 0.0], (len(stamp), 1)))


def leaf_turns(faces: list[FloatArray], door: int) -> FloatArray:
    """Return (m,) which way the longest face of a door's leaf runs at each scan [°], 0 to 180."""
    leaves = np.array([each[4 * door : 4 * door + 4] for each in faces])
    along = leaves[..., 2:] - leaves[..., :2]
    longest = np.argmax(np.hypot(*along.transpose(2, 0, 1))[0])
    turns: FloatArray = np.degrees(np.arctan2(along[:, longest, 1], along[:, longest, 0])) % 180
    return turns


def test_doors_open_and_shut_and_are_open_where_a_robot_is(rng: Generator) -> None:
    world = office(3)
    middle = (world.doors[:, :2] + world.doors[:, 2:]) / 2
    faces = doors_at(world, standing(*middle[4]), DoorParameters(opened=0.5), rng)
    turned = [len(np.unique(leaf_turns(faces, k).round())) for k in range(len(world.doors))]
    assert turned[4] == 1  # a robot stands in it
    assert np.mean(np.array(turned) == 2) > 0.9


def test_a_leaf_fills_its_door_when_shut_and_leaves_it_free_when_open(rng: Generator) -> None:
    world = office(3)
    for opened, free in ((0.0, False), (1.0, True)):
        faces = doors_at(world, standing(-50, -50, 1.0), DoorParameters(opened=opened), rng)[0]
        for door, leaf in zip(world.doors, faces.reshape(-1, 4, 4), strict=True):
            middle, along = (door[:2] + door[2:]) / 2, door[2:] - door[:2]
            across = np.array([-along[1], along[0]])
            through = shapely.LineString([middle - 0.5 * across, middle + 0.5 * across])
            met = shapely.LineString(leaf.reshape(-1, 2)).intersects(through)
            assert met != free


def test_on_another_visit_only_what_can_be_moved_was_moved() -> None:
    first, second, again = office(3, 0), office(3, 1), office(3, 0)
    assert shapely.equals(first.free, again.free)
    differs = first.free.symmetric_difference(second.free)
    pieces = [p for p in shapely.get_parts(differs) if p.area > 1e-6]
    assert len(pieces) > 20
    widest = max(np.hypot(*(np.subtract(p.bounds[2:], p.bounds[:2]))) for p in pieces)
    assert widest < 1.2  # a crate, a chair, a leg of a table: no cabinet, and no wall
    np.testing.assert_array_equal(first.doors, second.doors)
