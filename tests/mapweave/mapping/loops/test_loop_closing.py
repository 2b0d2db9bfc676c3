"""A robot that comes back finds its older submaps, where both saw the same; then its path fits."""

from collections.abc import Sequence

import numpy as np
import pytest
import shapely
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.loops.loop_closing import LoopCloser, LoopParameters
from mapweave.mapping.mapper import Mapper
from mapweave.maps import LineMap, Submap, Trajectory
from tests.mapweave.buildings import (
    AROUND,
    MARGIN,
    Niche,
    cast,
    clip,
    line_map,
    random_pose,
    rectangle,
    shaken,
    tour,
    walls_of,
)


def with_alcoves(corners: FloatArray, alcoves: Sequence[Sequence[Niche]]) -> FloatArray:
    """Return the outline of (k, 2) `corners` [m] with alcoves on the right of each of its sides."""
    points = []
    for start, end, niches in zip(corners, np.roll(corners, -1, axis=0), alcoves, strict=True):
        ahead = (end - start) / np.hypot(*(end - start))
        right = np.array([ahead[1], -ahead[0]])
        points.append(start)
        for low, high, deep in niches:
            near, far = start + low * ahead, start + high * ahead
            points += [near, near + deep * right, far + deep * right, far]
    return np.array(points)


# A corridor round a block; no two places in it look alike.
OUTSIDE = with_alcoves(
    rectangle(0, 0, 26, 18),
    [
        [(2, 3, 0.6), (6, 9, 1.4), (14, 15, 0.5), (20, 22.5, 1.0)],
        [(4, 7, 1.2), (10.5, 11.5, 0.7)],
        [(3, 4.2, 0.5), (8, 12, 1.5), (17, 18, 0.8), (22, 23, 0.4)],
        [(5, 6, 1.0), (9, 12.5, 0.6)],
    ],
)
BLOCK = with_alcoves(
    rectangle(2.5, 2.5, 23.5, 15.5)[::-1],
    [[(3, 5, 0.7), (12, 13, 0.4)], [(4, 5.5, 0.9)], [(6, 7, 0.6), (15, 16.2, 1.1)], [(8, 10, 0.5)]],
)
RING = np.vstack([walls_of(OUTSIDE), walls_of(BLOCK)])
FREE = shapely.Polygon(OUTSIDE).difference(shapely.Polygon(BLOCK)).buffer(-MARGIN)
LAP = [(1.2, 1.2), (24.8, 1.2), (24.8, 16.8), (1.2, 16.8), (1.2, 1.2)]
STRETCH = 28  # poses of a submap: some 11 m of path
BIAS = np.array([0.02, -0.02, 0.005])  # [m, m, rad] of the drift, each submap


def seen_from(path: FloatArray) -> LineMap:
    """Return what a robot knows of the ring that drove along (n, 3) `path`."""
    left, bottom = path[:, :2].min(axis=0) - 3
    right, top = path[:, :2].max(axis=0) + 3
    turned = [1, 0, 3, 2]
    across = [w for w in (clip(wall, left, right) for wall in RING) if w is not None]
    both = [w for w in (clip(wall[turned], bottom, top) for wall in across) if w is not None]
    free = shapely.get_parts(FREE.intersection(shapely.box(left, bottom, right, top)))
    rings = tuple(np.array(p.exterior.coords)[:-1] for p in free if p.area > 1)
    return line_map(np.array(both)[:, turned], rings)


def submap_along(number: int, path: FloatArray, lines: LineMap) -> Submap:
    """Return a submap made along (n, 3) `path`, at its true pose; `lines` are in the same frame."""
    local = se2.between(path[0], path)
    index = 100 * number + np.arange(len(path))
    trajectory = Trajectory(index, np.full(len(path), np.nan), local)
    return Submap(number, 0, path[0], lines.moved(se2.inverse(path[0])), trajectory)


def round_the_ring(count: int, rng: Generator) -> list[Submap]:
    """Return the first `count` submaps of a drive round and round, at their true poses."""
    lap = list(tour(LAP, 0.42))
    poses = np.array([*lap, *lap])
    paths = [poses[k * STRETCH : (k + 1) * STRETCH + 1] for k in range(count)]
    return [submap_along(k, path, shaken(seen_from(path), rng)) for k, path in enumerate(paths)]


def walk(
    true: Sequence[Submap], errors: FloatArray, parameters: LoopParameters | None = None
) -> list[Submap]:
    """Return the submaps as the mapper keeps them when each step between two errs by `errors`."""
    closer = LoopCloser(parameters or LoopParameters())
    known = [Submap(0, 0, true[0].pose, true[0].map, true[0].trajectory)]
    for last, new, error in zip(true[:-1], true[1:], errors, strict=True):
        step = se2.compose(se2.between(last.pose, new.pose), error)
        pose = se2.compose(known[-1].pose, step)
        known.append(Submap(new.id, new.component, pose, new.map, new.trajectory))
        closer.graph.track(known[-2], known[-1])
        known = closer.close(known)
    return known


def poses(submaps: Sequence[Submap]) -> FloatArray:
    return np.array([s.pose for s in submaps])


def dead_reckoning(true: Sequence[Submap], errors: FloatArray) -> FloatArray:
    """(n, 3) where tracking alone leaves the submaps."""
    found = [true[0].pose]
    for last, new, error in zip(true[:-1], true[1:], errors, strict=True):
        found.append(se2.compose(found[-1], se2.compose(se2.between(last.pose, new.pose), error)))
    return np.array(found)


def drift(count: int, rng: Generator) -> FloatArray:
    """(count - 1, 3) of errors, all with the same bias."""
    return BIAS + rng.normal(0, [0.01, 0.01, 0.001], (count - 1, 3))


def moved_by(off: FloatArray) -> float:
    """Return the farthest of (n, 3) differences [m]."""
    return float(np.hypot(*off[:, :2].T).max())


@pytest.mark.parametrize("seed", range(3))
def test_a_loop_round_a_building_is_closed_within_a_tenth_of_a_metre(seed: int) -> None:
    rng = np.random.default_rng(seed)
    true = round_the_ring(9, rng)
    errors = drift(9, rng)
    reckoned, found = dead_reckoning(true, errors), walk(true, errors)
    gap = se2.between(true[0].pose, true[7].pose)
    before = se2.between(gap, se2.between(reckoned[0], reckoned[7]))
    after = se2.between(gap, se2.between(found[0].pose, found[7].pose))
    assert np.hypot(*before[:2]) > 0.3
    assert np.hypot(*after[:2]) < 0.1
    assert np.degrees(abs(after[2])) < 1
    assert moved_by(poses(found) - poses(true)) < 0.5 * moved_by(reckoned - poses(true))


def test_the_first_submap_stays_where_it_is(rng: Generator) -> None:
    true = round_the_ring(8, rng)
    found = walk(true, drift(8, rng))
    np.testing.assert_allclose(found[0].pose, true[0].pose, atol=1e-3)


def test_only_poses_change(rng: Generator) -> None:
    true = round_the_ring(8, rng)
    for before, after in zip(true, walk(true, drift(8, rng)), strict=True):
        assert (after.id, after.component) == (before.id, before.component)
        assert after.map is before.map and after.trajectory is before.trajectory


def test_a_robot_that_was_nowhere_twice_moves_nothing(rng: Generator) -> None:
    """Without a closure the poses are those of tracking, to the bit."""
    true = round_the_ring(6, rng)
    errors = drift(6, rng)
    np.testing.assert_array_equal(poses(walk(true, errors)), dead_reckoning(true, errors))


def test_moving_the_first_pose_moves_the_result_and_no_more(rng: Generator) -> None:
    true = round_the_ring(8, rng)
    errors = drift(8, rng)
    motion = random_pose(rng)
    elsewhere = [Submap(s.id, 0, se2.compose(motion, s.pose), s.map, s.trajectory) for s in true]
    here, there = poses(walk(true, errors)), poses(walk(elsewhere, errors))
    np.testing.assert_allclose(se2.between(motion, there), here, atol=1e-3)


def test_the_same_submaps_give_the_same_poses_to_the_bit(rng: Generator) -> None:
    true = round_the_ring(8, rng)
    errors = drift(8, rng)
    np.testing.assert_array_equal(poses(walk(true, errors)), poses(walk(true, errors)))


ROOM = with_alcoves(rectangle(0, 0, 5, 4), [[(1, 2, 0.5)], [], [(0.5, 1.5, 0.8)], [(1.5, 2, 0.6)]])
OTHER_ROOM = with_alcoves(rectangle(0, 0, 4.2, 6), [[], [(3, 4.5, 0.9)], [(1, 3, 0.5)], []])
STRAIGHT = np.column_stack([np.linspace(1, 4, 7), np.full(7, 2.0), np.zeros(7)])
THERE_AND_BACK = np.array([STRAIGHT[k] for k in [*range(7), *range(5, -1, -1)] * 2])  # 12 m
NOWHERE = LineMap.empty()
# A long way, far from the rooms: a small error in its turns is a large one in where it ends.
ELSEWHERE = [(NOWHERE, 8.0, 40.0)] * 9
EXACT = 1e-12


def inside(outline: FloatArray) -> LineMap:
    """Return the map of a whole room."""
    free = np.array(shapely.Polygon(outline).buffer(-MARGIN).exterior.coords)[:-1]
    return line_map(walls_of(outline), (free,))


def visits(*rooms: tuple[LineMap, float, float]) -> list[Submap]:
    """Return a submap of 12 m of path for each room, each at x, y [m] of its own."""
    submaps = []
    for number, (lines, x, y) in enumerate(rooms):
        at = np.array([x, y, 0.0])
        path = se2.compose(at, THERE_AND_BACK)
        submaps.append(submap_along(number, path, lines.moved(at)))
    return submaps


def reached(true: Sequence[Submap], error: Sequence[float]) -> FloatArray:
    """(3,) by how much the last submap is off when only the last step erred, by `error`."""
    errors = np.zeros((len(true) - 1, 3))
    errors[-1] = error
    return np.asarray(walk(true, errors)[-1].pose - true[-1].pose)


def test_a_room_seen_again_within_the_drift_is_found() -> None:
    again = visits((inside(ROOM), 0, 0), *ELSEWHERE, (inside(ROOM), 0, 0))
    assert np.hypot(*reached(again, [0.3, -0.3, 0.03])[:2]) < 0.15


def test_a_room_that_looks_alike_beyond_the_drift_is_not_taken_for_it() -> None:
    """The same room 4 m farther: the shapes agree in all, but a path of 120 m errs by less."""
    twin = visits((inside(ROOM), 0, 0), *ELSEWHERE, (inside(ROOM), 4, 0))
    np.testing.assert_allclose(reached(twin, [0.1, 0.1, 0]), [0.1, 0.1, 0], atol=EXACT)


def test_another_room_in_the_same_place_is_not_taken_for_it() -> None:
    other = visits((inside(ROOM), 0, 0), (NOWHERE, 8, 0), (inside(OTHER_ROOM), 0, 0))
    np.testing.assert_allclose(reached(other, [0.1, 0.1, 0]), [0.1, 0.1, 0], atol=EXACT)


def test_rooms_side_by_side_have_no_wall_in_common() -> None:
    """The wall between them has two sides, and no one sees both."""
    neighbour = visits((inside(ROOM), 0, 0), (NOWHERE, 9, 0), (inside(OTHER_ROOM), 5.2, 0))
    np.testing.assert_allclose(reached(neighbour, [0.1, 0.1, 0]), [0.1, 0.1, 0], atol=EXACT)


def test_the_submap_just_before_is_no_loop() -> None:
    """Tracking says more of two in a row than their shapes do."""
    twice = visits((inside(ROOM), 0, 0), (inside(ROOM), 0, 0))
    np.testing.assert_allclose(reached(twice, [0.3, -0.3, 0]), [0.3, -0.3, 0], atol=EXACT)


def test_a_submap_of_another_component_is_left_to_fusion() -> None:
    true = visits((inside(ROOM), 0, 0), (NOWHERE, 8, 0), (inside(ROOM), 0, 0))
    first, second, third = true
    apart = Submap(2, 1, np.array([0.3, -0.3, 0]), third.map, third.trajectory)
    closer = LoopCloser(LoopParameters())
    closer.graph.track(first, second)
    assert closer.close([first, second, apart]) == [first, second, apart]


@pytest.mark.parametrize("closed", [False, True])
def test_a_closure_shortens_the_path_that_may_have_drifted(closed: bool) -> None:
    """After 120 m a room is looked for within 2.4 m; just after a closure only within 0.6 m."""
    way_back = inside(ROOM) if closed else NOWHERE
    true = visits(
        (inside(ROOM), 0, 0),
        (inside(OTHER_ROOM), 8, 0),
        *ELSEWHERE,
        (way_back, 0, 0),
        (inside(OTHER_ROOM), 8, 0),
    )
    off = float(np.hypot(*reached(true, [1.1, 0, 0])[:2]))
    assert off > 1 if closed else off < 0.3


def corridor_again() -> tuple[list[Submap], FloatArray]:
    """Return a bare corridor driven twice, and by how much the second time was misplaced.

    No end was seen; it is 2 mm wider at one, so that the shapes do not leave all places equal.
    """
    free = rectangle(0, MARGIN, 20, 2.2 - MARGIN)
    bare = line_map(np.array([[0, 0, 20, 0], [20, 2.2, 0, 2.202]]), (free,))
    true = visits((bare, 0, -1), *[(NOWHERE, 8, -1)] * 9, (bare, 0, -1))
    errors = np.zeros((len(true) - 1, 3))
    errors[-1] = [0.25, 0.1, 0.02]
    return true, errors


def test_a_bare_corridor_proves_no_loop() -> None:
    true, errors = corridor_again()
    np.testing.assert_array_equal(poses(walk(true, errors)), dead_reckoning(true, errors))


def test_what_a_corridor_leaves_open_a_closure_leaves_to_tracking() -> None:
    """If it did count as a loop, it would say where across and which way, not how far along."""
    true, errors = corridor_again()
    lax = LoopParameters(min_held=1e-9, max_rival=1.0)
    off = walk(true, errors, lax)[-1].pose - true[-1].pose
    middle = off[1] + 10 * off[2]  # across, 10 m along it
    assert abs(middle) < 0.25 * (0.1 + 10 * 0.02)
    assert abs(off[2]) < 0.005
    assert off[0] == pytest.approx(0.25, abs=0.05)


def test_where_components_were_joined_gives_way_before_tracking_does() -> None:
    """A robot that was lost and found again closes loops over the join, which is less sure."""
    first, second, third = visits((inside(ROOM), 0, 0), (NOWHERE, 1, 0), (inside(ROOM), 0, 0))
    error = np.array([0.15, 0.1, 0.01])
    last = Submap(2, 0, se2.compose(third.pose, error), third.map, third.trajectory)
    closer = LoopCloser(LoopParameters())
    closer.graph.join(first, second)
    closer.graph.track(second, last)
    given = poses(closer.close([first, second, last])) - poses([first, second, last])
    left = error[:2] + given[2, :2]
    assert np.hypot(*left) < 0.6 * np.hypot(*error[:2])
    assert np.hypot(*given[1, :2]) > 2 * np.hypot(*(given[2] - given[1])[:2])


@pytest.mark.slow
def test_a_robot_that_drives_round_a_building_ends_where_it_is(rng: Generator) -> None:
    """The whole mapper, from scans of 8 m range: a lap and 10 m more."""
    lap = list(tour(LAP, 0.35))
    true = np.array([*lap, *lap[:30]])
    mapper = Mapper("a")
    for k, pose in enumerate(true):
        mapper.add(cast(RING, pose, index=k, angles=AROUND[45:316:2], noise=rng, max_range=8.0))
    found = mapper.finish()
    assert found.components == [0]
    last = found.submaps[-1]
    end = se2.compose(last.pose, last.trajectory.pose[-1])
    assert np.hypot(*(end - se2.between(true[0], true[-1]))[:2]) < 0.1
