"""A correction of a robot's map moves an alignment with the walls that it was found on."""

from dataclasses import replace

import numpy as np
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment, LineMap, RobotMap, SharedPlace, Submap, Trajectory
from mapweave.reasons import Reason, ReasonKind
from mapweave.team.rebase import Change, carry, places_of
from tests.mapweave.buildings import line_map, random_pose, rectangle, walls_of

ROOM = line_map(walls_of(rectangle(-2, -2, 2, 2)))
CORRECTION = np.array([0.8, -0.5, 0.1])


def robot(name: str, *poses: FloatArray, component: int = 0, lines: LineMap = ROOM) -> RobotMap:
    submaps = (Submap(k, component, p, lines, Trajectory.empty()) for k, p in enumerate(poses))
    return RobotMap(name, "x", 1, tuple(submaps))


def corrected(robot_map: RobotMap, number: int) -> RobotMap:
    """Return the map with one submap moved."""
    submaps = [
        replace(s, pose=se2.compose(s.pose, CORRECTION)) if s.id == number else s
        for s in robot_map.submaps
    ]
    return replace(robot_map, version=2, submaps=tuple(submaps))


def still(robot_map: RobotMap) -> Change:
    return Change(places_of(robot_map), robot_map)


def alignment(transform: FloatArray) -> Alignment:
    return Alignment("a/0", "b/0", transform, "accepted", 0.9, Reason.words("20 m in common"))


A = robot("a", np.zeros(3), np.array([20.0, 0, 0.2]))
B = robot("b", np.zeros(3), np.array([15.0, 9, 1.0]))
# The second submap of b was found in the second of a, half a metre off its middle.
FOUND = se2.compose(se2.compose(A.submaps[1].pose, [0.5, 0, 0]), se2.inverse(B.submaps[1].pose))


def relation(transform: FloatArray, reference: Submap, other: Submap) -> FloatArray:
    """Return the pose of a submap of b in the frame of one of a."""
    return se2.between(reference.pose, se2.compose(transform, other.pose))


def test_maps_that_have_not_moved_keep_the_alignment_as_it_is() -> None:
    found = alignment(FOUND)
    assert carry(found, still(A), still(B)) is found


def test_what_was_in_common_stays_in_common_whichever_map_is_corrected() -> None:
    before = relation(FOUND, A.submaps[1], B.submaps[1])
    both = corrected(A, 1), corrected(B, 1)
    for ours, theirs in [(both[0], B), (A, both[1]), both]:
        moved = carry(alignment(FOUND), Change(places_of(A), ours), Change(places_of(B), theirs))
        after = relation(moved.transform, ours.submaps[1], theirs.submaps[1])
        np.testing.assert_allclose(after, before, atol=1e-9)
        assert not np.allclose(moved.transform, FOUND)


def placed(reference: int, other: int) -> Alignment:
    """Return the alignment as it is told at a place: where these submaps lie to each other."""
    step = relation(FOUND, A.submaps[reference], B.submaps[other])
    at = se2.transform_points(A.submaps[reference].pose, np.array([1.0, 2.0]))
    return replace(alignment(FOUND), places=(SharedPlace(reference, other, step, at),))


def test_what_tells_its_place_stays_there_whatever_lies_nearer() -> None:
    """The second submaps lie on each other, but the first ones are where it was found."""
    ours = corrected(A, 0)
    moved = carry(placed(0, 0), Change(places_of(A), ours), still(B))
    [place] = moved.places
    np.testing.assert_allclose(
        relation(moved.transform, ours.submaps[0], B.submaps[0]), place.transform, atol=1e-9
    )
    here = se2.transform_points(se2.inverse(ours.submaps[0].pose), place.at)
    np.testing.assert_allclose(here, [1.0, 2.0], atol=1e-9)
    elsewhere = carry(placed(0, 0), Change(places_of(A), corrected(A, 1)), still(B))
    np.testing.assert_array_equal(elsewhere.transform, FOUND)


def test_of_places_those_are_kept_whose_submaps_stay() -> None:
    both = replace(alignment(FOUND), places=placed(1, 1).places + placed(0, 0).places)
    left = replace(A.submaps[1], component=3)
    gone = replace(A, submaps=(corrected(A, 0).submaps[0], left))
    kept = carry(both, Change(places_of(A), gone), still(B))
    assert kept.decision == "accepted"
    [place] = kept.places
    assert (place.reference, place.other) == (0, 0)
    np.testing.assert_allclose(
        relation(kept.transform, gone.submaps[0], B.submaps[0]), place.transform, atol=1e-9
    )
    opened = carry(placed(1, 1), Change(places_of(A), gone), still(B))
    assert opened.decision == "ambiguous"
    assert opened.cause.kind is ReasonKind.REBASED


def test_a_correction_elsewhere_changes_nothing() -> None:
    found = alignment(FOUND)
    assert carry(found, still(A), Change(places_of(B), corrected(B, 0))) is found


def test_other_frames_carry_it_alike(rng: Generator) -> None:
    frame = random_pose(rng)
    ours = corrected(A, 1)
    here = carry(alignment(FOUND), Change(places_of(A), ours), still(B))

    def moved(robot_map: RobotMap) -> RobotMap:
        submaps = [replace(s, pose=se2.compose(frame, s.pose)) for s in robot_map.submaps]
        return replace(robot_map, submaps=tuple(submaps))

    there = carry(
        alignment(se2.compose(frame, FOUND)), Change(places_of(moved(A)), moved(ours)), still(B)
    )
    np.testing.assert_allclose(there.transform, se2.compose(frame, here.transform), atol=1e-9)


def test_submaps_that_changed_component_since_carry_nothing() -> None:
    found = alignment(FOUND)
    elsewhere = robot("b", *(s.pose for s in B.submaps), component=1)
    assert carry(found, still(A), Change(places_of(elsewhere), corrected(B, 1))) is found


def test_what_was_found_on_a_submap_that_left_its_component_is_open_again() -> None:
    """The robot jumped there without notice: that place is another one."""
    gone = replace(B, submaps=(B.submaps[0], replace(B.submaps[1], component=1)))
    carried = carry(alignment(FOUND), still(A), Change(places_of(B), gone))
    assert carried.decision == "ambiguous"
    assert carried.cause.kind is ReasonKind.REBASED
    refused = replace(alignment(FOUND), decision="refused")
    assert carry(refused, still(A), Change(places_of(B), gone)) is refused
    here = se2.compose(A.submaps[0].pose, se2.inverse(B.submaps[0].pose))
    elsewhere = alignment(here)
    assert carry(elsewhere, still(A), Change(places_of(B), gone)) is elsewhere


def test_submaps_without_walls_break_nothing() -> None:
    empty = robot("b", np.zeros(3), lines=LineMap.empty())
    moved = carry(alignment(FOUND), still(A), Change(places_of(empty), corrected(empty, 0)))
    assert np.isfinite(moved.transform).all()


def test_a_submap_that_took_the_id_of_one_that_was_cut_is_another() -> None:
    """It lies elsewhere, and the alignment does not go there with it."""
    path = Trajectory(np.array([40]), np.zeros(1), np.zeros((1, 3)))
    submaps = (B.submaps[0], replace(B.submaps[1], trajectory=path))
    other = corrected(replace(B, submaps=submaps), 1)
    found = alignment(FOUND)
    assert carry(found, still(A), Change(places_of(B), other)) is found


def scanned(number: int, component: int, pose: FloatArray, scans: range) -> Submap:
    indices = np.arange(scans.start, scans.stop)
    path = Trajectory(indices, np.zeros(len(indices)), np.zeros((len(indices), 3)))
    return Submap(number, component, pose, ROOM, path)


def test_what_was_found_on_a_submap_that_was_cut_is_open_again() -> None:
    """Its last scans were found to be elsewhere; which ones were compared, nobody knows."""
    there = B.submaps[1].pose
    then = replace(
        B, submaps=(scanned(0, 0, np.zeros(3), range(9)), scanned(1, 0, there, range(9, 30)))
    )
    front, rear = scanned(1, 0, there, range(9, 20)), scanned(2, 4, there, range(20, 30))
    cut = replace(then, submaps=(then.submaps[0], front, rear))
    carried = carry(alignment(FOUND), still(A), Change(places_of(then), cut))
    assert carried.decision == "ambiguous"


def test_a_submap_whose_number_moved_on_is_still_the_same() -> None:
    """One before it was cut in two meanwhile; it grew as well, and is elsewhere now."""
    there = B.submaps[1].pose
    then = replace(
        B, submaps=(scanned(0, 0, np.zeros(3), range(9)), scanned(1, 0, there, range(9, 30)))
    )
    front, rear = scanned(0, 0, np.zeros(3), range(5)), scanned(1, 4, np.zeros(3), range(5, 9))
    for component, decision in ((0, "accepted"), (4, "ambiguous")):
        grown = scanned(2, component, there, range(9, 40))
        now = replace(then, submaps=(front, rear, grown))
        carried = carry(alignment(FOUND), still(A), Change(places_of(then), now))
        assert carried.decision == decision
