"""Corners fix frames; like corners propose transforms, and the true one is proposed most."""

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.shape.corners import CornerParameters, find_corners, propose
from tests.mapweave.buildings import BUILDING, part, random_pose, rectangle, shaken, walls_of

P = CornerParameters()


def test_a_square_room_has_four_corners_with_frames_in_closed_form() -> None:
    found = find_corners(walls_of(rectangle(0, 0, 4, 4)), P)
    order = np.lexsort(found.frame.T[:2])
    expected = np.array([[0, 0, -np.pi / 2], [4, 0, 0], [0, 4, np.pi], [4, 4, np.pi / 2]])
    # Each is the point where its walls meet, turned to the wall that comes first.
    np.testing.assert_allclose(found.frame[order], expected, atol=1e-12)
    np.testing.assert_allclose(found.angle, np.pi / 2)
    np.testing.assert_allclose(found.weight, 4)


def test_walls_need_not_touch_to_make_a_corner() -> None:
    """They meet where their lines do: here beyond both."""
    found = find_corners(np.array([[0.0, 0, 2, 0], [3, 1, 3, 4]]), P)
    np.testing.assert_allclose(found.frame, [[3, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(found.weight, 2)


@pytest.mark.parametrize(
    "second",
    [[3.0, 1, 6, 1], [3, 1, 6, 2], [9, 1, 9, 4], [2, 0.1, 2, 0.3]],
    ids=["parallel", "nearly parallel", "far away", "too short"],
)
def test_what_fixes_no_frame_is_no_corner(second: list[float]) -> None:
    assert len(find_corners(np.array([[0.0, 0, 2, 0], second]), P).angle) == 0


def test_corners_move_with_the_map(rng: Generator) -> None:
    walls, pose = part(BUILDING, 0, 30).segments, random_pose(rng)
    here = find_corners(walls, P)
    there = find_corners(se2.transform_segments(pose, walls), P)
    moved = se2.compose(pose, here.frame)
    # In a building of equal lengths ties may fall otherwise: compared as sets.
    for frame in there.frame:
        off = se2.between(frame, moved)
        assert (np.abs(off).max(axis=1) < 1e-6).any()


@pytest.mark.parametrize("seed", range(5))
def test_the_true_transform_of_two_noisy_halves_is_among_the_most_proposed(seed: int) -> None:
    rng = np.random.default_rng(seed)
    true = random_pose(rng)
    reference = shaken(part(BUILDING, 0, 18), rng).segments
    other = se2.transform_segments(se2.inverse(true), shaken(part(BUILDING, 8, 30), rng).segments)
    proposals = propose(find_corners(reference, P), find_corners(other, P), P)
    middle = se2.transform_points(se2.inverse(true), np.array([13.0, 1.0]))
    c, s = np.cos(proposals[:, 2]), np.sin(proposals[:, 2])
    x = proposals[:, 0] + c * middle[0] - s * middle[1] - 13.0
    y = proposals[:, 1] + s * middle[0] + c * middle[1] - 1.0
    right = (np.hypot(x, y) < 0.5) & (np.abs(se2.wrap(proposals[:, 2] - true[2])) < 0.09)
    assert right[:50].any()


def test_without_like_corners_nothing_is_proposed() -> None:
    square = find_corners(walls_of(rectangle(0, 0, 4, 4)), P)
    sharp = find_corners(np.array([[0.0, 0, 2, 0], [2, 0, 0.5, 1.5]]), P)
    assert propose(square, sharp, P).shape == (0, 3)
    nothing = find_corners(np.empty((0, 4)), P)
    assert propose(square, nothing, P).shape == (0, 3)
