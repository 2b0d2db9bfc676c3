"""The map of a run as others get it: without stray scans, and without what others made."""

import numpy as np

from mapweave.mapping.localization.known_map import KnownMap
from mapweave.mapping.localization.localizer import Localizer
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave.marks import Anchor, Mark
from mapweave_agent.own_map import OwnMap, without_strays
from tests.mapweave.buildings import BUILDING, part


def robot_map(*submaps: tuple[int, int]) -> RobotMap:
    """Return a map of submaps, each with its component and number of scans."""
    return RobotMap(
        "a",
        "boot",
        1,
        tuple(
            Submap(number, component, np.zeros(3), LineMap.empty(), trajectory(scans))
            for number, (component, scans) in enumerate(submaps)
        ),
    )


def trajectory(scans: int) -> Trajectory:
    return Trajectory(np.arange(scans), np.zeros(scans), np.zeros((scans, 3)))


def ids(of: RobotMap) -> list[int]:
    return [submap.id for submap in without_strays(of).submaps]


def test_a_stored_component_that_no_scan_of_this_run_is_in_stays() -> None:
    assert ids(robot_map((0, 0), (1, 1), (2, 5))) == [0, 2]


def test_a_component_of_one_scan_is_left_out() -> None:
    assert ids(robot_map((0, 9), (1, 1), (2, 4))) == [0, 2]


def test_a_submap_of_one_scan_among_others_of_its_component_stays() -> None:
    assert ids(robot_map((0, 9), (0, 1), (1, 5))) == [0, 1, 2]


def test_two_scans_that_fit_each_other_stay() -> None:
    assert ids(robot_map((0, 9), (1, 2))) == [0, 1]


def test_the_first_scan_of_all_stays_while_there_is_no_other() -> None:
    assert ids(robot_map((0, 1))) == [0]


def test_a_map_of_nothing_is_one_of_nothing() -> None:
    assert ids(robot_map()) == []


def test_a_stored_map_that_is_followed_is_kept_and_its_walls_and_marks_are_told_to_nobody() -> None:
    walls = part(BUILDING, 0.0, 10.0)
    mark = Mark("m1", "victim", "anna", 5.0, Anchor(0, None), np.zeros(2))
    known = KnownMap((Submap(0, 0, np.zeros(3), walls, Trajectory.empty()),), (mark,))
    own = OwnMap(Localizer(known, "b"), first=3)
    own.publish()
    assert own.whole.components == [3]
    assert own.whole.marks == (mark,)
    assert own.told.submaps == ()
    assert own.told.marks == own.marks.all == ()
    assert own.state is None
