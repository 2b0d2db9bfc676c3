"""The links between submaps: which count, how far a closure reaches, what it costs."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.loops.pose_graph import Constraint
from mapweave.mapping.loops.submap_graph import CLOSURE_LENGTH, SubmapGraph, SubmapGraphParameters
from mapweave.maps import LineMap, Submap, Trajectory

SURE = np.diag([0.02, 0.02, 0.003]) ** 2
PATH = 10.0  # [m] of each submap


def submap(number: int, pose: FloatArray) -> Submap:
    path = np.array([[0.0, 0, 0], [PATH, 0, 0]])
    trajectory = Trajectory(np.array([2 * number, 2 * number + 1]), np.full(2, np.nan), path)
    return Submap(number, 0, pose, LineMap.empty(), trajectory)


def circle(count: int, round_trip: int) -> FloatArray:
    """(count, 3) poses round and round a circle, `round_trip` of them a lap."""
    angle = 2 * np.pi * np.arange(count) / round_trip
    radius = PATH * round_trip / (2 * np.pi)
    heading = angle + np.pi / 2
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), se2.wrap(heading)])


def chain(poses: FloatArray, parameters: SubmapGraphParameters) -> tuple[SubmapGraph, list[Submap]]:
    """Return submaps at `poses`, each tracked from the one before."""
    graph = SubmapGraph(parameters)
    submaps = [submap(k, pose) for k, pose in enumerate(poses)]
    for previous, following in pairwise(submaps):
        graph.track(previous, following)
    return graph, submaps


def closure(
    first: int, second: int, poses: FloatArray, error: FloatArray | float = 0.0
) -> Constraint:
    return Constraint(first, second, se2.between(poses[first], poses[second]) + error, SURE, False)


def positions(submaps: list[Submap]) -> FloatArray:
    return np.array([s.pose for s in submaps])


def test_a_submap_is_known_by_the_path_to_it() -> None:
    graph, _ = chain(circle(6, 100), SubmapGraphParameters())
    np.testing.assert_allclose(graph.lengths_from(5, 6), [50, 40, 30, 20, 10, 0])


def test_submaps_that_are_elsewhere_hang_on_each_other_alone() -> None:
    poses = circle(6, 100)
    graph, submaps = chain(poses, SubmapGraphParameters())
    graph.close(submaps, [closure(0, 5, poses)])
    left = graph.part(submaps, 4)
    assert [s.id for s in left] == [0, 1, 2, 3]
    assert [graph.neighbours(k) for k in (0, 3, 4, 5)] == [[1], [2], [5], [4]]
    np.testing.assert_array_equal(graph.lengths_from(3, 6)[4:], np.inf)


def test_a_closure_that_is_relied_on_shortens_the_path() -> None:
    poses = circle(6, 6)
    graph, submaps = chain(poses, SubmapGraphParameters())
    graph.close(submaps, [closure(0, 5, poses)])
    assert graph.lengths_from(5, 6)[0] == CLOSURE_LENGTH
    assert graph.neighbours(5) == [0, 4]


def test_a_closure_that_is_not_relied_on_counts_nowhere() -> None:
    """It neither moves a submap, nor shortens a path, nor makes neighbours."""
    poses = circle(6, 6)
    graph, submaps = chain(poses, SubmapGraphParameters())
    after = graph.close(submaps, [closure(0, 5, poses, np.array([4.0, -3.0, 0.5]))])
    np.testing.assert_allclose(positions(after), poses, atol=0.02)
    np.testing.assert_allclose(graph.lengths_from(5, 6), [50, 40, 30, 20, 10, 0])
    assert graph.neighbours(5) == [4]


def test_of_two_links_between_the_same_submaps_the_shorter_counts() -> None:
    poses = circle(3, 100)
    graph, submaps = chain(poses, SubmapGraphParameters())
    graph.join(submaps[0], submaps[2])
    graph.close(submaps, [closure(0, 2, poses)])
    assert graph.lengths_from(2, 3)[0] == CLOSURE_LENGTH


def test_without_a_closure_nothing_moves() -> None:
    graph, submaps = chain(circle(5, 100), SubmapGraphParameters())
    assert graph.close(submaps, []) == submaps


@pytest.mark.parametrize("reach", [8, 1000])
def test_a_closure_of_a_short_loop_moves_only_what_is_near(reach: int) -> None:
    """Lap by lap the graph grows, and what many links away is stays to the bit."""
    parameters = SubmapGraphParameters(reach=reach, long_loop=30)
    poses = circle(60, 10)
    graph, submaps = chain(poses[:50], parameters)
    for k in range(50, 60):
        submaps.append(submap(k, poses[k]))
        graph.track(submaps[-2], submaps[-1])
        error = np.array([0.05, 0, 0])
        before = positions(submaps)
        submaps = graph.close(submaps, [closure(k - 10, k, poses, error)])
        moved = (positions(submaps) != before).any(axis=1)
        assert moved.any()
        assert moved.sum() <= reach


def test_a_long_loop_is_closed_all_the_way_round() -> None:
    """Then every submap gives a little, however few a closure moves otherwise."""
    true = circle(41, 40)
    steps = se2.between(true[:-1], true[1:]) + np.array([0.01, 0.01, 0.0005])
    drifted = [true[0]]
    for step in steps:
        drifted.append(se2.compose(drifted[-1], step))
    graph, submaps = chain(np.array(drifted), SubmapGraphParameters(reach=5, long_loop=30))
    found = graph.close(submaps, [closure(0, 40, true)])
    gap = se2.between(positions(found)[0], positions(found)[40])
    assert np.hypot(*(gap - se2.between(true[0], true[40]))[:2]) < 0.1
    assert graph.neighbours(40) == [0, 39]


def tracked_along_a_corridor(least: float) -> FloatArray:
    """Return by how much each submap gives (4,) [m] when a closure asks for 0.4 m along x.

    Scans of the second submap were held to `least` [m] along the corridor, all others to 0.02 m.
    """
    poses = np.array([[PATH * k, 0, 0] for k in range(5)])
    graph = SubmapGraph(SubmapGraphParameters())
    submaps = []
    for k, pose in enumerate(poses):
        plain = submap(k, pose)
        along = least if k == 1 else 0.02
        held = np.tile([along, 0.02, 0.005, 0.0], (2, 1))
        submaps.append(replace(plain, trajectory=replace(plain.trajectory, uncertainty=held)))
    for previous, following in pairwise(submaps):
        graph.track(previous, following)
    found = graph.close(submaps, [closure(0, 4, poses, np.array([0.4, 0, 0]))])
    return np.asarray(np.diff(positions(found)[:, 0]) - PATH)


def test_where_scans_were_held_worst_a_path_gives_most() -> None:
    """Along a corridor tracking is loose, and an error at its end is most likely made in it."""
    even, loose = tracked_along_a_corridor(0.02), tracked_along_a_corridor(0.2)
    assert np.ptp(even) < 0.01
    assert loose[1] > 5 * loose[[0, 2, 3]].max()
