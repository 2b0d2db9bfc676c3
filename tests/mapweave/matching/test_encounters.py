"""Whose maps are worth comparing first: those whose shapes speak of one place."""

import numpy as np

from mapweave.config import Config
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave.matching.encounters import EncounterParameters, Encounters
from tests.mapweave.buildings import BUILDING, OTHER_BUILDING, part, shaken

ELSEWHERE = part(np.array([[0.0, 0.0], [9.0, 0.0], [4.0, 7.0]]), -1.0, 20.0)  # no right angle


def seen_by(robot: str, *maps: LineMap, boot: str = "x") -> RobotMap:
    submaps = [Submap(k, 0, np.zeros(3), lines, Trajectory.empty()) for k, lines in enumerate(maps)]
    return RobotMap(robot, boot, 1, tuple(submaps))


def there(left: float, right: float) -> LineMap:
    lines = shaken(part(BUILDING, left, right), np.random.default_rng(1))
    return lines.moved(np.array([3.0, 4.0, 2.0]))


A, B, C = ("a", "x"), ("b", "x"), ("c", "x")


def test_robots_that_saw_one_place_are_likely_to_have_met_whoever_came_first() -> None:
    for turned in (False, True):
        encounters = Encounters()
        maps = [seen_by("a", part(BUILDING, 0, 14)), seen_by("b", ELSEWHERE, there(4, 16))]
        for robot_map in reversed(maps) if turned else maps:
            encounters.take(robot_map)
        encounters.take(seen_by("c", part(OTHER_BUILDING, 0, 14)))
        assert encounters.likely(A, B)
        assert encounters.likely(B, A)
        assert encounters.score(A, B) > 2 * encounters.score(A, C)
        assert encounters.score(A, ("nobody", "x")) == 0.0


def test_a_run_is_not_asked_about_itself() -> None:
    encounters = Encounters()
    encounters.take(seen_by("a", part(BUILDING, 0, 14), there(4, 16)))
    assert not encounters.likely(A, A)


def test_of_a_submap_the_best_runs_count_and_no_more() -> None:
    encounters = Encounters(EncounterParameters.of(Config(), runs=1))
    encounters.take(seen_by("b", there(10, 16)))
    encounters.take(seen_by("c", there(4, 16)))
    encounters.take(seen_by("a", part(BUILDING, 0, 14)))
    assert encounters.likely(A, C)
    assert not encounters.likely(A, B)


def test_a_submap_that_grows_is_looked_up_again() -> None:
    encounters = Encounters()
    encounters.take(seen_by("a", part(BUILDING, 0, 14)))
    encounters.take(seen_by("b", there(21, 23)))
    before = encounters.score(A, B)
    encounters.take(seen_by("b", there(4, 23)))
    assert encounters.score(A, B) > before


def test_what_a_peer_no_longer_has_is_looked_in_no_more() -> None:
    encounters = Encounters()
    encounters.take(seen_by("b", there(4, 16)))
    encounters.take(seen_by("b", ELSEWHERE, ELSEWHERE))
    encounters.take(seen_by("b", there(4, 16), boot="before"))
    encounters.take(seen_by("a", part(BUILDING, 0, 14)))
    assert not encounters.likely(A, B)
    assert encounters.likely(A, ("b", "before"))
