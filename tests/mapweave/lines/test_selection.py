"""The choice of segments: what explains the most comes first, and no wall is doubled."""

import numpy as np
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.lines.selection import SelectionParameters, bearing, explained, select
from mapweave.lines.sightings import Nearness, Sightings
from tests.mapweave.buildings import random_pose

WALL = [0.0, 0.0, 5.0, 0.0]


def chosen(
    candidates: FloatArray, seen: FloatArray, counts: list[int], price: float = 0.5
) -> list[int]:
    evidence = Sightings.of(seen, np.array(counts), 0.1)
    return [int(k) for k in selected(candidates, evidence, price)]


def selected(candidates: FloatArray, evidence: Sightings, price: float) -> IntArray:
    p = SelectionParameters()
    return select(len(candidates), bearing(candidates, evidence, p), evidence, price, p)


def test_one_wall_that_explains_all_is_taken_before_its_many_pieces() -> None:
    pieces = [[float(k), 0.0, k + 1.0, 0.0] for k in range(5)]
    assert chosen(np.array([*pieces, WALL]), np.array([WALL]), [3]) == [5]


def test_a_wall_doubled_close_in_front_of_a_surer_one_is_left_out() -> None:
    candidates = np.array([WALL, [0.0, 0.2, 5.0, 0.2]])
    assert chosen(candidates, candidates, [9, 4]) == [0]


def test_a_wall_40_cm_in_front_of_another_stays() -> None:
    candidates = np.array([WALL, [0.0, 0.4, 5.0, 0.4]])
    assert sorted(chosen(candidates, candidates, [9, 4])) == [0, 1]


def test_both_faces_of_a_thin_wall_stay() -> None:
    candidates = np.array([WALL, [5.0, -0.06, 0.0, -0.06]])
    assert sorted(chosen(candidates, candidates, [9, 4])) == [0, 1]


def test_a_recess_where_the_wall_has_a_gap_stays() -> None:
    candidates = np.array([[0, 0, 2, 0], [3, 0, 5, 0], [2.0, -0.15, 3.0, -0.15]], dtype=float)
    assert sorted(chosen(candidates, candidates, [9, 9, 9])) == [0, 1, 2]


def test_what_explains_less_than_the_price_is_left_out() -> None:
    candidates = np.array([WALL, [9.0, 9.0, 9.4, 9.0]])
    assert chosen(candidates, candidates, [3, 1], price=0.5) == [0]
    assert chosen(candidates, candidates, [3, 1], price=0.3) == [0, 1]


def naive(candidates: FloatArray, evidence: Sightings, price: float) -> list[int]:
    """Look at all candidates anew before each choice."""
    p = SelectionParameters()
    near = Nearness.of(candidates, evidence.points, evidence.directions, p.shadow)
    explains = explained(near, p)
    parallel = (near.cosine >= np.cos(p.parallel)) & (np.abs(near.across) <= p.shadow)
    settles = explains | (parallel & (near.distance <= np.abs(near.across) + 1e-9))
    left = evidence.weights.copy()
    taken: list[int] = []
    while True:
        value = np.where(explains, 1.0, -1.0) * settles * left[near.sample]
        worth = np.bincount(near.segment, value, minlength=len(candidates))
        if worth.max() <= price + 1e-9:
            return taken
        taken.append(int(np.argmax(worth)))
        left[near.sample[settles & (near.segment == taken[-1])]] = 0.0


def test_always_the_one_that_explains_most_of_what_is_left_is_next(rng: Generator) -> None:
    start = rng.uniform(0, 3, (60, 2))
    seen = np.hstack([start, start + rng.normal(0, 0.7, (60, 2))])
    evidence = Sightings.of(seen, rng.integers(1, 9, 60), 0.1)
    found = selected(seen, evidence, 0.5)
    assert 5 < len(found) < 60
    assert found.tolist() == naive(seen, evidence, 0.5)


def test_a_rigid_motion_changes_no_choice(rng: Generator) -> None:
    start = rng.uniform(0, 3, (40, 2))
    seen = np.hstack([start, start + rng.normal(0, 0.7, (40, 2))])
    counts = rng.integers(1, 9, 40).tolist()
    moved = se2.transform_segments(random_pose(rng), seen)
    assert chosen(moved, moved, counts) == chosen(seen, seen, counts)
