"""Signatures: what is told of a submap, and in how many bytes."""

import numpy as np
import shapely

from benchmarks.floor_plans import plan_of, row_of_rooms, seen_in
from benchmarks.signatures import MOST, PER_METRE, coded_walls, words_of, words_size
from mapweave.geometry.segments import lengths
from mapweave.maps import Submap, Trajectory

RNG = np.random.default_rng(1)
PLAN = seen_in(plan_of(row_of_rooms(RNG, 12)), shapely.box(-5, -20, 100, 20), RNG)


def test_long_walls_arrive_to_a_decimetre_and_those_that_find_no_room_are_the_shorter_ones() -> (
    None
):
    size, arrived = coded_walls(PLAN, 0.8)
    assert 0 < size <= MOST
    length = lengths(PLAN.segments)
    kept = PLAN.segments[np.argsort(-length, kind="stable")[: len(arrived)]]
    assert len(arrived) < np.sum(length >= 0.8)
    for wall in kept:
        apart = np.abs(arrived - wall).reshape(-1, 2, 2)
        assert np.hypot(apart[..., 0], apart[..., 1]).max(axis=1).min() <= 0.75 / PER_METRE


def test_words_without_places_are_the_same_in_another_frame() -> None:
    one, other = (
        words_of(Submap(0, 0, np.zeros(3), lines, Trajectory.empty()))
        for lines in (PLAN, PLAN.moved(np.array([3.0, -2.0, 0.7])))
    )
    assert np.isin(one, other).mean() > 0.95


def test_more_words_take_more_bytes_but_no_more_than_there_are() -> None:
    submap = Submap(0, 0, np.zeros(3), PLAN, Trajectory.empty())
    there = len(words_of(submap))
    sizes = [words_size(count, submap) for count in (16, 64, there, 2 * there)]
    assert sizes[0] < sizes[1] < sizes[2] == sizes[3]
