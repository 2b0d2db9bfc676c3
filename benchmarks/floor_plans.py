"""Floor plans made up: rooms along a corridor, and what a robot's map of a part of one is.

There is no laser in it: maps are cut out of the plan, with noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from numpy.random import Generator

from mapweave.geometry.arrays import FloatArray
from mapweave.lines.polylines import group_polylines
from mapweave.maps import LineMap

WIDTH, WALL, DOOR = 2.2, 0.2, 0.9  # [m] of a corridor, of walls, of doors
MARGIN, NOISE = 0.15, 0.015  # [m] that free space keeps from walls; of wall ends


@dataclass(frozen=True, slots=True)
class Room:
    """A room along the corridor, from `left` to `right` [m], and what stands in it.

    Attributes
    ----------
    door
        Its left side [m].
    depth
        [m]
    furniture
        Left, bottom, right, top, from the room's left corner at the corridor [m].
    """

    left: float
    right: float
    door: float
    depth: float
    furniture: tuple[tuple[float, float, float, float], ...]

    def shifted(self, by: float) -> "Room":
        """Return the same room elsewhere."""
        return Room(self.left + by, self.right + by, self.door + by, self.depth, self.furniture)


def room_at(rng: Generator, left: float) -> Room:
    """Return a room made up, with its left side at `left` [m]."""
    width, depth = rng.uniform(3.2, 6.0), rng.uniform(3.5, 6.5)
    door = left + rng.uniform(0.3, width - DOOR - 0.3)
    things = []
    for _ in range(rng.integers(0, 4)):
        x, y = rng.uniform(0.2, width - 1.6), rng.uniform(1.0, depth - 1.2)
        things.append((x, y, x + rng.uniform(0.5, 1.4), y + rng.uniform(0.4, 0.9)))
    return Room(left, left + width, door, depth, tuple(things))


def row_of_rooms(rng: Generator, count: int, left: float = 1.0) -> list[Room]:
    """Return rooms made up, one beside the other, from `left` [m] on."""
    rooms: list[Room] = []
    for _ in range(count):
        rooms.append(room_at(rng, left))
        left = rooms[-1].right + WALL + rng.uniform(0.0, 1.5)
    return rooms


def plan_of(rooms: Sequence[Room]) -> shapely.Polygon:
    """Return what is free: a corridor, rooms below it behind doors, and nothing in furniture."""
    parts = [shapely.box(-1.0, 0.0, rooms[-1].right + 2.0, WIDTH)]
    for room in rooms:
        parts.append(shapely.box(room.left, -WALL - room.depth, room.right, -WALL))
        parts.append(shapely.box(room.door, -WALL - 0.01, room.door + DOOR, 0.01))
    things = [
        shapely.box(room.left + a, -WALL - d, room.left + c, -WALL - b)
        for room in rooms
        for a, b, c, d in room.furniture
    ]
    free = shapely.union_all(parts).difference(shapely.union_all(things))
    return max(shapely.get_parts(free), key=lambda part: part.area)


def seen_in(plan: shapely.Polygon, where: shapely.Polygon, rng: Generator) -> LineMap:
    """Return the walls of `plan` within a box, with noise, and the free space seen there."""
    walls = np.concatenate([_walls(ring, where) for ring in _rings(plan)])
    walls = walls[np.hypot(*(walls[:, 2:] - walls[:, :2]).T) > 0.1]
    walls = walls + rng.normal(0.0, NOISE, walls.shape)
    free = shapely.get_parts(plan.buffer(-MARGIN).intersection(where))
    rings = tuple(np.asarray(f.exterior.coords)[:-1] for f in free if f.geom_type == "Polygon")
    order, polyline = group_polylines(walls, 0.3)
    return LineMap(walls[order], polyline, np.full(len(walls), 5), rings)


def _rings(plan: shapely.Polygon) -> list[FloatArray]:
    """Return the outlines, with what is free on their left."""
    plan = shapely.geometry.polygon.orient(plan)
    return [np.asarray(ring.coords) for ring in (plan.exterior, *plan.interiors)]


def _walls(ring: FloatArray, where: shapely.Polygon) -> FloatArray:
    """(n, 4) walls of an outline, as far as they are in a box."""
    pieces = [shapely.LineString(pair).intersection(where) for pair in pairwise(ring)]
    lines = [np.asarray(piece.coords).ravel() for piece in pieces if piece.length > 0]
    return np.array(lines).reshape(-1, 4)
