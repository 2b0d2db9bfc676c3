"""Where a stored map lies in a team's: told by one alignment for each component, held on a path."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mapweave.geometry import se2
from mapweave.maps import Alignment, Decision, RobotMap, SharedPlace, Submap, Trajectory
from mapweave.reasons import Reason
from mapweave_agent.comparison_schedule import Comparison
from mapweave_agent.stored.team_place import TeamPlace, path_of
from mapweave_protocol.wire.messages import AlignmentMessage
from tests.mapweave.buildings import BUILDING, part

WALLS = part(BUILDING, 0.0, 10.0)
AT = np.array([3.0, -1.0, 0.5])  # of the stored submap in its component [m, m, rad]


def stretch(number: int, component: int = 0) -> Submap:
    path = Trajectory(np.array([number]), np.array([0.0]), np.zeros((1, 3)))
    return Submap(number, component, np.zeros(3), WALLS.empty(), path)


KNOWN = RobotMap("b", "x", 0, (Submap(0, 0, AT, WALLS, Trajectory.empty()),))
DRIVEN = replace(KNOWN, version=3, submaps=(*KNOWN.submaps, stretch(1), stretch(2)))
PATH = path_of(DRIVEN, KNOWN)


def peer(robot: str, version: int = 1) -> RobotMap:
    return RobotMap(robot, "x", version, (Submap(0, 0, np.zeros(3), WALLS, Trajectory.empty()),))


def found(robot: str, confidence: float, decision: Decision = "accepted") -> Alignment:
    reference, other = sorted((f"{robot}/0", "b/0"))
    place = SharedPlace(0, 0, np.array([1.0, 2.0, 0.25]), np.zeros(2))
    transform = np.zeros(3)
    cause = Reason.words("so")
    places = (place, replace(place, transform=np.array([1.1, 2.0, 0.25])))
    return Alignment(reference, other, transform, decision, confidence, cause, places=places)


def compared(place: TeamPlace, alignment: Alignment) -> Sequence[AlignmentMessage]:
    """Have the stored map compared with that of the other robot of `alignment`."""
    robot = (alignment.reference + alignment.other).replace("b/0", "").removesuffix("/0")
    ends = sorted((KNOWN, peer(robot)), key=lambda m: m.robot)
    place.take(Comparison(robot, *ends), [alignment])
    return list(place.news(PATH))


def accepted(messages: Sequence[AlignmentMessage]) -> dict[str, list[str]]:
    """Return what each of the other robots is told to be joined by."""
    return {
        next(end.robot for end in (m.reference, m.other) if end.robot != "b"): [
            a.decision for a in m.unpack()
        ]
        for m in messages
    }


def test_what_is_told_of_a_robot_that_follows_is_its_path_and_no_wall() -> None:
    assert [s.id for s in PATH.submaps] == [1, 2]
    assert not any(len(s.map.segments) for s in PATH.submaps)
    assert path_of(DRIVEN, None) is DRIVEN


def test_nothing_is_told_before_the_robot_has_found_itself() -> None:
    place = TeamPlace(KNOWN)
    place.take(Comparison("a", peer("a"), KNOWN), [found("a", 0.9)])
    assert list(place.news(replace(PATH, submaps=()))) == []
    assert accepted(list(place.news(PATH))) == {"a": ["accepted"]}
    assert list(place.news(PATH)) == []


def test_a_component_is_joined_with_one_run_and_stays_with_it_while_that_holds() -> None:
    place = TeamPlace(KNOWN)
    assert accepted(compared(place, found("a", 0.9))) == {"a": ["accepted"]}
    assert compared(place, found("c", 0.99)) == []
    # It turns out to be wrong: the other one is told instead.
    told = compared(place, found("a", 0.3, "ambiguous"))
    assert accepted(told) == {"a": [], "c": ["accepted"]}


def test_it_is_told_that_the_walls_in_common_are_those_of_the_stored_map() -> None:
    [message] = compared(TeamPlace(KNOWN), found("a", 0.9))
    [alignment] = message.unpack()
    assert alignment.reason == "by the stored map that one of them follows in; so"


def test_refusals_of_walls_that_are_not_its_own_are_not_told() -> None:
    assert compared(TeamPlace(KNOWN), found("a", 0.1, "refused")) == []


def test_the_place_where_both_maps_meet_is_held_by_the_first_stretch_of_the_path() -> None:
    """The wall of the other robot stays where it is in the component of the path."""
    for robot, ours_first in (("a", False), ("c", True)):
        [message] = compared(TeamPlace(KNOWN), found(robot, 0.9))
        [alignment] = message.unpack()
        [place] = alignment.places
        given = np.array([1.0, 2.0, 0.25])
        assert (place.reference, place.other) == ((1, 0) if ours_first else (0, 1))
        # The other's submap in the component stays, by way of the stored submap.
        expected = se2.compose(AT, given) if ours_first else se2.compose(given, se2.inverse(AT))
        np.testing.assert_allclose(place.transform, expected, atol=2e-3)
