"""The built-in office: a building of 30 × 20 m with a ring of corridors, rooms and clutter.

The plan is fixed; the seed moves doors, furniture and what stands in the corridors. Look-alike
offices are there on purpose: a joint map of this building must not mistake one for another.
"""

from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.random import Generator
from shapely.geometry.base import BaseGeometry

from mapweave.geometry.arrays import FloatArray
from mapweave_deploy.sim.world import World, box, disc, make_world

DOOR_WIDTH = 1.0
WALL = 0.15  # inside walls [m]
DOOR_CLEARANCE = 0.8  # kept free around doors [m]
WALKWAY = 0.75  # kept free between pieces of furniture [m]


@dataclass(frozen=True, slots=True)
class Room:
    """A room by its kind, its inside ``x1 y1 x2 y2`` [m] and its doors.

    A door is a side (n, e, s or w) and how far along it the door is, from 0 to 1.
    """

    kind: str
    x1: float
    y1: float
    x2: float
    y2: float
    doors: tuple[tuple[str, float], ...]

    @property
    def inside(self) -> shapely.Polygon:
        """The room's free space, unfurnished."""
        return shapely.box(self.x1, self.y1, self.x2, self.y2)

    def door(self, side: str, along: float) -> shapely.Polygon:
        """Return the hole a door makes in the wall."""
        x = self.x1 + along * (self.x2 - self.x1)
        y = self.y1 + along * (self.y2 - self.y1)
        reach = 2 * WALL + 0.02  # through the wall, a little into the room on either side
        if side in "ns":
            return box(x, (self.y2 if side == "n" else self.y1), DOOR_WIDTH, reach)
        return box((self.x2 if side == "e" else self.x1), y, reach, DOOR_WIDTH)

    def leaf(self, side: str, along: float) -> tuple[float, float, float, float]:
        """Return its leaf, shut: hinge x, y and other end x, y [m]; it opens into the room."""
        west, south, east, north = self.door(side, along).bounds
        x, y = (west + east) / 2, (south + north) / 2
        return {
            "n": (east, y, west, y),
            "s": (west, y, east, y),
            "e": (x, south, x, north),
            "w": (x, north, x, south),
        }[side]


CORRIDORS = (
    Room("corridor", 0.30, 6.20, 29.70, 8.20, ()),
    Room("corridor", 21.00, 8.20, 22.60, 15.40, ()),
    Room("corridor", 6.00, 13.80, 22.60, 15.40, ()),
    Room("corridor", 6.00, 8.20, 7.70, 15.40, ()),
)
ROOMS = (
    Room("office", 0.30, 0.30, 3.60, 6.05, (("n", 0.72),)),
    Room("office", 3.75, 0.30, 7.05, 6.05, (("n", 0.28),)),
    Room("office", 7.20, 0.30, 10.50, 6.05, (("n", 0.72),)),
    Room("seminar", 10.65, 0.30, 15.20, 6.05, (("n", 0.20), ("e", 0.35))),
    Room("office", 15.35, 0.30, 18.65, 6.05, (("n", 0.50),)),
    Room("office", 18.80, 0.30, 22.10, 6.05, (("n", 0.28),)),
    Room("kitchen", 22.25, 0.30, 29.70, 6.05, (("n", 0.55),)),
    Room("lab", 0.30, 8.35, 5.85, 19.70, (("s", 0.40), ("e", 0.55))),
    Room("office", 6.00, 15.55, 9.30, 19.70, (("s", 0.72),)),
    Room("office", 9.45, 15.55, 12.75, 19.70, (("s", 0.28),)),
    Room("seminar", 12.90, 15.55, 18.00, 19.70, (("s", 0.25),)),
    Room("office", 18.15, 15.55, 21.45, 19.70, (("s", 0.50),)),
    Room("store", 21.60, 15.55, 24.90, 19.70, (("s", 0.16), ("e", 0.40))),
    Room("office", 25.05, 15.55, 29.70, 19.70, (("s", 0.65),)),
    Room("lab", 22.75, 8.35, 29.70, 15.40, (("w", 0.30), ("s", 0.60))),
    Room("store", 7.85, 8.35, 10.20, 13.65, (("s", 0.50),)),
    Room("seminar", 10.35, 8.35, 15.90, 13.65, (("n", 0.30),)),
    Room("kitchen", 16.05, 8.35, 20.85, 13.65, (("s", 0.75), ("e", 0.60))),
)
# Windows and a glass partition, set into their walls: little light comes back.
GLASS = shapely.union_all(
    [
        shapely.box(24.0, 0.22, 27.5, 0.30),
        shapely.box(0.22, 11.0, 0.30, 14.5),
        shapely.box(12.0, 13.73, 14.0, 13.80),
    ]
)


def office(seed: int, visit: int | None = None) -> World:
    """Return the office, furnished by `seed`; on another `visit`, what can be moved was moved."""
    rng = np.random.default_rng(seed)
    shifted = [_shift_doors(room, rng) for room in ROOMS]
    doors = shapely.union_all([room.door(*door) for room in shifted for door in room.doors])
    rooms = shapely.union_all([room.inside for room in (*CORRIDORS, *shifted)])
    keep_free = doors.buffer(DOOR_CLEARANCE, join_style="mitre")
    furniture: list[BaseGeometry] = []
    for number, room in enumerate((*CORRIDORS, *shifted)):
        moving = rng if visit is None else np.random.default_rng([seed, visit, number])
        furniture += _furnish(room, keep_free, rng, moving, moves_last=visit is not None)
    free = shapely.union_all([rooms, doors, GLASS]).difference(shapely.union_all(furniture))
    world = make_world("office", free, GLASS, _stops(shifted))
    return replace(world, doors=np.array([r.leaf(*door) for r in shifted for door in r.doors]))


def _shift_doors(room: Room, rng: Generator) -> Room:
    doors = tuple((side, along + rng.uniform(-0.04, 0.04)) for side, along in room.doors)
    return Room(room.kind, room.x1, room.y1, room.x2, room.y2, doors)


def _stops(rooms: list[Room]) -> FloatArray:
    """Return the middle of every room and the crossings of the corridors."""
    middles = [((room.x1 + room.x2) / 2, (room.y1 + room.y2) / 2) for room in rooms]
    crossings = [(1.5, 7.2), (6.8, 7.2), (14.0, 7.2), (21.8, 7.2), (28.5, 7.2), (6.8, 14.6)]
    return np.array([*middles, *crossings, (14.5, 14.6), (21.8, 14.6)])


# What stands in each kind of room: (piece, how many), the large ones first.
FURNITURE = {
    "office": (("desk", 2), ("cabinet", 2), ("chair", 2), ("bin", 1)),
    "seminar": (("table", 1), ("cabinet", 1), ("chair", 5), ("bin", 1)),
    "kitchen": (("counter", 1), ("table", 2), ("cabinet", 1), ("chair", 5), ("bin", 1)),
    "lab": (("pillar", 2), ("bench", 3), ("cabinet", 3), ("desk", 2), ("chair", 3), ("bin", 2)),
    "store": (("cabinet", 4), ("crate", 3)),
    "corridor": (("cabinet", 2), ("bin", 2)),
}
# Width along the wall and depth [m]; a depth of 0 means round.
SIZES = {
    "desk": (1.6, 0.8), "cabinet": (0.9, 0.45), "counter": (2.6, 0.6), "bin": (0.15, 0.0),
    "chair": (0.18, 0.0), "table": (1.6, 0.8), "bench": (2.2, 0.75), "pillar": (0.4, 0.4),
    "crate": (0.6, 0.5),
}  # fmt: skip
MOVABLE = {"chair", "table", "crate", "bin"}
FREE_STANDING = {"chair", "table", "pillar", "crate"}


def _furnish(
    room: Room, keep_free: BaseGeometry, rng: Generator, moving: Generator, *, moves_last: bool
) -> list[BaseGeometry]:
    """Return the solid parts of the furniture of `room`, clear of doors and of each other.

    Parameters
    ----------
    rng, moving
        Of what stays where it is, and of what can be moved.
    moves_last
        Whether what can be moved is put between all that stays.
    """
    placed: list[BaseGeometry] = []
    solid: list[BaseGeometry] = []
    pieces = FURNITURE[room.kind]
    for piece, count in sorted(pieces, key=lambda p: p[0] in MOVABLE) if moves_last else pieces:
        for _ in range(count):
            drawn = moving if piece in MOVABLE else rng
            footprint, parts = _try_place(piece, room, [keep_free, *placed], drawn)
            if footprint is not None:
                placed.append(footprint.buffer(WALKWAY, join_style="mitre"))
                solid += parts
    return solid


def _try_place(
    piece: str, room: Room, taken: list[BaseGeometry], rng: Generator
) -> tuple[BaseGeometry | None, list[BaseGeometry]]:
    """Return a footprint for `piece` that meets nothing in `taken`, and its solid parts."""
    for _ in range(25):
        x, y, turn = _position(piece, room, rng)
        footprint = _footprint(piece, x, y, turn)
        if not any(footprint.intersects(other) for other in taken):
            return footprint, _solid_parts(piece, footprint, x, y, turn)
    return None, []


def _position(piece: str, room: Room, rng: Generator) -> tuple[float, float, float]:
    """Return a place and turn for `piece`: in the room, or with its back to a wall."""
    width, depth = SIZES[piece]
    if piece in FREE_STANDING:
        margin = WALKWAY + width / 2
        x = rng.uniform(*_span(room.x1 + margin, room.x2 - margin))
        y = rng.uniform(*_span(room.y1 + margin, room.y2 - margin))
        return x, y, rng.uniform(-0.2, 0.2)
    back = (depth or 2 * width) / 2 + 0.03
    side = int(rng.integers(4))
    along = rng.uniform(0.0, 1.0)
    x = room.x1 + width / 2 + 0.05 + along * (room.x2 - room.x1 - width - 0.1)
    y = room.y1 + width / 2 + 0.05 + along * (room.y2 - room.y1 - width - 0.1)
    return [
        (x, room.y1 + back, 0.0),
        (room.x2 - back, y, np.pi / 2),
        (x, room.y2 - back, np.pi),
        (room.x1 + back, y, -np.pi / 2),
    ][side]


def _span(low: float, high: float) -> tuple[float, float]:
    """Return the interval, or its middle where the room is too narrow for it."""
    return (low, high) if low < high else ((low + high) / 2, (low + high) / 2)


def _footprint(piece: str, x: float, y: float, turn: float) -> shapely.Polygon:
    width, depth = SIZES[piece]
    return box(x, y, width, depth, turn) if depth else disc(x, y, width)


def _solid_parts(
    piece: str, footprint: shapely.Polygon, x: float, y: float, turn: float
) -> list[BaseGeometry]:
    """Return what a lidar at 0.4 m sees of `piece`: of tables legs, of desks drawers too."""
    if piece not in ("desk", "table"):
        return [footprint]
    width, depth = SIZES[piece]
    c, s = np.cos(turn), np.sin(turn)
    legs: list[BaseGeometry] = []
    for along, across in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
        u, v = along * (width / 2 - 0.05), across * (depth / 2 - 0.05)
        legs.append(box(x + c * u - s * v, y + s * u + c * v, 0.06, 0.06, turn))
    if piece == "desk":
        shift = width / 2 - 0.25
        legs.append(box(x + c * shift, y + s * shift, 0.42, 0.7, turn))
    return legs
