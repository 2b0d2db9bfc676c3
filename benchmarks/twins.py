"""Twins: simulated buildings where rooms or wings exist twice, same or mirrored; what is joined.

Maps are cut out of a floor plan, with noise, and moved at random; there is no laser in it.
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import shapely
from numpy.random import Generator

from benchmarks.pairs import is_right
from benchmarks.tables import OUTPUT, format_table, write_json
from mapweave.commands.progress import track
from mapweave.fusion.align import FusionParameters, align
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.lines.polylines import group_polylines
from mapweave.maps import Alignment, LineMap, RobotMap, Submap, Trajectory

WIDTH, WALL, DOOR = 2.2, 0.2, 0.9  # [m] of a corridor, of walls, of doors
MARGIN, NOISE = 0.15, 0.015  # [m] that free space keeps from walls; of wall ends
SURE = 0.85
VISITS = (1, 10)


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


@dataclass(frozen=True, slots=True)
class Scene:
    """Two robots' maps of a building, and what is known of them.

    Attributes
    ----------
    transform
        (3,) from the second map to the first one; None where they share no place.
    """

    first: RobotMap
    second: RobotMap
    transform: FloatArray | None


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say how many buildings."""
    parser.add_argument("--seeds", type=int, default=50, metavar="N", help="buildings (50)")
    parser.add_argument("--output", type=Path, default=OUTPUT / "twins.json", help="%(default)s")


def run(options: argparse.Namespace) -> None:
    """Compare the maps of every scene of every building, print how often what was decided."""
    rows = [
        _row(name, visits, seed, make(np.random.default_rng(seed), visits))
        for seed in track(range(options.seeds), "buildings")
        for name, make in SCENES.items()
        for visits in VISITS
    ]
    write_json(options.output, rows)
    print(tell(rows))


def _row(name: str, visits: int, seed: int, scene: Scene) -> dict[str, object]:
    found = max(align(scene.first, scene.second, _PARAMETERS), key=lambda a: a.confidence)
    joined = found.decision == "accepted"
    right = joined and _right(found, scene)
    return {
        "scene": name,
        "visits": visits,
        "seed": seed,
        "decision": found.decision,
        "right": right,
        "wrong": joined and not right,
        "sure": found.confidence > SURE,
        "confidence": found.confidence,
        "reason": found.reason,
    }


def _right(found: Alignment, scene: Scene) -> bool:
    true = scene.transform
    if true is None:
        return False
    middle = scene.second.lines(0).segments.reshape(-1, 2).mean(axis=0)
    apart = se2.transform_points(found.transform, middle) - se2.transform_points(true, middle)
    turn = float(np.abs(se2.wrap(found.transform[2] - true[2])))
    return is_right(float(np.hypot(*apart)), turn)


def tell(rows: Sequence[dict[str, object]]) -> str:
    """Return a line for each kind of scene."""
    head = ["scene", "visits", "scenes", "joined right", "joined wrong", f"over {SURE:.0%}"]
    kinds = sorted({(str(row["scene"]), int(str(row["visits"]))) for row in rows})
    return format_table(head, [_tell_kind(*kind, rows) for kind in kinds])


def _tell_kind(name: str, visits: int, rows: Sequence[dict[str, object]]) -> list[str]:
    those = [row for row in rows if (row["scene"], row["visits"]) == (name, visits)]
    counts = [sum(bool(row[key]) for row in those) for key in ("right", "wrong", "sure")]
    return [name, str(visits), str(len(those)), *map(str, counts)]


def _twin_rooms(rng: Generator, visits: int) -> Scene:
    """Each robot knows one of two equal rooms, and nothing else."""
    room, rooms = _with_twin(rng)
    one, two = (_behind(r.left, r.right) for r in room)
    return _scene(rng, rooms, one, two, visits, shared=False)


def _twin_rooms_apart(rng: Generator, visits: int) -> Scene:
    """Each knows one of them and the corridor before it: two different places."""
    room, rooms = _with_twin(rng)
    one, two = (_behind(r.left, r.right).union(_along(r.left - 4, r.right + 4)) for r in room)
    return _scene(rng, rooms, one, two, visits, shared=False)


def _twin_rooms_and_between(rng: Generator, visits: int) -> Scene:
    """Each knows one of them and all that lies between them: they are to be joined."""
    (a, b), rooms = _with_twin(rng)
    one = _behind(a.left, b.left - WALL).union(_along(a.left - 4, b.left))
    two = _behind(a.right + WALL, b.right).union(_along(a.right, b.right + 4))
    return _scene(rng, rooms, one, two, visits, shared=True)


def _twin_wings(rng: Generator, visits: int) -> Scene:
    """Each knows one of two equal stretches of corridor with their rooms."""
    wing = _row_of_rooms(rng, 3)
    length = wing[-1].right + 1.0
    rooms = [*wing, *(r.shifted(length + 6.0) for r in wing)]
    one, two = (shapely.box(x, -20, x + length, 20) for x in (0.0, length + 6.0))
    return _scene(rng, rooms, one, two, visits, shared=False)


def _mirrored_wings(rng: Generator, visits: int) -> Scene:
    """Each knows one of two stretches that are mirror images of each other."""
    wing = _row_of_rooms(rng, 3)
    length = wing[-1].right + 1.0
    rooms = [*wing, *(_mirrored(r, length + 3.0) for r in reversed(wing))]
    one, two = (shapely.box(x, -20, x + length, 20) for x in (0.0, length + 6.0))
    return _scene(rng, rooms, one, two, visits, shared=False)


SCENES: dict[str, Callable[[Generator, int], Scene]] = {
    "twin rooms, nothing else known": _twin_rooms,
    "twin rooms, their corridors known": _twin_rooms_apart,
    "twin rooms, all between them known": _twin_rooms_and_between,
    "twin wings": _twin_wings,
    "mirrored wings": _mirrored_wings,
}
_PARAMETERS = FusionParameters()


def _room(rng: Generator, left: float) -> Room:
    width, depth = rng.uniform(3.2, 6.0), rng.uniform(3.5, 6.5)
    door = left + rng.uniform(0.3, width - DOOR - 0.3)
    things = []
    for _ in range(rng.integers(0, 4)):
        x, y = rng.uniform(0.2, width - 1.6), rng.uniform(1.0, depth - 1.2)
        things.append((x, y, x + rng.uniform(0.5, 1.4), y + rng.uniform(0.4, 0.9)))
    return Room(left, left + width, door, depth, tuple(things))


def _row_of_rooms(rng: Generator, count: int, left: float = 1.0) -> list[Room]:
    rooms: list[Room] = []
    for _ in range(count):
        rooms.append(_room(rng, left))
        left = rooms[-1].right + WALL + rng.uniform(0.0, 1.5)
    return rooms


def _with_twin(rng: Generator) -> tuple[tuple[Room, Room], list[Room]]:
    """Return two equal rooms, and those with the others: before, between and behind them."""
    before = _row_of_rooms(rng, 1)
    twin = _room(rng, before[-1].right + WALL)
    between = _row_of_rooms(rng, 2, twin.right + WALL)
    again = twin.shifted(between[-1].right + WALL - twin.left)
    behind = _row_of_rooms(rng, 1, again.right + WALL)
    return (twin, again), [*before, twin, *between, again, *behind]


def _behind(left: float, right: float) -> shapely.Polygon:
    """Return where rooms are, from `left` to `right` [m]."""
    return shapely.box(left - WALL / 2, -20, right + WALL / 2, -WALL / 2)


def _along(left: float, right: float) -> shapely.Polygon:
    """Return where the corridor is, from `left` to `right` [m]."""
    return shapely.box(left, -WALL / 2, right, 20)


def _mirrored(room: Room, about: float) -> Room:
    """Return the mirror image of a room, about a line across the corridor at `about` [m]."""
    width = room.right - room.left
    things = tuple((width - r, b, width - left, t) for left, b, r, t in room.furniture)
    left, right = 2 * about - room.right, 2 * about - room.left
    return Room(left, right, 2 * about - room.door - DOOR, room.depth, things)


def _plan(rooms: Sequence[Room]) -> shapely.Polygon:
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


def _scene(
    rng: Generator,
    rooms: Sequence[Room],
    one: shapely.Polygon,
    two: shapely.Polygon,
    visits: int,
    *,
    shared: bool,
) -> Scene:
    """Cut two maps out of a plan, the second one in a frame of its own."""
    plan = _plan(rooms)
    motion = np.array([*rng.uniform(-30, 30, 2), rng.uniform(-np.pi, np.pi)])
    first = _driven("a", plan, one, rng, visits, se2.IDENTITY)
    second = _driven("b", plan, two, rng, visits, motion)
    return Scene(first, second, se2.inverse(motion) if shared else None)


def _driven(
    robot: str,
    plan: shapely.Polygon,
    where: shapely.Polygon,
    rng: Generator,
    visits: int,
    motion: FloatArray,
) -> RobotMap:
    """Return the map of a robot that was there `visits` times."""
    submaps = tuple(
        Submap(k, 0, np.zeros(3), _seen(plan, where, rng).moved(motion), Trajectory.empty())
        for k in range(visits)
    )
    return RobotMap(robot, "boot", 1, submaps)


def _seen(plan: shapely.Polygon, where: shapely.Polygon, rng: Generator) -> LineMap:
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
