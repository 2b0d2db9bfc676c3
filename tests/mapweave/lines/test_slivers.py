"""Slivers go to the longer segment that they lie along."""

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.lines.slivers import absorb_slivers

WALL = [0.0, 0.0, 4.0, 0.0]


def absorbed(sliver: list[float]) -> bool:
    return len(absorb_slivers(np.array([WALL, sliver]), np.ones(2)).segments) == 1


def test_a_short_step_across_a_rough_wall_goes_to_the_wall() -> None:
    assert absorbed([1.0, -0.1, 1.0, 0.1])
    assert absorbed([1.0, 0.1, 1.05, -0.1])


def test_a_short_wall_that_stands_out_stays() -> None:
    assert not absorbed([1.0, 0.0, 1.0, 0.3])


def test_a_long_segment_is_no_sliver() -> None:
    assert not absorbed([1.0, 0.1, 2.0, 0.1])


def test_the_opposite_face_of_a_thin_wall_stays() -> None:
    assert not absorbed([1.3, -0.1, 1.0, -0.1])


def test_a_sliver_leaves_its_weight_and_the_wall_its_place() -> None:
    segments = np.array([[1.0, -0.1, 1.0, 0.1], WALL, [9.0, 9.0, 12.0, 9.0]])
    evolution = absorb_slivers(segments, np.array([2.0, 30.0, 5.0]))
    np.testing.assert_array_equal(evolution.segments, segments[1:])
    assert evolution.weights.tolist() == [32.0, 5.0]
    assert evolution.labels.tolist() == [0, 0, 1]


def test_a_sliver_of_a_sliver_goes_to_the_wall() -> None:
    segments = np.array([[2.02, 0.12, 2.02, 0.2], [2.0, -0.14, 2.0, 0.14], WALL])
    evolution = absorb_slivers(segments, np.ones(3))
    assert evolution.labels.tolist() == [0, 0, 0]
    assert evolution.weights.tolist() == [3.0]


def test_a_rigid_motion_changes_nothing() -> None:
    random = np.random.default_rng(5)
    start = random.uniform(0, 3, (120, 2))
    segments = np.hstack([start, start + random.normal(0, 0.4, (120, 2))])
    expected = absorb_slivers(segments, np.ones(120))
    assert len(expected.segments) < 120
    for motion in random.uniform(-3, 3, (3, 3)):
        moved = absorb_slivers(se2.transform_segments(motion, segments), np.ones(120))
        np.testing.assert_array_equal(moved.labels, expected.labels)


@pytest.mark.parametrize("count", [0, 1])
def test_few_segments_stay_as_they_are(count: int) -> None:
    segments = np.array([[0.0, 0.0, 0.1, 0.0]])[:count]
    evolution = absorb_slivers(segments, np.ones(count))
    np.testing.assert_array_equal(evolution.segments, segments)
