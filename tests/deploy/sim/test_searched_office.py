"""Where the search of the built-in office goes on: through the door that nobody went through."""

import numpy as np
import pytest
import shapely

from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap
from mapweave.scan.coverage import coverage
from mapweave.scan.free_space import FreeSpaceParameters, rings, unite
from mapweave_deploy.sim.office import ROOMS, Room, office

KEPT = 0.15  # [m] that free space keeps from walls
DOORS = [room.door(*door) for room in ROOMS for door in room.doors]
WITH_ONE_DOOR = [
    room
    for room in ROOMS
    if room.doors and sum(door.intersects(room.inside) for door in DOORS) == 1
]
SEEDS = range(1, 4)


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
