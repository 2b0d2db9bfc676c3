"""Grouping of segments into generalized polylines (paper, V)."""

import itertools

import numpy as np
import pytest
from numpy.typing import ArrayLike

from mapweave.errors import ArgumentError
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.lines.polylines import generalized_polylines, group_polylines

MAX_GAP = 0.6


def random_segments(seed: int, n: int, size: float) -> FloatArray:
    rng = np.random.default_rng(seed)
    start = rng.uniform(0, size, (n, 2))
    return np.hstack([start, start + rng.normal(0, 0.5, (n, 2))])


def chained_segments(vertices: FloatArray) -> FloatArray:
    return np.hstack([vertices[:-1], vertices[1:]])


def list_cost(segments: FloatArray, order: IntArray) -> float:
    """Return the summed distance of endpoints of the list; a cut one costs MAX_GAP."""
    gaps = np.hypot(*(segments[order[:-1], 2:] - segments[order[1:], :2]).T)
    return float(np.minimum(gaps, MAX_GAP).sum())


def as_polylines(order: IntArray, polyline: IntArray) -> list[tuple[int, ...]]:
    return [tuple(order[polyline == group].tolist()) for group in np.unique(polyline)]


@pytest.mark.parametrize("size", [1.5, 3.0])
@pytest.mark.parametrize("n", [2, 3, 4, 5, 6, 7])
def test_no_order_of_the_list_is_shorter(n: int, size: float) -> None:
    """Wherever following each end to its best start leads round no circle, brute force agrees."""
    permutations = np.array(list(itertools.permutations(range(n))))
    for seed in range(8):
        segments = random_segments(seed, n, size)
        ends, starts = segments[permutations, 2:], segments[permutations, :2]
        gaps = np.hypot(*np.moveaxis(ends[:, :-1] - starts[:, 1:], -1, 0))
        best = np.minimum(gaps, MAX_GAP).sum(axis=1).min()
        cost = list_cost(segments, group_polylines(segments, MAX_GAP)[0])
        assert cost >= best - 1e-9
        if not runs_in_a_circle(segments):
            assert cost == pytest.approx(best)


def runs_in_a_circle(segments: FloatArray) -> bool:
    """Return whether the cheapest set of links, by brute force, contains a circle."""
    n = len(segments)
    gaps = np.hypot(*np.moveaxis(segments[:, None, 2:] - segments[None, :, :2], -1, 0))
    np.fill_diagonal(gaps, MAX_GAP)
    best = np.array(
        min(
            itertools.permutations(range(n)),
            key=lambda p: float(np.minimum(gaps, MAX_GAP)[np.arange(n), p].sum()),
        )
    )
    linked = np.where(gaps[np.arange(n), best] < MAX_GAP, best, n)
    reached = np.append(linked, n)
    for _ in range(n):
        reached = np.append(linked, n)[reached]
    return bool((reached != n).any())


@pytest.mark.parametrize("n", [1, 30, 200])
def test_order_is_a_permutation_and_groups_ascend(n: int) -> None:
    segments = random_segments(1, n, np.sqrt(n))
    order, polyline = group_polylines(segments, MAX_GAP)
    np.testing.assert_array_equal(np.sort(order), np.arange(n))
    assert polyline[0] == 0
    assert set(np.diff(polyline)) <= {0, 1}


def test_no_segments_form_no_polylines() -> None:
    order, polyline = group_polylines(np.empty((0, 4)), MAX_GAP)
    assert len(order) == len(polyline) == 0


@pytest.mark.parametrize("seed", range(5))
def test_lists_split_exactly_where_the_gap_is_too_wide(seed: int) -> None:
    """Within a polyline no gap exceeds max_gap; no two polylines could be linked end to start."""
    segments = random_segments(seed, 60, 8.0)
    order, polyline = group_polylines(segments, MAX_GAP)
    listed = segments[order]
    gaps = np.hypot(*(listed[:-1, 2:] - listed[1:, :2]).T)
    assert (gaps[np.diff(polyline) == 0] <= MAX_GAP).all()
    tails = listed[np.append(np.diff(polyline) != 0, True)]
    heads = listed[np.insert(np.diff(polyline) != 0, 0, True)]
    across = np.hypot(*np.moveaxis(tails[:, None, 2:] - heads[None, :, :2], -1, 0))
    assert (across[~np.eye(len(tails), dtype=bool)] > MAX_GAP).all()


@pytest.mark.parametrize("seed", range(5))
def test_rigid_motion_changes_nothing(seed: int) -> None:
    segments = random_segments(seed, 40, 6.0)
    pose = np.random.default_rng(seed).uniform(-3, 3, 3)
    moved = se2.transform_segments(pose, segments)
    for ours, theirs in zip(
        group_polylines(segments, MAX_GAP), group_polylines(moved, MAX_GAP), strict=True
    ):
        np.testing.assert_array_equal(ours, theirs)


@pytest.mark.parametrize("seed", range(5))
def test_input_order_changes_only_the_order_of_the_polylines(seed: int) -> None:
    segments = random_segments(seed, 40, 6.0)
    shuffle = np.random.default_rng(seed).permutation(len(segments))
    order, polyline = group_polylines(segments[shuffle], MAX_GAP)
    straight = as_polylines(*group_polylines(segments, MAX_GAP))
    assert set(as_polylines(shuffle[order], polyline)) == set(straight)


def test_polylines_come_in_the_input_order_of_their_first_segments() -> None:
    segments = random_segments(3, 50, 8.0)
    heads = [polyline[0] for polyline in as_polylines(*group_polylines(segments, MAX_GAP))]
    assert heads == sorted(heads)


def test_touching_segments_form_one_polyline() -> None:
    """A gap of zero is a link like any other."""
    segments = chained_segments(np.array([[0.0, 0], [1, 0], [1, 1], [3, 1], [3, 4]]))
    assert as_polylines(*group_polylines(segments[[2, 0, 3, 1]], 0.0)) == [(1, 3, 0, 2)]


def test_closed_outline_opens_at_its_widest_gap() -> None:
    """A room seen from inside runs in a circle: all of it is one polyline, cut at the doorway."""
    corners = np.array([[0.0, 0], [0, 3], [-4, 3], [-4, 0.4]])
    segments = np.vstack([chained_segments(corners), [[-4, 0.3, -0.2, 0]]])
    assert as_polylines(*group_polylines(segments, MAX_GAP)) == [(0, 1, 2, 3)]


def test_both_faces_of_a_thin_wall_are_not_joined_at_both_ends() -> None:
    """Front and back of a partition form a circle of two; it opens at the wider end."""
    wall = np.array([[0.0, 0, 3, 0], [3, 0.1, 0, 0.2]])
    assert as_polylines(*group_polylines(wall, MAX_GAP)) == [(0, 1)]


def test_segments_are_never_reversed() -> None:
    """Two segments that meet head on, or leave one point, see opposite sides: no polyline."""
    head_on = np.array([[0.0, 0, 1, 0], [2.0, 0, 1, 0]])
    apart = np.array([[1.0, 0, 0, 0], [1.0, 0, 2, 0]])
    assert as_polylines(*group_polylines(head_on, MAX_GAP)) == [(0,), (1,)]
    assert as_polylines(*group_polylines(apart, MAX_GAP)) == [(0,), (1,)]


def test_a_segment_does_not_follow_itself() -> None:
    """One shorter than max_gap ends near its own start."""
    short = np.array([[0.0, 0, 0.1, 0], [0.5, 0, 0.6, 0]])
    assert as_polylines(*group_polylines(short, MAX_GAP)) == [(0, 1)]


def test_the_polylines_of_a_list_are_those_of_its_order() -> None:
    walls = [[9.0, 9, 9, 8], [0.0, 0, 2, 0], [2.0, 0.1, 2, 3]]
    found = generalized_polylines(walls)
    assert [polyline.tolist() for polyline in found] == [[walls[0]], walls[1:]]
    assert [len(polyline) for polyline in generalized_polylines(walls, 0.05)] == [1, 1, 1]
    assert generalized_polylines([]) == []


@pytest.mark.parametrize(
    ("segments", "max_gap", "argument"),
    [([[0, 0, 1]], 0.5, "segments"), ([[0, 0, 1, np.inf]], 0.5, "segments"), ([], 0.0, "max_gap")],
)
def test_what_cannot_be_grouped_is_refused_by_name(
    segments: ArrayLike, max_gap: float, argument: str
) -> None:
    with pytest.raises(ArgumentError, match=rf"^{argument}: expected"):
        generalized_polylines(segments, max_gap)
