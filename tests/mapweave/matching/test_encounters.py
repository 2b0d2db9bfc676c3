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


def take(encounters: Encounters, robot_map: RobotMap) -> None:
    encounters.take(robot_map)
    encounters.catch_up()


def test_robots_that_saw_one_place_are_likely_to_have_met_whoever_came_first() -> None:
    for turned in (False, True):
        encounters = Encounters()
        maps = [seen_by("a", part(BUILDING, 0, 14)), seen_by("b", ELSEWHERE, there(4, 16))]
        for robot_map in reversed(maps) if turned else maps:
            take(encounters, robot_map)
        take(encounters, seen_by("c", part(OTHER_BUILDING, 0, 14)))
        assert encounters.likely(A, B)
        assert encounters.likely(B, A)
        assert encounters.score(A, B) > 2 * encounters.score(A, C)
        assert encounters.score(A, ("nobody", "x")) == 0.0


def test_a_run_is_not_asked_about_itself() -> None:
    encounters = Encounters()
    take(encounters, seen_by("a", part(BUILDING, 0, 14), there(4, 16)))
    assert not encounters.likely(A, A)


def test_of_a_submap_the_best_runs_count_and_no_more() -> None:
    encounters = Encounters(EncounterParameters.of(Config(), runs=1))
    take(encounters, seen_by("b", there(10, 16)))
    take(encounters, seen_by("c", there(4, 16)))
    take(encounters, seen_by("a", part(BUILDING, 0, 14)))
    assert encounters.likely(A, C)
    assert not encounters.likely(A, B)


def test_a_submap_that_grows_is_looked_up_again() -> None:
    encounters = Encounters()
    take(encounters, seen_by("a", part(BUILDING, 0, 14)))
    take(encounters, seen_by("b", there(21, 23)))
    before = encounters.score(A, B)
    take(encounters, seen_by("b", there(4, 23)))
    assert encounters.score(A, B) > before


def test_what_a_peer_no_longer_has_is_looked_in_no_more() -> None:
    encounters = Encounters()
    take(encounters, seen_by("b", there(4, 16)))
    take(encounters, seen_by("b", ELSEWHERE, ELSEWHERE))
    take(encounters, seen_by("b", there(4, 16), boot="before"))
    take(encounters, seen_by("a", part(BUILDING, 0, 14)))
    assert not encounters.likely(A, B)
    assert encounters.likely(A, ("b", "before"))


def test_of_what_grows_before_it_is_looked_up_the_last_state_is() -> None:
    at_once, later = Encounters(), Encounters()
    for lines in (there(21, 23), there(14, 23), there(4, 23)):
        later.take(seen_by("b", lines))
    later.take(seen_by("a", part(BUILDING, 0, 14)))
    later.catch_up(1)
    assert later.is_behind
    assert not later.likely(A, B)
    later.catch_up(1)
    assert not later.is_behind
    for robot_map in (seen_by("b", there(4, 23)), seen_by("a", part(BUILDING, 0, 14))):
        take(at_once, robot_map)
    assert later.score(A, B) == at_once.score(A, B) > 0


def test_what_is_gone_before_it_is_looked_up_is_not() -> None:
    encounters = Encounters()
    encounters.take(seen_by("b", there(4, 16)))
    encounters.take(seen_by("b", ELSEWHERE, ELSEWHERE))
    take(encounters, seen_by("a", part(BUILDING, 0, 14)))
    assert not encounters.likely(A, B)
