"""How sure a segment is: closed forms of sightings and votes."""

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.maps import LineMap
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters
from mapweave.team.walls.segment_confidence import (
    SegmentConfidenceParameters,
    Witness,
    segment_confidence,
)
from tests.mapweave.buildings import line_map, random_pose, rectangle, walls_of

P = SegmentConfidenceParameters()
ROOM = walls_of(rectangle(0, 0, 8, 6))
FREE = (rectangle(0.15, 0.15, 7.85, 5.85),)
PARTITION = np.array([[4.0, 1.5, 4.0, 4.5]])
SEEN_THROUGH = 5.85 - P.clearance - 3.0  # [m] of the next one, clear of the edge of what was free
HALF_OUT = np.array([[4.0, 3.0, 4.0, 9.0]])


def witness(lines: LineMap) -> Witness:
    return Witness.of(DistanceField.of(lines, DistanceFieldParameters()), P)


def votes(wall: LineMap, confirming: int, denying: int) -> list[Witness]:
    seen = line_map(np.vstack([ROOM, wall.segments]))
    maps = [seen] * confirming + [line_map(ROOM, FREE)] * denying
    return [witness(one) for one in maps]


def sure(walls: np.ndarray, confirming: int, denying: int, support: int = 9) -> float:
    wall = line_map(walls, support=support)
    views = [[(said, np.zeros(3))] for said in votes(wall, confirming, denying)]
    return float(segment_confidence(wall, views, P)[0])


@pytest.mark.parametrize("support", [1, 4, 99])
def test_what_nobody_denies_is_as_sure_as_its_sightings(support: int) -> None:
    assert sure(PARTITION, 1, 0, support) == pytest.approx(support / (support + 1))


@pytest.mark.parametrize(("confirming", "denying"), [(1, 1), (2, 1), (1, 3), (3, 3)])
def test_robots_that_saw_it_and_robots_that_saw_through_it_vote(
    confirming: int, denying: int
) -> None:
    share = confirming / (confirming + denying)
    assert sure(PARTITION, confirming, denying) == pytest.approx(0.9 * share)


def test_only_the_part_that_was_seen_through_is_denied() -> None:
    assert sure(HALF_OUT, 1, 1) == pytest.approx(0.9 * (1 - 0.5 * SEEN_THROUGH / 6), abs=0.02)


def test_frames_change_nothing(rng: Generator) -> None:
    here, there = random_pose(rng), random_pose(rng)
    wall = line_map(PARTITION)
    (said,) = votes(wall, 0, 1)
    moved = line_map(ROOM, FREE).moved(se2.inverse(there))
    said_moved = witness(moved)
    pose = se2.compose(here, there)
    before = segment_confidence(wall, [[(said, np.zeros(3))]], P)
    after = segment_confidence(wall.moved(here), [[(said_moved, pose)]], P)
    np.testing.assert_allclose(after, before, atol=0.03)


def test_the_pieces_of_a_map_have_one_voice() -> None:
    """A submap that saw a wall, and one that saw through before it was there: no denial."""
    wall = line_map(PARTITION, support=9)
    seen, through = votes(wall, 1, 1)
    still = np.zeros(3)
    together = segment_confidence(wall, [[(through, still), (seen, still)]], P)
    assert together == pytest.approx(0.9)
    twice = [[(through, still), (through, still)], [(seen, still)]]
    assert segment_confidence(wall, twice, P) == pytest.approx(0.45)


def test_no_segments_have_no_confidence() -> None:
    assert segment_confidence(LineMap.empty(), [], P).shape == (0,)
