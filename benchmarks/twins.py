"""Twins: simulated buildings where rooms or wings exist twice, same or mirrored; what is joined.

Maps are cut out of a floor plan, with noise, and moved at random; there is no laser in it.
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from numpy.random import Generator

from benchmarks.ablation import WITHOUT, Aligning, aligning_without, parameters_without
from benchmarks.floor_plans import DOOR, WALL, Room, plan_of, room_at, row_of_rooms, seen_in
from benchmarks.pairs import is_right
from benchmarks.tables import OUTPUT, format_table, write_json
from mapweave.commands.progress import track
from mapweave.fusion.align import FusionParameters
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment, RobotMap, Submap, Trajectory

SURE = 0.85
VISITS = (1, 10)


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
    parser.add_argument("--first", type=int, default=0, metavar="K", help="the first of them (0)")
    parser.add_argument("--without", choices=WITHOUT, help="leave out, as of fusion")
    parser.add_argument("--output", type=Path, default=OUTPUT / "twins.json", help="%(default)s")


def run(options: argparse.Namespace) -> None:
    """Compare the maps of every scene of every building, print how often what was decided."""
    parameters = parameters_without(options.without)
    aligning = aligning_without(options.without)
    rows = [
        _row(name, visits, seed, make(np.random.default_rng(seed), visits), parameters, aligning)
        for seed in track(range(options.first, options.first + options.seeds), "buildings")
        for name, make in SCENES.items()
        for visits in VISITS
    ]
    write_json(options.output, rows)
    print(tell(rows))


def _row(
    name: str,
    visits: int,
    seed: int,
    scene: Scene,
    parameters: FusionParameters,
    aligning: Aligning,
) -> dict[str, object]:
    found = max(aligning(scene.first, scene.second, parameters), key=lambda a: a.confidence)
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
    wing = row_of_rooms(rng, 3)
    length = wing[-1].right + 1.0
    rooms = [*wing, *(r.shifted(length + 6.0) for r in wing)]
    one, two = (shapely.box(x, -20, x + length, 20) for x in (0.0, length + 6.0))
    return _scene(rng, rooms, one, two, visits, shared=False)


def _mirrored_wings(rng: Generator, visits: int) -> Scene:
    """Each knows one of two stretches that are mirror images of each other."""
    wing = row_of_rooms(rng, 3)
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


def _with_twin(rng: Generator) -> tuple[tuple[Room, Room], list[Room]]:
    """Return two equal rooms, and those with the others: before, between and behind them."""
    before = row_of_rooms(rng, 1)
    twin = room_at(rng, before[-1].right + WALL)
    between = row_of_rooms(rng, 2, twin.right + WALL)
    again = twin.shifted(between[-1].right + WALL - twin.left)
    behind = row_of_rooms(rng, 1, again.right + WALL)
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
    plan = plan_of(rooms)
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
        Submap(k, 0, np.zeros(3), seen_in(plan, where, rng).moved(motion), Trajectory.empty())
        for k in range(visits)
    )
    return RobotMap(robot, "boot", 1, submaps)
