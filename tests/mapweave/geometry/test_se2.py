"""Rigid motions are a group, and act on points and segments as one."""

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from tests.mapweave.buildings import random_pose


def matrix(pose: FloatArray) -> FloatArray:
    """Return the homogeneous (3, 3) matrix of `pose`."""
    return np.vstack([np.column_stack([se2.rotation(pose[2]), pose[:2]]), [0, 0, 1]])


def poses(rng: Generator, count: int) -> FloatArray:
    return np.array([random_pose(rng) for _ in range(count)])


def test_composing_poses_is_multiplying_their_matrices(rng: Generator) -> None:
    for a, b in zip(poses(rng, 20), poses(rng, 20), strict=True):
        np.testing.assert_allclose(matrix(se2.compose(a, b)), matrix(a) @ matrix(b), atol=1e-12)


def test_a_pose_and_its_inverse_cancel_on_both_sides(rng: Generator) -> None:
    a = poses(rng, 20)
    np.testing.assert_allclose(se2.compose(a, se2.inverse(a)), np.zeros((20, 3)), atol=1e-12)
    np.testing.assert_allclose(se2.compose(se2.inverse(a), a), np.zeros((20, 3)), atol=1e-12)


def test_between_is_what_leads_from_one_pose_to_the_other(rng: Generator) -> None:
    a, b = poses(rng, 20), poses(rng, 20)
    np.testing.assert_allclose(se2.compose(a, se2.between(a, b)), b, atol=1e-9)


def test_between_does_not_depend_on_the_common_parent(rng: Generator) -> None:
    a, b, moved = poses(rng, 20), poses(rng, 20), random_pose(rng)
    there = se2.between(se2.compose(moved, a), se2.compose(moved, b))
    np.testing.assert_allclose(there, se2.between(a, b), atol=1e-9)


def test_one_pose_is_composed_with_many(rng: Generator) -> None:
    one, many = random_pose(rng), poses(rng, 6).reshape(2, 3, 3)
    composed = se2.compose(one, many)
    assert composed.shape == (2, 3, 3)
    np.testing.assert_array_equal(composed[1, 2], se2.compose(one, many[1, 2]))


@pytest.mark.parametrize(
    ("angle", "wrapped"),
    [(0.0, 0.0), (np.pi, np.pi), (-np.pi, np.pi), (3 * np.pi, np.pi), (1.5 * np.pi, -np.pi / 2)],
)
def test_angles_are_wrapped_into_minus_pi_exclusive_to_pi_inclusive(
    angle: float, wrapped: float
) -> None:
    assert float(se2.wrap(angle)) == pytest.approx(wrapped)


def test_points_are_moved_as_poses_are(rng: Generator) -> None:
    a, b = random_pose(rng), random_pose(rng)
    points = rng.normal(size=(5, 2))
    once = se2.transform_points(se2.compose(a, b), points)
    np.testing.assert_allclose(
        once, se2.transform_points(a, se2.transform_points(b, points)), atol=1e-9
    )
    np.testing.assert_allclose(se2.transform_points(a, np.zeros(2)), a[:2])


def test_segments_are_moved_by_both_ends_and_keep_their_lengths(rng: Generator) -> None:
    pose, segments = random_pose(rng), rng.normal(size=(4, 4))
    moved = se2.transform_segments(pose, segments)
    np.testing.assert_allclose(moved[:, :2], se2.transform_points(pose, segments[:, :2]))
    np.testing.assert_allclose(moved[:, 2:], se2.transform_points(pose, segments[:, 2:]))
    lengths = [np.hypot(*(s[:, 2:] - s[:, :2]).T) for s in (segments, moved)]
    np.testing.assert_allclose(*lengths)


def test_the_identity_cannot_be_changed_by_accident() -> None:
    with pytest.raises(ValueError, match="read-only"):
        se2.IDENTITY[0] = 1.0


def test_a_fit_finds_the_motion_between_two_paths(rng: Generator) -> None:
    for _ in range(20):
        motion, path = random_pose(rng), poses(rng, 5)
        found = se2.fit(path, se2.compose(motion, path))
        np.testing.assert_allclose(se2.between(motion, found), 0.0, atol=1e-9)


def test_a_fit_on_one_spot_uses_the_headings() -> None:
    here = np.array([[1.0, 2.0, 0.1]])
    motion = np.array([3.0, -1.0, 2.0])
    np.testing.assert_allclose(se2.fit(here, se2.compose(motion, here)), motion, atol=1e-9)
