"""What a robot did when it turned like that is what it is expected to do again."""

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.tracking.motion_model import MotionModel, MotionModelParameters

HELD = np.diag([20.0, 20.0, 20.0])
BARE = np.diag([0.1, 80.0, 20.0])  # along x nothing holds
STRAIGHT, ON_THE_SPOT = np.array([0.5, 0.0, 0.01]), np.array([0.05, 0.02, 0.35])


def paced(*steps: FloatArray, information: FloatArray = HELD) -> MotionModel:
    motion_model = MotionModel(MotionModelParameters())
    for step in steps:
        motion_model.add(step, information)
    return motion_model


def test_nothing_is_expected_of_a_robot_that_has_not_moved() -> None:
    motion_model = MotionModel(MotionModelParameters())
    np.testing.assert_array_equal(motion_model.guesses(), [se2.IDENTITY])
    assert (
        motion_model.surprise(np.array([1.0, 0, 0])) == motion_model.leap(np.array([1.0, 0, 0])) > 0
    )


def test_a_way_goes_with_its_turn() -> None:
    """Logs are thinned by way and turn: half a metre, or 20 degrees on the spot."""
    motion_model = paced(*[STRAIGHT, ON_THE_SPOT] * 12)
    np.testing.assert_allclose(motion_model.way(0.0)[:2], STRAIGHT[:2])
    np.testing.assert_allclose(motion_model.way(0.35)[:2], ON_THE_SPOT[:2])


def test_what_was_expected_before_a_step_is_not_what_is_expected_after_it() -> None:
    """Also where the same was asked before; and a copy learns by itself."""
    motion_model = paced(*[STRAIGHT] * 7)
    np.testing.assert_allclose(motion_model.way(0.01)[:2], STRAIGHT[:2])
    copied, far = motion_model.copy(), motion_model.reach(1.0)
    for _ in range(7):
        copied.add(2 * STRAIGHT * [1, 1, 0.5], HELD)
    np.testing.assert_allclose(copied.way(0.01)[:2], 2 * STRAIGHT[:2])
    np.testing.assert_allclose(motion_model.way(0.01)[:2], STRAIGHT[:2])
    assert copied.reach(1.0) > far == motion_model.reach(1.0)


def test_to_the_other_side_a_robot_turns_alike() -> None:
    motion_model = paced(*[ON_THE_SPOT] * 12)
    np.testing.assert_allclose(motion_model.way(-0.35)[:2], ON_THE_SPOT[:2] * [1, -1])


def test_who_keeps_the_pace_surprises_more_by_leaving_it(rng: np.random.Generator) -> None:
    steady = paced(*[STRAIGHT] * 30)
    erratic = paced(*STRAIGHT + rng.normal(0, [0.3, 0.3, 0.01], (60, 3)))
    leap = np.array([1.2, 0.0, 0.0])
    assert steady.surprise(leap) > 1.5 * erratic.surprise(leap)
    assert steady.leap(leap) < steady.surprise(leap)
    assert steady.surprise(STRAIGHT) < 1e-3


def test_steps_along_bare_walls_teach_nothing() -> None:
    """They are where they were expected; who believed them would never find out otherwise."""
    motion_model = paced(*[STRAIGHT] * 20)
    for _ in range(40):
        motion_model.add(np.array([0.0, 0.0, 0.01]), BARE)
    np.testing.assert_allclose(motion_model.way(0.0)[:2], STRAIGHT[:2])


def test_a_robot_that_seems_to_stand_since_a_moment_is_not_known_better() -> None:
    """Where hardly anything holds it, standing still is as good a fit; on the spot it is one."""
    motion_model = paced(*[STRAIGHT] * 30, *[ON_THE_SPOT] * 7, *[STRAIGHT * 0.05] * 7)
    np.testing.assert_allclose(motion_model.way(0.0)[:2], STRAIGHT[:2] * 0.05)
    assert motion_model.unknown(0.0)[0] == pytest.approx(0.25)
    assert motion_model.unknown(0.35)[0] < 0.05


def test_with_a_turn_that_is_new_to_it_a_robot_goes_no_farther_than_with_others() -> None:
    """Turning on the spot in a bare corridor is no way of half a metre a scan."""
    assert paced().unknown(0.07)[0] == 0.5
    assert paced(*[STRAIGHT * 0.1] * 30).unknown(0.07)[0] == pytest.approx(0.025)


@pytest.mark.parametrize("missed", [1, 3])
def test_while_scans_are_missed_a_robot_goes_on_or_stops(missed: int) -> None:
    motion_model = paced(*[np.array([0.5, 0.0, 0.0])] * 12)
    gone, stopped = motion_model.guesses(missed)
    np.testing.assert_allclose(gone, [0.5 * (missed + 1), 0, 0])
    np.testing.assert_array_equal(stopped, se2.IDENTITY)
    assert motion_model.surprise(gone, missed) == motion_model.surprise(stopped, missed) == 0
    assert motion_model.surprise(np.array([-1.0, 0.0, 0.0]), missed) > 0


def test_odometry_is_one_more_guess() -> None:
    motion_model = paced(*[STRAIGHT] * 12)
    told = np.array([0.0, 0.0, 1.0])
    np.testing.assert_array_equal(motion_model.guesses(told=told)[0], told)
    assert motion_model.surprise(told, told=told) == 0 < motion_model.surprise(told)
    assert motion_model.surprise(STRAIGHT, told=told) < 1e-3


def test_a_copy_goes_on_by_itself() -> None:
    motion_model = paced(*[STRAIGHT] * 12)
    other = motion_model.copy()
    for _ in range(8):
        other.add(np.array([0.9, 0.0, 0.01]), HELD)
    np.testing.assert_allclose(motion_model.way(0.0)[:2], STRAIGHT[:2])
    np.testing.assert_allclose(other.way(0.0)[:2], [0.9, 0.0])


def test_unseen_a_robot_comes_no_farther_than_it_might_have_gone() -> None:
    motion_model = paced(*[STRAIGHT] * 12)
    assert 3 * 0.5 < motion_model.reach(3) < 3 * 1.0
    assert MotionModel(MotionModelParameters()).reach(1) == np.inf


def test_for_a_robot_that_turns_unevenly_a_turn_is_no_surprise(rng: np.random.Generator) -> None:
    """As in a log that holds one scan in four: between two of them it turned by any angle."""
    turns = rng.uniform(-1.5, 1.5, 40)
    uneven = paced(*[np.array([2.0, 0.0, turn]) for turn in turns])
    steady = paced(*[np.array([2.0, 0.0, 0.0])] * 40)
    back = np.array([2.0, 0.0, turns[-1] - 1.5]), np.array([2.0, 0.0, -1.5])
    assert uneven.leap(back[0]) < 0.5 * steady.leap(back[1])


@pytest.mark.parametrize(("step", "less"), [(0.4, False), (0.9, False), (3.0, True)])
def test_how_much_is_a_leap_goes_with_the_length_of_steps(step: float, less: bool) -> None:
    own = paced(*[np.array([step, 0.0, 0.0])] * 20)
    short = paced(*[np.array([0.1, 0.0, 0.0])] * 20)
    off, short_off = (
        model.leap(at + np.array([1.0, 0.0, 0.0]))
        for model, at in ((own, np.array([step, 0.0, 0.0])), (short, np.array([0.1, 0.0, 0.0])))
    )
    assert off < 0.5 * short_off if less else off == pytest.approx(short_off)
