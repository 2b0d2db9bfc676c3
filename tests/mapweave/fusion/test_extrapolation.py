"""The farther maps go on beyond what they share, the less an alignment is worth for the rest."""

import math

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.fusion.align import FusionParameters, align, align_maps, prepare
from mapweave.fusion.extrapolation import ExtrapolationParameters, bend, holds, reach
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave.matching.distance_field import DistanceField
from mapweave.team.cycles import LIKELY
from tests.mapweave.buildings import corridor, part, random_pose, shaken

F, P = FusionParameters(), ExtrapolationParameters()
NICHES = [(2, 4, 2.0), (9, 10, 1.0), (15, 18, 2.5), (22, 23, 1.5), (29, 33, 2.0), (41, 42, 0.8)]
DOORS = [(5, 8, 1.2), (12, 13, 2.4), (25, 27, 3.0), (36, 39, 1.1), (46, 48, 2.0)]
HALL, BARE = corridor(160, NICHES, DOORS), corridor(160, [], [])


def raster(lines: LineMap) -> DistanceField:
    shape = prepare(lines, F)
    assert shape is not None
    return shape.raster


def between(first: LineMap, second: LineMap, transform: FloatArray = se2.IDENTITY) -> float:
    return reach(raster(first), raster(second), transform, F.verification)


def test_maps_that_saw_the_same_reach_no_farther() -> None:
    assert between(part(HALL, 0, 30), part(HALL, 0, 30)) == 0


def test_the_reach_is_half_of_what_a_corridor_goes_on_for() -> None:
    """Of a map that shares its first 20 m of 100, the middle of the wall is 30 m beyond."""
    here, far = part(BARE, 0, 20), part(BARE, 0, 100)
    assert between(here, far) == pytest.approx(30, abs=1.5)
    assert between(far, here) == pytest.approx(30, abs=1.5)


def test_what_both_maps_go_on_for_adds_up_in_squares() -> None:
    one, other = part(HALL, 0, 100), part(HALL, 80, 160)
    shared = part(HALL, 80, 100)
    assert between(one, other) == pytest.approx(
        math.hypot(between(one, shared), between(shared, other)), abs=0.5
    )


def test_the_reach_depends_on_no_frame(rng: Generator) -> None:
    a, b = random_pose(rng), random_pose(rng)
    one, other = part(HALL, 0, 40), part(HALL, 25, 90)
    moved = between(one.moved(a), other.moved(b), se2.compose(a, se2.inverse(b)))
    assert moved == pytest.approx(between(one, other), abs=0.5)


def test_maps_that_share_nothing_reach_for_ever_and_hold_nothing() -> None:
    apart = np.array([0.0, 500.0, 0.0])
    assert between(part(HALL, 0, 20), part(HALL, 0, 20), apart) == math.inf
    assert holds(math.inf, P) == 0


def test_what_holds_is_the_share_of_normal_errors_within_the_tolerance(rng: Generator) -> None:
    for far in (0.0, 10.0, 25.0, 60.0):
        off = rng.normal(0, math.hypot(P.exact, P.bend * far), (200_000, 2))
        drawn = np.mean(np.hypot(*off.T) < P.tolerance)
        assert holds(far, P) == pytest.approx(drawn, abs=0.005)


def test_maps_that_go_on_far_beyond_what_they_share_are_joined_there(rng: Generator) -> None:
    """The place is proven; what is 40 m away may be anywhere within a metre, and that is told."""
    one, other = shaken(part(HALL, 0, 50), rng), shaken(part(HALL, 20, 160), rng)
    near = align_maps(("a/0", one), ("b/0", shaken(part(HALL, 20, 70), rng)))
    far = align_maps(("a/0", one), ("b/0", other))
    for found in (near, far):
        assert found.decision == "accepted"
        assert found.evidence.place == found.confidence
    far_reach, near_reach = far.evidence.reach, near.evidence.reach
    assert far_reach is not None
    assert near_reach is not None
    assert holds(far_reach, P) < 0.7 < 0.9 < holds(near_reach, P)


def robot(name: str, lines: LineMap) -> RobotMap:
    submap = Submap(0, 0, np.zeros(3), lines, Trajectory.empty())
    return RobotMap(name, "boot", 1, (submap,))


def test_robots_are_judged_by_their_reach_as_maps_are(rng: Generator) -> None:
    one, other = shaken(part(HALL, 0, 50), rng), shaken(part(HALL, 20, 160), rng)
    (found,) = align(robot("a", one), robot("b", other))
    alone = align_maps(("a/0", one), ("b/0", other))
    assert (found.decision, found.reason) == (alone.decision, alone.reason)
    assert found.confidence == pytest.approx(alone.confidence)


def test_only_a_place_that_was_accepted_is_proven(rng: Generator) -> None:
    bare = shaken(part(BARE, 10, 40), rng), shaken(part(BARE, 20, 60), rng)
    nowhere = shaken(part(HALL, 0, 30), rng), shaken(part(BARE, 20, 60), rng)
    for one, other in (bare, nowhere):
        found = align_maps(("a/0", one), ("b/0", other))
        assert found.decision != "accepted"
        assert not found.evidence.is_empty
        assert found.evidence.place is None


@pytest.mark.parametrize("odd", [-5.0, math.nan, math.inf])
def test_what_others_say_of_their_reach_is_bounded(odd: float) -> None:
    assert bend(odd, P) == 0
    assert bend(10.0, P) == pytest.approx(10 * bend(1.0, P))
    assert bend(1e300, P) == bend(P.most, P)


def test_nineteen_of_twenty_are_within_what_cycles_allow_for(rng: Generator) -> None:
    off = rng.normal(0, bend(20.0, P), (200_000, 2))
    within = np.hypot(*off.T) < LIKELY * bend(20.0, P)
    assert np.mean(within) == pytest.approx(0.95, abs=0.005)
