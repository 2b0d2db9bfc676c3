"""Things are landmarks once they were found standing, and no longer when they were found gone."""

import math

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.tracking.observation import ObservationParameters, observe
from mapweave.mapping.tracking.standing_things import StandingThings, StandingThingsParameters
from mapweave.mapping.tracking.tracker import Tracker
from mapweave.maps import LineMap
from mapweave.scan.points import OrientedPoints
from mapweave.scan.scan import Scan
from tests.mapweave.buildings import AROUND, cast, corridor, rectangle, walls_of

P = StandingThingsParameters(judged=10, lately=20, remembered=100)
HALL = walls_of(rectangle(-8, -8, 8, 8))
CHAIRS = np.array([[2.0, 0.3 * k - 1] for k in range(6)])  # [m]


def scan_at(stamp: float) -> Scan:
    """Return a scan of the hall from its middle, in which nothing stands."""
    hall = cast(HALL, se2.IDENTITY, angles=AROUND)
    return Scan(hall.ranges, hall.angles, 0, stamp)


def things(points: FloatArray) -> OrientedPoints:
    normals = np.tile([-1.0, 0.0], (len(points), 1))
    return OrientedPoints(points, normals, np.full(len(points), -1))


def looked(watch: StandingThings, stamp: float, seen: FloatArray) -> list[OrientedPoints]:
    """Look from the middle of the hall, where so many points (n, 2) are `seen` of things."""
    return watch.look(scan_at(stamp), se2.IDENTITY, seen, things(seen))


def watched(*sightings: FloatArray) -> StandingThings:
    watch = StandingThings(P)
    for k, seen in enumerate(sightings):
        looked(watch, 3.0 * k, seen)
    return watch


def test_things_are_no_landmarks_before_they_were_found_standing() -> None:
    assert watched(CHAIRS, CHAIRS).are_distrusted  # too few to tell
    assert not watched(CHAIRS, CHAIRS, CHAIRS).are_distrusted


def test_things_that_are_gone_are_trusted_no_longer() -> None:
    gone = CHAIRS + np.array([0.0, 4.0])
    assert watched(CHAIRS, CHAIRS, CHAIRS, gone).are_distrusted


def test_after_people_it_takes_much_that_stands_to_trust_things_again() -> None:
    people = [CHAIRS + np.array([0.0, 3.0 * (k % 2)]) for k in range(4)]
    assert watched(*people, CHAIRS, CHAIRS, CHAIRS, CHAIRS).are_distrusted
    assert not watched(*people, *[CHAIRS] * 25).are_distrusted


def test_what_stood_meanwhile_is_returned_and_what_is_gone_is_not() -> None:
    watch = watched(np.concatenate([CHAIRS, CHAIRS + np.array([0.0, 4.0])]))
    stood = np.concatenate([each.points for each in looked(watch, 3.0, CHAIRS)])
    np.testing.assert_array_equal(stood, CHAIRS)


def test_what_was_seen_a_moment_ago_is_not_looked_for_yet() -> None:
    watch = watched(CHAIRS)
    assert looked(watch, 0.5 * P.settled, CHAIRS) == []


def test_what_hides_behind_something_is_neither_there_nor_gone() -> None:
    behind = CHAIRS + np.array([9.0, 0.0])  # the hall's wall
    assert watched(CHAIRS, CHAIRS, np.concatenate([CHAIRS, behind]), CHAIRS).are_distrusted is False


def test_without_times_what_was_seen_before_is_a_while_ago() -> None:
    watch = StandingThings(P)
    looked(watch, math.nan, CHAIRS)
    assert len(looked(watch, math.nan, CHAIRS)) == 1


def test_what_waits_is_forgotten_where_nobody_knows_how_far_the_robot_went() -> None:
    watch = watched(CHAIRS)
    watch.forget()
    assert looked(watch, 3.0, CHAIRS) == []


def test_a_copy_goes_on_by_itself() -> None:
    watch = watched(CHAIRS, CHAIRS)
    other = watch.copy()
    looked(other, 9.0, CHAIRS)
    assert (watch.are_distrusted, other.are_distrusted) == (True, False)


def walk(walkers: FloatArray, steps: int) -> tuple[list[Scan], FloatArray]:
    """Return what a lidar of 4 m sees among people who walk along with it, and its (n, 3) poses.

    From a room into a corridor with shallow doors; ten scans a second, 5 cm apart.
    """
    doors = [(a, a + 0.9, 0.25) for a in (6.5, 9.3, 11.8, 15.1, 17.6, 20.2)]
    place = corridor(24.0, below=[(0.5, 5, 3.0), *doors[::2]], above=doors[1::2])
    walls, rng = walls_of(place), np.random.default_rng(4)
    poses = np.array([[1.0 + 0.05 * k, 1.1, 0.0] for k in range(steps)])
    body = rectangle(-0.15, -0.15, 0.15, 0.15)[::-1]
    scans = []
    for k, pose in enumerate(poses):
        people = [walls_of(body + pose[:2] + walker) for walker in walkers]
        around = np.concatenate([walls, *people])
        seen = cast(around, pose, index=k, angles=AROUND[45:316], noise=rng, max_range=4.0)
        scans.append(Scan(seen.ranges, seen.angles, k, 0.1 * k))
    return scans, poses


def tracked(walkers: list[tuple[float, float]]) -> tuple[FloatArray, FloatArray]:
    """Return (n, 3) the poses found of a walk, NaN where none was, and the true ones."""
    scans, poses = walk(np.array(walkers).reshape(-1, 2), 380)
    tracker, found = Tracker(), np.full(poses.shape, np.nan)
    for scan in scans:
        for seen, match in tracker.place(observe(scan, ObservationParameters()), LineMap.empty):
            found[seen.scan.index] = match.pose
    return found, poses - poses[0]


@pytest.mark.parametrize("walkers", [[], [(1.2, 0.5), (-1.0, 0.6)]])
def test_people_who_walk_along_do_not_hold_a_robot_back(walkers: list[tuple[float, float]]) -> None:
    found, true = tracked(walkers)
    np.testing.assert_allclose(found, true, atol=0.25)
