"""Maps nearly the same, and bare, tell a kind of place; odd things and doors tell which one."""

import numpy as np
import pytest

from mapweave.fusion.align import FusionParameters, align_maps, prepare
from mapweave.fusion.wings import told_by_kind
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment, LineMap
from mapweave.matching.crossings import crossed
from mapweave.matching.hypotheses import PreparedMap
from mapweave.reasons import ReasonKind
from tests.mapweave.buildings import BUILDING, Niche, corridor, line_map, part, shaken, walls_of

P = FusionParameters()
WHOLE = part(BUILDING, -1, 31)
THING = walls_of([(9.0, 0.8), (9.4, 1.5), (10.1, 1.1), (9.7, 0.4)])  # stands at odd angles


def with_walls(lines: LineMap, walls: FloatArray) -> LineMap:
    return line_map(np.vstack([lines.segments, walls]), lines.free_space)


def seen_twice(one: LineMap, other: LineMap) -> Alignment:
    rng = np.random.default_rng(4)
    motion = np.array([7.0, -3.0, 2.0])
    return align_maps(("a/0", shaken(one, rng)), ("b/0", shaken(other, rng).moved(motion)), P)


def test_two_maps_of_a_bare_wing_may_be_of_two_wings() -> None:
    found = seen_twice(WHOLE, WHOLE)
    assert found.decision == "ambiguous"
    assert found.cause.kind is ReasonKind.ONE_KIND
    assert found.confidence <= P.wings.unique


def test_what_stands_at_odd_angles_in_both_tells_that_it_is_one_wing() -> None:
    found = seen_twice(with_walls(WHOLE, THING), with_walls(WHOLE, THING))
    assert found.decision == "accepted"


def test_what_stands_at_odd_angles_in_one_of_them_tells_nothing() -> None:
    assert seen_twice(with_walls(WHOLE, THING), WHOLE).cause.kind is ReasonKind.ONE_KIND


def test_maps_that_go_on_beyond_what_they_share_are_of_one_place() -> None:
    assert seen_twice(part(BUILDING, 0, 18), part(BUILDING, 8, 30)).decision == "accepted"


def prepared(lines: LineMap) -> PreparedMap:
    found = prepare(lines, P)
    assert found is not None
    return found


def metres_crossed(one: LineMap, other: LineMap) -> float:
    asked = se2.IDENTITY, P.verification, P.wings.crossings
    return crossed(prepared(one).raster, prepared(other).raster, *asked)


def rooms(door: float, low: float = -1.0, high: float = 17.0) -> LineMap:
    """Return a corridor from `low` to `high` with a room whose door, 0.9 m wide, is at `door`."""
    niche: Niche = (door, door + 0.9, 0.2)
    outline = corridor(16.0, [niche], [(3.0, 5.0, 2.0), (10.0, 14.0, 3.0)])
    at = int(np.flatnonzero((outline == (door, -0.2)).all(axis=1))[0])
    room = [(door, -0.2), (4.0, -0.2), (4.0, -4.2), (10.0, -4.2), (10.0, -0.2), (door + 0.9, -0.2)]
    return part(np.vstack([outline[:at], room, outline[at + 2 :]]), low, high)


def test_a_door_that_the_other_map_has_as_a_wall_is_crossed_from_both_sides() -> None:
    assert metres_crossed(rooms(5.0), rooms(5.0)) == 0.0
    found = metres_crossed(rooms(5.0), rooms(7.5))
    assert P.wings.crossings.door < found < 2 * (2 * 0.9 + 0.4)


@pytest.mark.parametrize("off", [0.15, 0.25])
def test_a_wall_that_is_a_little_off_crosses_nothing(off: float) -> None:
    moved = WHOLE.moved(np.array([0.0, off, 0.0]))
    assert metres_crossed(WHOLE, moved) < P.wings.crossings.door


def test_a_box_that_was_moved_crosses_nothing() -> None:
    box = walls_of([(9.0, 0.8), (9.0, 1.4), (9.6, 1.4), (9.6, 0.8)])
    assert metres_crossed(with_walls(WHOLE, box), WHOLE) == pytest.approx(0.0)


def test_bare_wings_of_which_a_door_is_elsewhere_are_of_one_kind() -> None:
    here, there = rooms(5.0, 0.0, 13.0), rooms(7.5, 3.0, 16.0)
    assert seen_twice(here, rooms(5.0, 3.0, 16.0)).decision == "accepted"
    assert seen_twice(here, there).cause.kind is ReasonKind.ONE_KIND


def told_at_a_place(here: LineMap, there: LineMap, dissimilar: float) -> bool:
    parameters = P.wings.model_copy(update={"dissimilar": dissimilar})
    one, other = (prepared(with_walls(lines, THING)) for lines in (here, there))
    return told_by_kind(one, other, se2.IDENTITY, P.verification, parameters, rigid=False)


def test_bent_maps_are_dissimilar_where_much_wall_lies_across_passages_odd_things_or_not() -> None:
    here, there = rooms(5.0, 0.0, 13.0), rooms(7.5, 3.0, 16.0)
    assert told_at_a_place(here, there, 0.02)  # some 44 m are in common
    assert not told_at_a_place(here, there, 0.08)
    assert not told_at_a_place(here, rooms(5.0, 3.0, 16.0), 0.02)
