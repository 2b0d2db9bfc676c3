"""Submap poses fit the tracking and every true closure; a false one has no say."""

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.loops.pose_graph import Constraint, optimise
from tests.mapweave.buildings import random_pose

TRACKING = np.diag([0.03**2, 0.03**2, 0.005**2])
CLOSURE = np.diag([0.02**2, 0.02**2, 0.003**2])
SIDES = 12
# Once round a regular polygon with sides of 8 m, and on: the last two poses are the first two.
ROUND = np.array([[8.0, 0, 2 * np.pi / SIDES]] * (SIDES + 1))


def chained(first: FloatArray, steps: FloatArray) -> FloatArray:
    """Return the (n + 1, 3) poses that (n, 3) steps lead to from `first`."""
    poses = [first]
    for step in steps:
        poses.append(se2.compose(poses[-1], step))
    return np.array(poses)


def tracking(poses: FloatArray) -> list[Constraint]:
    """Return the links from each of `poses` to the next, as they are."""
    steps = se2.between(poses[:-1], poses[1:])
    return [Constraint(k, k + 1, step, TRACKING, True) for k, step in enumerate(steps)]


def closure(first: int, second: int, poses: FloatArray) -> Constraint:
    return Constraint(first, second, se2.between(poses[first], poses[second]), CLOSURE, False)


def drifted(true: FloatArray, rng: Generator) -> FloatArray:
    """Return `true` poses as tracking has them: each step errs, all with the same bias."""
    steps = se2.between(true[:-1], true[1:])
    bias = np.array([0.02, -0.02, 0.004])
    errors = bias + rng.normal(0.0, [0.01, 0.01, 0.001], steps.shape)
    return chained(true[0], se2.compose(steps, errors))


def farthest(found: FloatArray, true: FloatArray) -> float:
    """Return [m] by which the worst of the poses is off."""
    return float(np.hypot(*(found - true)[:, :2].T).max())


@pytest.fixture
def true(rng: Generator) -> FloatArray:
    return chained(random_pose(rng), ROUND)


@pytest.fixture
def believed(true: FloatArray, rng: Generator) -> FloatArray:
    return drifted(true, rng)


def test_without_closures_nothing_moves(believed: FloatArray) -> None:
    found, relied_on = optimise(believed, tracking(believed))
    np.testing.assert_allclose(found, believed, atol=1e-6)
    assert relied_on.all()


def test_a_loop_that_is_closed_fits(true: FloatArray, believed: FloatArray) -> None:
    closures = [closure(0, SIDES, true), closure(1, SIDES + 1, true)]
    found, relied_on = optimise(believed, [*tracking(believed), *closures])
    assert relied_on.all()
    assert np.hypot(*(believed[-2] - true[-2])[:2]) > 0.4
    assert np.hypot(*se2.between(found[0], found[SIDES])[:2]) < 0.05
    assert farthest(found, true) < 0.4 * farthest(believed, true)


def test_the_first_pose_stays(true: FloatArray, believed: FloatArray) -> None:
    found, _ = optimise(believed, [*tracking(believed), closure(0, SIDES, true)])
    np.testing.assert_allclose(found[0], believed[0], atol=1e-3)


@pytest.mark.parametrize("seed", range(5))
def test_a_false_closure_among_true_ones_has_no_weight_and_does_no_harm(seed: int) -> None:
    rng = np.random.default_rng(seed)
    true = chained(random_pose(rng), ROUND)
    believed = drifted(true, rng)
    links = [*tracking(believed), closure(0, SIDES, true), closure(1, SIDES + 1, true)]
    first, second = rng.choice(SIDES, 2, replace=False)
    off = se2.compose(
        se2.between(true[first], true[second]), [3 * np.cos(seed), 3 * np.sin(seed), 0.4]
    )
    false = Constraint(int(first), int(second), off, CLOSURE, False)
    without, _ = optimise(believed, links)
    found, relied_on = optimise(believed, [*links, false])
    assert relied_on[:-1].all() and not relied_on[-1]
    np.testing.assert_allclose(found, without, atol=1e-3)


def test_a_false_closure_alone_does_no_harm(true: FloatArray) -> None:
    """Tracking is trusted: a closure it cannot be bent to is not believed."""
    off = se2.compose(se2.between(true[2], true[7]), [4, -3, 0.5])
    links = [*tracking(true), Constraint(2, 7, off, CLOSURE, False)]
    found, relied_on = optimise(true, links)
    assert not relied_on[-1]
    assert farthest(found, true) < 0.02


def test_moving_all_poses_moves_the_result_and_no_more(
    true: FloatArray, believed: FloatArray, rng: Generator
) -> None:
    moved = random_pose(rng)
    links = [*tracking(believed), closure(0, SIDES, true)]
    here, _ = optimise(believed, links)
    there, _ = optimise(se2.compose(moved, believed), links)
    np.testing.assert_allclose(se2.between(moved, there), here, atol=1e-4)


def test_the_order_of_the_links_does_not_matter(
    true: FloatArray, believed: FloatArray, rng: Generator
) -> None:
    links = [*tracking(believed), closure(0, SIDES, true), closure(1, SIDES + 1, true)]
    one, relied_on = optimise(believed, links)
    order = rng.permutation(len(links))
    other, shuffled = optimise(believed, [links[k] for k in order])
    np.testing.assert_allclose(other, one, atol=1e-4)
    np.testing.assert_array_equal(shuffled, relied_on[order])


def test_what_a_closure_asks_for_is_spread_by_variance() -> None:
    """Along a straight line the least squares are a closed form: each link gives by its share."""
    variances = np.array([1.0, 4.0, 2.0, 1.0]) * 0.03**2
    straight = np.array([[5.0 * k, 0, 0] for k in range(5)])
    links = [
        Constraint(k, k + 1, np.array([5.0, 0, 0]), np.diag([v, v, 1e-4]), True)
        for k, v in enumerate(variances)
    ]
    asked, certain = 0.12, 0.02**2
    links.append(
        Constraint(0, 4, np.array([20 + asked, 0, 0]), np.diag([certain, certain, 1e-4]), False)
    )
    found, relied_on = optimise(straight, links)
    given = asked * variances / (variances.sum() + certain)
    assert relied_on.all()
    np.testing.assert_allclose(np.diff(found[:, 0]) - 5, given, atol=1e-4)


def test_a_closure_moves_nothing_along_a_direction_it_leaves_open() -> None:
    """Its covariance is in the frame of the second pose: open ahead of it, here along y."""
    poses = np.array([[0.0, 0, 0], [0, 5, np.pi / 2], [0, 10, np.pi / 2]])
    seen = se2.between(poses[0], poses[2] + [0.1, 0.5, 0])
    sliding = Constraint(0, 2, seen, np.diag([1e6, 0.02**2, 0.003**2]), False)
    found, relied_on = optimise(poses, [*tracking(poses), sliding])
    assert relied_on[-1]
    assert found[2, 0] == pytest.approx(0.1, abs=0.03)
    assert found[2, 1] == pytest.approx(10, abs=0.01)


def test_a_single_pose_stays(rng: Generator) -> None:
    alone = random_pose(rng)[None]
    found, relied_on = optimise(alone, [])
    np.testing.assert_allclose(found, alone, atol=1e-6)
    assert len(relied_on) == 0
