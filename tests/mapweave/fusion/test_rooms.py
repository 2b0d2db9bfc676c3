"""Agreement about one room is one piece of evidence: the same room may exist twice."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapweave.fusion.align import FusionParameters, align, align_maps, prepare
from mapweave.fusion.rooms import outside
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave.reasons import ReasonKind
from tests.mapweave.buildings import BUILDING, line_map, part, shaken, walls_of

P = FusionParameters()


def room(width: float, depth: float, closet: float, door: float) -> FloatArray:
    """Return the outline [m] of a room with a closet in a corner and a door in its lower wall."""
    return np.array(
        [
            *[(0.0, 0.0), (door, 0.0), (door, -0.6), (door + 0.9, -0.6), (door + 0.9, 0.0)],
            *[(width, 0.0), (width, depth), (closet, depth), (closet, depth - 0.6)],
            (0.0, depth - 0.6),
        ]
    )


def inside(outline: FloatArray) -> LineMap:
    """Return what a robot knows that never left the room; the door is open, and dark."""
    seen = part(outline, -1.0, 100.0)
    threshold = (seen.segments[:, 1] < -0.5) & (seen.segments[:, 3] < -0.5)
    return line_map(seen.segments[~threshold], seen.free_space)


def driven(lines: LineMap, times: int) -> RobotMap:
    """Return the map of a robot that drove through the same place again and again."""
    submaps = [Submap(k, 0, np.zeros(3), lines, Trajectory.empty()) for k in range(times)]
    return RobotMap(f"r{times}", "boot", 1, tuple(submaps))


@pytest.mark.parametrize("times", [2, 5])
def test_a_metre_of_wall_is_a_metre_however_often_it_was_seen(times: int) -> None:
    left, right = part(BUILDING, 0, 18), part(BUILDING, 8, 30)
    once = align(driven(left, 1), driven(right, 1), P)[0].evidence
    often = align(driven(left, times), driven(right, times), P)[0].evidence
    assert often.common == pytest.approx(once.common, rel=0.03)
    assert often.held == pytest.approx(once.held, rel=0.05)


@settings(max_examples=15, deadline=None)
@given(
    st.floats(3.5, 7.0), st.floats(4.0, 8.0), st.floats(0.4, 1.5), st.floats(0.5, 2.0),
    st.integers(0, 99), st.sampled_from([1, 4]),
)  # fmt: skip
def test_two_equal_rooms_are_never_joined_and_never_sure(
    width: float, depth: float, closet: float, door: float, seed: int, times: int
) -> None:
    rng = np.random.default_rng(seed)
    lines = inside(room(width, depth, closet, door))
    there = shaken(lines, rng).moved(np.array([13.0, 4.0, math.pi]))
    found = align(driven(lines, times), driven(there, times), P)[0]
    assert found.decision != "accepted"
    assert found.confidence < 0.85


@pytest.mark.parametrize("spaceless", [(True, False), (False, True), (True, True)])
def test_a_room_whose_free_space_is_not_known_is_a_room_all_the_same(
    spaceless: tuple[bool, bool],
) -> None:
    lines = inside(room(5.0, 6.0, 1.5, 3.0))
    odd = line_map(np.vstack([lines.segments, [[0.0, 3.0, 2.0, 3.0]]]), lines.free_space)
    there = odd.moved(np.array([3.0, 1.0, 2.0]))
    one, two = (
        replace(known, free_space=()) if bare else known
        for known, bare in zip((odd, there), spaceless, strict=True)
    )
    found = align_maps(("a/0", one), ("b/0", two), P)
    assert found.decision == "ambiguous"
    assert found.confidence < 0.85


def test_walls_of_more_than_a_room_prove_a_place_without_free_space() -> None:
    left, right = part(BUILDING, 0, 18), part(BUILDING, 5, 30)
    bare = replace(left, free_space=()), replace(right, free_space=())
    one, two = (prepare(each, P) for each in bare)
    assert one is not None
    assert two is not None
    assert outside(one.raster, two.raster, se2.IDENTITY, P.verification, P.rooms) == math.inf


def test_a_room_that_nothing_else_fits_is_told_to_be_one_room() -> None:
    lines = inside(room(5.0, 6.0, 1.5, 3.0))
    odd = replace(lines, segments=np.vstack([lines.segments, [[0.0, 3.0, 2.0, 3.0]]]))
    odd = line_map(odd.segments, lines.free_space)
    found = align_maps(("a/0", odd), ("b/0", odd.moved(np.array([3.0, 1.0, 2.0]))), P)
    assert found.decision == "ambiguous"
    assert found.cause.kind is ReasonKind.ONE_ROOM


def test_the_corridor_outside_proves_the_room() -> None:
    found = align_maps(("a/0", part(BUILDING, 0, 16)), ("b/0", part(BUILDING, 9, 30)), P)
    assert found.decision == "accepted"


def test_what_lies_outside_is_counted_from_both_maps() -> None:
    lines = inside(room(5.0, 6.0, 1.5, 3.0))
    with_corridor = line_map(
        np.vstack([lines.segments, walls_of([(-6, -3), (11, -3), (11, -0.6), (-6, -0.6)])[[0, 1]]]),
        (*lines.free_space, np.array([(-6, -2.8), (10.8, -2.8), (10.8, -0.8), (-6, -0.8)])),
    )
    one, two = prepare(lines, P), prepare(with_corridor, P)
    assert one is not None
    assert two is not None
    asked = se2.IDENTITY, P.verification, P.rooms
    assert outside(one.raster, two.raster, *asked) < P.rooms.min_outside
    assert outside(two.raster, one.raster, *asked) < P.rooms.min_outside
    assert outside(two.raster, two.raster, *asked) > P.rooms.min_outside


def test_a_part_of_what_the_other_knows_to_be_a_corridor_is_no_room() -> None:
    hall, piece = prepare(part(BUILDING, 0, 30), P), prepare(part(BUILDING, 5, 12), P)
    assert hall is not None
    assert piece is not None
    asked = se2.IDENTITY, P.verification, P.rooms
    assert outside(piece.raster, piece.raster, *asked) < math.inf
    assert outside(hall.raster, piece.raster, *asked) == math.inf


def test_a_corridor_is_no_room_of_common_shape() -> None:
    hall = prepare(part(BUILDING, 0, 30), P)
    assert hall is not None
    assert outside(hall.raster, hall.raster, se2.IDENTITY, P.verification, P.rooms) == math.inf


def test_a_wall_that_is_drawn_once_counts_in_full_up_to_its_ends() -> None:
    wall = prepare(line_map(np.array([[0.0, 0.0, 6.0, 0.0]])), P)
    assert wall is not None
    assert wall.raster.weight.sum() == pytest.approx(6.0)
