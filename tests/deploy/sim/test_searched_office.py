"""Where the search of the built-in office goes on: through the door that nobody went through."""

import numpy as np
import pytest
import shapely

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.mapper import Mapper
from mapweave.maps import LineMap
from mapweave.scan.coverage import coverage
from mapweave.scan.free_space import FreeSpaceParameters, rings, unite
from mapweave.scan.scan import Scan
from mapweave_deploy.sim.office import ROOMS, Room, office
from mapweave_deploy.sim.sweeps import SweepParameters, sweeps
from mapweave_deploy.sim.trajectories import TourParameters, tour_through
from mapweave_deploy.sim.world import World

KEPT = 0.15  # [m] that free space keeps from walls
DOORS = [room.door(*door) for room in ROOMS for door in room.doors]
WITH_ONE_DOOR = [
    room
    for room in ROOMS
    if room.doors and sum(door.intersects(room.inside) for door in DOORS) == 1
]
SEEDS = range(1, 4)
ROUNDS = 4  # of driving where the search goes on


def searched(seed: int, *left_out: Room) -> list[FloatArray]:
    """Return the frontiers where all was seen but the inside of some rooms."""
    world = office(seed)
    unseen = shapely.union_all([room.inside for room in left_out])
    middles = (world.walls[:, :2] + world.walls[:, 2:]) / 2
    seen = ~shapely.contains_xy(unseen.buffer(0.01), *middles.T)
    free = rings(world.free.buffer(-KEPT).difference(unseen))
    outlined = rings(unite(free, FreeSpaceParameters()))
    walls = world.walls[seen]
    count = len(walls)
    lines = LineMap(walls, np.arange(count), np.ones(count, dtype=np.int64), outlined)
    return list(coverage(lines).frontiers)


@pytest.mark.parametrize("seed", SEEDS)
def test_where_all_rooms_were_visited_the_search_goes_on_nowhere(seed: int) -> None:
    assert searched(seed) == []


@pytest.mark.parametrize("seed", SEEDS)
def test_one_door_that_was_left_out_is_the_one_frontier(seed: int) -> None:
    for room in WITH_ONE_DOOR:
        (frontier,) = searched(seed, room)
        [(side, _)] = room.doors
        x, y = frontier.mean(axis=0)
        along = x if side in "ns" else y
        first, last = (room.x1, room.x2) if side in "ns" else (room.y1, room.y2)
        wall = {"n": room.y2, "s": room.y1, "e": room.x2, "w": room.x1}[side]
        assert abs((y if side in "ns" else x) - wall) < 0.3
        assert first < along < last


def left(world: World, stops: FloatArray) -> list[FloatArray]:
    """Return the frontiers over 0.5 m, in the world's frame, of a drive to (k, 2) `stops` [m]."""
    tour = tour_through(world, stops, TourParameters())
    p = SweepParameters()
    readings = sweeps(world, tour, p, np.random.default_rng(1), np.random.default_rng(2))
    mapper = Mapper("r1")
    for index, (ranges, stamp) in enumerate(zip(readings, tour.stamp, strict=True)):
        usable = ranges < p.lidar.maximum_range
        mapper.add(Scan(np.where(usable, ranges, np.inf), p.lidar.angles, index, float(stamp)))
    [first, *_] = (found := mapper.finish()).submaps
    start = se2.compose(first.pose, first.trajectory.pose[0])
    to_world = se2.compose(tour.pose[0], se2.inverse(start))
    frontiers = coverage(found.lines(0)).frontiers
    placed = [se2.transform_points(to_world, frontier) for frontier in frontiers]
    return [frontier for frontier in placed if length(frontier) > 0.5]


def length(line: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def nearest_first(stops: FloatArray) -> FloatArray:
    """Return (k, 2) `stops` in an order to drive them: from each to the nearest that is left."""
    order = [0]
    while len(order) < len(stops):
        away = np.linalg.norm(stops - stops[order[-1]], axis=1)
        away[order] = np.inf
        order.append(int(np.argmin(away)))
    return stops[order]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_a_robot_that_drives_where_the_search_goes_on_leaves_nothing(seed: int) -> None:
    """Windows among it: of a pane little comes back, but some does."""
    world = office(seed)
    stops = nearest_first(world.stops)
    for _ in range(ROUNDS):
        found = left(world, stops)
        if not found:
            break
        to_see = [frontier.mean(axis=0) for frontier in found]
        stops = np.vstack([stops, nearest_first(np.array([stops[-1], *to_see]))])
    assert found == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_the_search_goes_on_most_where_a_robot_drove_past_a_room(seed: int) -> None:
    """Of the room it saw what can be seen through the door."""
    world = office(seed)
    room = WITH_ONE_DOOR[3]
    elsewhere = ~shapely.contains_xy(room.inside, *world.stops.T)
    [longest, *_] = left(world, nearest_first(world.stops[elsewhere]))
    assert shapely.contains(room.inside.buffer(0.5), shapely.LineString(longest))
