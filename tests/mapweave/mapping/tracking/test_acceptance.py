"""After a miss only what can be told from look-alikes counts."""

from dataclasses import replace

import numpy as np
import pytest

from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.tracking.acceptance import (
    AcceptanceParameters,
    ScanMatch,
    best_by_sight,
    is_acceptable,
    is_ambiguous,
    tell_apart,
    unsettled,
)
from mapweave.mapping.tracking.local_map import ScanEvidence

P = AcceptanceParameters()
HELD, OPEN = np.diag([30.0, 6.0, 50.0]), np.diag([30.0, 0.2, 50.0])
ALONG_Y = np.diag([30.0, 0.2, 50.0])[[1, 0, 2]][:, [1, 0, 2]]  # open along x


def pose(
    x: float,
    explained: float,
    contradicted: float = 0.0,
    *,
    turn: float = 0.0,
    information: FloatArray = HELD,
) -> ScanMatch:
    evidence = ScanEvidence(explained, contradicted, 0.0)
    return ScanMatch(np.array([x, 0.0, turn]), evidence, information)


def undenied(_: ScanMatch) -> float:
    """Of no return do walls deny that it was seen from there."""
    return 0.0


def test_a_pose_that_is_held_and_explains_most_counts() -> None:
    best, other = pose(0.5, 0.8), pose(1.5, 0.3, 0.2)
    assert tell_apart([other, best], P.novelty, P, undenied) == [best]


def test_what_one_may_slide_along_or_explains_too_little_does_not_count() -> None:
    assert tell_apart([pose(0.5, 0.9, information=OPEN)], P.novelty, P, undenied) == []
    assert tell_apart([pose(0.5, 0.55, 0.3)], P.novelty, P, undenied) == []
    assert tell_apart([], P.novelty, P, undenied) == []


@pytest.mark.parametrize("turn", [0.0, 1.0])
def test_nothing_counts_where_a_different_pose_is_worth_more(turn: float) -> None:
    """In a bare corridor many fit; the one that a door frame holds is so by chance."""
    held, better = pose(0.5, 0.7), pose(1.5 - turn, 0.8, turn=turn, information=OPEN)
    assert tell_apart([held], P.novelty, P, undenied) == [held]
    assert tell_apart([held, better], P.novelty, P, undenied) == []


def test_nothing_counts_where_walls_deny_the_best() -> None:
    """Turned by a quarter a room fits itself, but what the robot left is not as it was."""
    best, other = pose(0.5, 0.8), pose(1.5, 0.6)
    assert tell_apart([best, other], P.novelty, P, lambda at: 0.1 * (at is best)) == [best, other]
    assert tell_apart([best, other], P.novelty, P, lambda at: 0.4 * (at is best)) == []
    assert tell_apart([best, other], P.novelty, P, lambda at: 0.4 * (at is other)) == [best, other]


def test_a_pose_next_to_the_best_is_not_different() -> None:
    best, near = pose(0.5, 0.7), pose(0.7, 0.75, information=OPEN)
    assert tell_apart([best, near], P.novelty, P, undenied) == [best]


def disputed_leap(leap: float, information: FloatArray) -> ScanMatch:
    """Return a pose that a fifth of what is seen disputes, a leap away."""
    evidence = ScanEvidence(0.72, 0.16, 0.0)
    return ScanMatch(np.zeros(3), evidence, information, surprise=leap, leap=leap)


def test_what_explains_half_and_is_held_may_be_disputed_and_take_a_leap() -> None:
    there = disputed_leap(0.09, HELD)
    assert is_acceptable(there, [there], P)
    assert not is_acceptable(there, [there, pose(1.5, 0.6)], P)  # a look-alike
    slid, far = disputed_leap(0.09, OPEN), disputed_leap(0.12, HELD)
    assert not is_acceptable(slid, [slid], P)
    assert not is_acceptable(far, [far], P)


def edge(x: float, explained: float, information: FloatArray = HELD) -> ScanMatch:
    """Return a pose where much of what is seen is new."""
    evidence = ScanEvidence(explained, 0.04, 0.0)
    return ScanMatch(np.array([x, 0.0, 0.0]), evidence, information, surprise=0.08, leap=0.03)


def test_what_explains_little_is_not_taken_where_a_place_nearby_explains_more() -> None:
    """The likelier of two places half a metre apart is not known to some centimetres."""
    best = edge(0.5, 0.45)
    assert is_acceptable(best, [best, edge(0.55, 0.5)], P)  # the same place
    assert is_acceptable(best, [best, edge(0.95, 0.4)], P)
    assert not is_acceptable(best, [best, edge(0.95, 0.5)], P)
    slid = edge(0.5, 0.45, ALONG_Y)
    assert is_acceptable(slid, [slid, edge(0.95, 0.5, ALONG_Y)], P)  # its uncertainty says so


def leapt(x: float, explained: float, *, turn: float = 0.0, information: FloatArray) -> ScanMatch:
    """Return a remarkable pose."""
    evidence = ScanEvidence(explained, 0.0, 0.0)
    return ScanMatch(np.array([x, 0.0, turn]), evidence, information, surprise=0.08)


def test_what_is_remarkable_must_be_worth_clearly_more_than_look_alikes() -> None:
    best = leapt(0.0, 0.8, information=HELD)
    assert not is_ambiguous(best, [best, leapt(1.5, 0.5, information=HELD)], 0.0, P)
    assert is_ambiguous(best, [best, leapt(1.5, 0.78, information=HELD)], 0.0, P)
    expected = pose(0.0, 0.8)
    assert not is_ambiguous(expected, [expected, leapt(1.5, 0.78, information=HELD)], 0.0, P)


def test_elsewhere_along_an_open_direction_is_no_look_alike() -> None:
    along_y = np.diag([30.0, 0.2, 50.0])
    best = leapt(0.0, 0.8, information=along_y)
    slid = ScanMatch(np.array([0.1, 2.0, 0.0]), best.evidence, along_y, surprise=0.08)
    aside = ScanMatch(np.array([1.0, 0.0, 0.0]), best.evidence, along_y, surprise=0.08)
    assert not is_ambiguous(best, [best, slid], 0.0, P)
    assert is_ambiguous(best, [best, aside], 0.0, P)


def test_in_a_bare_corridor_nobody_is_believed_to_have_turned_round() -> None:
    back = leapt(0.0, 0.9, turn=2.0, information=OPEN)
    assert is_ambiguous(back, [back], 2.0, P)
    held = leapt(0.0, 0.9, turn=2.0, information=HELD)
    assert not is_ambiguous(held, [held], 2.0, P)


def test_what_may_have_come_since_does_not_hide_where_the_robot_is() -> None:
    """Half of what is seen are people: of the rest nearly all is explained."""
    people, boxes = ScanEvidence(0.48, 0.5, 0.0, 0.48), ScanEvidence(0.48, 0.5, 0.0)
    among, blocked = (ScanMatch(np.zeros(3), each, HELD) for each in (people, boxes))
    assert is_acceptable(among, [among], P) and not is_acceptable(blocked, [blocked], P)
    assert tell_apart([among], P.novelty, P, undenied) == [among]
    assert tell_apart([blocked], P.novelty, P, undenied) == []
    elsewhere = ScanMatch(np.array([2.0, 0.0, 0.0]), people, HELD)
    assert not is_acceptable(among, [among, elsewhere], P)


def test_where_a_step_is_remarkable_it_is_said_how_far_along_it_may_be_instead() -> None:
    """In a corridor with a door every two metres the next one fits nearly as well."""
    leap = ScanMatch(np.zeros(3), ScanEvidence(0.8, 0.0, 0.0), ALONG_Y, surprise=0.12, leap=0.06)
    expected = ScanMatch(np.zeros(3), ScanEvidence(0.8, 0.0, 0.0), ALONG_Y, surprise=0.01)
    alike = pose(2.0, 0.7, information=ALONG_Y), pose(-0.9, 0.72, information=ALONG_Y)
    worse = pose(3.0, 0.2, 0.3, information=ALONG_Y)
    assert unsettled(leap, [leap, *alike, worse], P.novelty, P) == pytest.approx(2.0)
    assert unsettled(leap, [leap, worse], P.novelty, P) == 0.0
    assert unsettled(expected, [expected, *alike], P.novelty, P) == 0.0  # the pace tells


def test_half_a_turn_is_another_pose_in_a_corridor_too() -> None:
    turned = ScanMatch(
        np.array([0.0, 0.0, np.pi]), ScanEvidence(0.85, 0.0, 0.0), np.diag([5.0, 70.0, 9.0]), 0.19
    )
    assert not is_ambiguous(turned, [turned, pose(5.0, 0.2, information=ALONG_Y)], np.pi, P)
    assert is_ambiguous(turned, [turned, pose(5.0, 0.64, information=ALONG_Y)], np.pi, P)


def test_a_scan_that_was_missed_is_not_placed_where_two_places_are_alike() -> None:
    best, other, along = pose(0.0, 0.8), pose(3.0, 0.78), pose(3.0, 0.6)
    assert best_by_sight([along, best], P, undenied) is best
    assert best_by_sight([best, other], P, undenied) is None
    assert best_by_sight([pose(0.0, 0.3, 0.1)], P, undenied) is None


def test_a_scan_that_was_missed_is_not_placed_where_walls_deny_it() -> None:
    best = pose(0.0, 0.8)
    assert best_by_sight([best], P, lambda _: 0.1) is best
    assert best_by_sight([best], P, lambda _: 0.2) is None


def test_a_scan_that_was_missed_is_not_placed_where_a_direction_is_open() -> None:
    assert best_by_sight([pose(0.0, 0.9, information=ALONG_Y)], P, undenied) is None


def test_along_bare_walls_nobody_turns_round_unseen() -> None:
    turned = ScanMatch(
        np.array([0.0, 0.0, 3.0]), ScanEvidence(0.9, 0.0, 0.0), ALONG_Y, surprise=0.01
    )
    held = replace(turned, information=np.diag([5.0, 70.0, 9.0]))
    assert is_ambiguous(turned, [turned], 3.0, P)
    assert not is_ambiguous(turned, [turned], 1.0, P)
    assert not is_ambiguous(held, [held], 3.0, P)
