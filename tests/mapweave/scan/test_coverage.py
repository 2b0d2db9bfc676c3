"""What was searched, and where it goes on."""

import numpy as np
import pytest
import shapely

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap
from mapweave.scan.coverage import CoverageParameters, coverage

KEPT = 0.15  # [m] that free space keeps from walls


def line_map(walls: list[list[float]], *free: list[list[float]]) -> LineMap:
    segments = np.array(walls, dtype=float).reshape(-1, 4)
    rings = tuple(np.array(ring, dtype=float) for ring in free)
    return LineMap(
        segments, np.arange(len(segments)), np.ones(len(segments), dtype=np.int64), rings
    )


def room(*, door: float) -> LineMap:
    """Return a room of 6 m by 4 m with a door in its right wall, about y = 2; 0 m for none."""
    low, high = 2 - door / 2, 2 + door / 2
    right = [[6.0, 0.0, 6.0, low], [6.0, high, 6.0, 4.0]] if door else [[6.0, 0.0, 6.0, 4.0]]
    walls = [[0.0, 0.0, 6.0, 0.0], *right, [6.0, 4.0, 0.0, 4.0], [0.0, 4.0, 0.0, 0.0]]
    inside = [[KEPT, KEPT], [6 - KEPT, KEPT], [6 - KEPT, 4 - KEPT], [KEPT, 4 - KEPT]]
    return line_map(walls, inside)


def length(line: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def test_a_closed_room_goes_on_nowhere() -> None:
    searched = coverage(room(door=0.0))
    assert searched.explored == pytest.approx((6 - 2 * KEPT) * (4 - 2 * KEPT))
    assert searched.frontiers == ()


def test_a_door_that_nobody_went_through_is_the_one_frontier() -> None:
    (frontier,) = coverage(room(door=1.2)).frontiers
    assert frontier[:, 0] == pytest.approx(6 - KEPT)
    assert frontier[:, 1].mean() == pytest.approx(2.0)
    assert 0.5 <= length(frontier) <= 1.2


@pytest.mark.parametrize("door", [0.85, 1.0])
def test_a_door_of_the_usual_width_is_one_as_well(door: float) -> None:
    (frontier,) = coverage(room(door=door)).frontiers
    assert frontier[:, 1].mean() == pytest.approx(2.0)


def test_what_stands_in_a_room_and_is_too_small_for_walls_is_no_way_on() -> None:
    """A hole in free space, of which nothing was made but returns."""
    outside = [[0.0, 0.0], [6.0, 0.0], [6.0, 4.0], [0.0, 4.0]]
    for size, ways in ((0.15, 0), (0.5, 0), (1.0, 1)):
        low, high = 2.0, 2.0 + size
        halves = [
            [*outside[:2], [6.0, high], [high, high], [high, low], [low, low], [0.0, low]],
            [[0.0, low], [low, low], [low, high], [6.0, high], *outside[2:]],
        ]
        walls = [
            [0.0, 0.0, 6.0, 0.0],
            [6.0, 0.0, 6.0, 4.0],
            [6.0, 4.0, 0.0, 4.0],
            [0.0, 4.0, 0.0, 0.0],
        ]
        assert len(coverage(line_map(walls, *halves)).frontiers) == ways


@pytest.mark.parametrize(("width", "ways"), [(0.5, 0), (1.0, 2)])
def test_the_shadow_of_a_thing_leads_on_only_where_a_robot_fits_into_it(
    width: float, ways: int
) -> None:
    """Of a thing in a room, seen from one side: its two edges lead on, or none of them."""
    low, high = 2 - width / 2, 2 + width / 2
    walls = [[0.0, 0.0, 6.0, 0.0], [6.0, 0.0, 6.0, 4.0], [6.0, 4.0, 0.0, 4.0], [0.0, 4.0, 0.0, 0.0]]
    thing, right = [3.0, low, 3.0, high], 6 - KEPT
    seen = [[KEPT, KEPT], [right, KEPT], [right, low], [3.0, low]]
    seen += [[3.0, high], [right, high], [right, 4 - KEPT], [KEPT, 4 - KEPT]]
    assert len(coverage(line_map([*walls, thing], seen)).frontiers) == ways


def test_a_gap_that_is_too_narrow_for_a_robot_is_none() -> None:
    assert coverage(room(door=0.4)).frontiers == ()


def test_of_several_the_widest_comes_first() -> None:
    free = [[0.0, 0.0], [5.0, 0.0], [5.0, 1.0], [0.0, 1.0]]
    walls = [[0.0, -0.1, 5.0, -0.1], [5.0, 1.1, 3.0, 1.1]]
    lengths = [length(line) for line in coverage(line_map(walls, free)).frontiers]
    assert len(lengths) >= 1
    assert lengths == sorted(lengths, reverse=True)


def test_what_is_searched_does_not_depend_on_the_frame() -> None:
    there = room(door=1.2)
    moved = there.moved(np.array([30.0, -7.0, 0.7]))
    (frontier,), (expected,) = coverage(moved).frontiers, coverage(there).frontiers
    back = se2.transform_points(se2.inverse(np.array([30.0, -7.0, 0.7])), frontier)
    assert length(frontier) == pytest.approx(length(expected), abs=0.02)
    assert back.mean(axis=0) == pytest.approx(expected.mean(axis=0), abs=0.05)


@pytest.mark.parametrize("free", [[], [[[0.0, 0.0], [1.0, 0.0]]]])
def test_where_nothing_was_seen_to_be_free_nothing_is_searched(
    free: list[list[list[float]]],
) -> None:
    searched = coverage(line_map([[0.0, 0.0, 1.0, 0.0]], *free))
    assert (searched.explored, searched.frontiers) == (0.0, ())


def test_without_walls_all_of_the_outline_is_a_frontier() -> None:
    square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]
    assert sum(length(line) for line in coverage(line_map([], square)).frontiers) == 8.0


def test_an_outline_that_is_said_to_go_round_the_earth_takes_no_more_memory() -> None:
    far = 1e7  # [m]
    square = [[0.0, 0.0], [far, 0.0], [far, far], [0.0, far]]
    assert sum(length(line) for line in coverage(line_map([], square)).frontiers) == 4 * far


def test_frontiers_are_what_is_left_beyond_the_reach_of_all_walls() -> None:
    """As areas tell: walls made as wide as they reach, cut out of the outline."""
    random = np.random.default_rng(0)
    for _ in range(20):
        starts = random.uniform(0, 10, (12, 2))
        walls = np.hstack([starts, starts + random.normal(0, 1.5, (12, 2))])
        angle = np.sort(random.uniform(0, 2 * np.pi, 7))
        ring = 5 + 4 * np.column_stack([np.cos(angle), np.sin(angle)])
        every = CoverageParameters(min_width=1e-3)
        found = coverage(line_map(walls.tolist(), ring.tolist()), every)
        lines = shapely.linestrings(walls.reshape(-1, 2, 2))
        wide = shapely.union_all(shapely.buffer(lines, every.reach, quad_segs=200))
        open_ends = shapely.difference(shapely.boundary(shapely.Polygon(ring)), wide)
        assert sum(map(length, found.frontiers)) == pytest.approx(open_ends.length, abs=0.02)
        for frontier in found.frontiers:
            assert shapely.covers(shapely.buffer(open_ends, 0.01), shapely.LineString(frontier))
