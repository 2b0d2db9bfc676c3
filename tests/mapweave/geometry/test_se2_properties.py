"""Rigid motions of the plane are a group that keeps distances, whatever the numbers."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray

METRES = st.floats(-1e3, 1e3)
POSES = st.tuples(METRES, METRES, st.floats(-10, 10)).map(np.array)
POINTS = st.lists(st.tuples(METRES, METRES), min_size=2, max_size=5).map(np.array)
NEAR = 1e-9  # [m, rad] of numbers up to a kilometre


def assert_same(found: FloatArray, expected: FloatArray) -> None:
    """Check that two poses are one: their angles may differ by whole turns."""
    np.testing.assert_allclose(found[..., :2], expected[..., :2], atol=NEAR)
    np.testing.assert_allclose(se2.wrap(found[..., 2] - expected[..., 2]), 0, atol=NEAR)


@given(st.floats(-1e6, 1e6))
def test_a_wrapped_angle_is_the_same_but_for_whole_turns(angle: float) -> None:
    wrapped = float(se2.wrap(angle))
    assert -np.pi < wrapped <= np.pi
    turns = (angle - wrapped) / (2 * np.pi)
    assert abs(turns - round(turns)) < 1e-9
    assert float(se2.wrap(wrapped)) == wrapped


@given(POSES, POSES, POSES)
def test_how_motions_are_bracketed_does_not_matter(
    a: FloatArray, b: FloatArray, c: FloatArray
) -> None:
    assert_same(se2.compose(se2.compose(a, b), c), se2.compose(a, se2.compose(b, c)))


@given(POSES)
def test_the_identity_changes_no_motion_and_the_inverse_takes_it_back(a: FloatArray) -> None:
    assert_same(se2.compose(a, se2.IDENTITY), a)
    assert_same(se2.compose(se2.IDENTITY, a), a)
    assert_same(se2.compose(a, se2.inverse(a)), se2.IDENTITY)
    assert_same(se2.inverse(se2.inverse(a)), a)


@given(POSES, POSES)
def test_the_way_back_is_the_inverse_of_the_way_there(a: FloatArray, b: FloatArray) -> None:
    assert_same(se2.between(b, a), se2.inverse(se2.between(a, b)))


@given(POSES, POSES, POINTS)
def test_points_are_moved_by_one_motion_after_the_other(
    a: FloatArray, b: FloatArray, points: FloatArray
) -> None:
    once = se2.transform_points(se2.compose(a, b), points)
    np.testing.assert_allclose(
        once, se2.transform_points(a, se2.transform_points(b, points)), atol=NEAR
    )


@given(POSES, POINTS)
def test_motions_keep_distances_and_sides(pose: FloatArray, points: FloatArray) -> None:
    moved = se2.transform_points(pose, points)
    before, after = points - points[0], moved - moved[0]
    np.testing.assert_allclose(np.hypot(*after.T), np.hypot(*before.T), atol=NEAR)
    # Signed areas: a reflection would turn them round.
    areas = [np.asarray(v[:-1, 0] * v[1:, 1] - v[:-1, 1] * v[1:, 0]) for v in (before, after)]
    np.testing.assert_allclose(areas[1], areas[0], atol=1e-6)


@given(POSES, st.lists(POSES, min_size=1, max_size=5).map(np.array))
def test_a_fit_takes_any_path_to_where_it_was_moved(motion: FloatArray, path: FloatArray) -> None:
    found = se2.fit(path, se2.compose(motion, path))
    middle = path[:, :2].mean(axis=0)
    there = se2.transform_points(motion, middle)
    np.testing.assert_allclose(se2.transform_points(found, middle), there, atol=1e-6)
    assert abs(float(se2.wrap(found[2] - motion[2]))) < 1e-9
