"""Shape words: pairs of wall ends with their relative pose."""

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.shape.words import WordParameters, shape_words

P = WordParameters()
CORNER = np.array([[0.0, 0.0, 2.0, 0.0], [2.0, 0.0, 2.0, 1.5]])


def test_a_corner_has_the_words_of_its_ends() -> None:
    found = shape_words(CORNER, P)
    apart = np.sort(found.words[:, 5])
    # Of four ends two are one place: six pairs, less the one that is no distance apart.
    np.testing.assert_allclose(apart, [1.5, 1.5, 2.0, 2.0, 2.5])


def test_words_move_with_the_map_and_keep_what_tells_them() -> None:
    motion = np.array([4.0, -3.0, 2.0])
    here = shape_words(CORNER, P)
    there = shape_words(se2.transform_segments(motion, CORNER), P)
    np.testing.assert_allclose(there.words[:, :2], se2.transform_points(motion, here.words[:, :2]))
    np.testing.assert_allclose(there.words[:, 5], here.words[:, 5])
    for k in (2, 3, 4):
        turned = se2.wrap(there.words[:, k] - here.words[:, k])
        np.testing.assert_allclose(np.abs(se2.wrap(turned - motion[2])), 0, atol=1e-9)
    np.testing.assert_array_equal(there.kind, here.kind)


def test_kinds_tell_which_walls_begin_and_which_end() -> None:
    wall = shape_words(CORNER[:1], P)
    assert wall.kind.tolist() == [1]  # the first end begins the wall, the second one ends it
    assert wall.words[0].tolist() == pytest.approx([1.0, 0.0, 0.0, 0.0, 0.0, 2.0])


def test_short_walls_and_ends_far_apart_are_no_words() -> None:
    assert len(shape_words(np.array([[0.0, 0.0, 0.3, 0.0]]), P).words) == 0
    far = np.array([[0.0, 0.0, 1.0, 0.0], [20.0, 0.0, 21.0, 0.0]])
    assert shape_words(far, P).words[:, 5].tolist() == pytest.approx([1.0, 1.0])


def test_of_many_words_those_of_the_longest_walls_stay() -> None:
    rng = np.random.default_rng(1)
    start = rng.uniform(0, 8, (30, 2))
    walls = np.hstack([start, start + rng.uniform(0.5, 1.0, (30, 2))])
    walls[0, 2:] = walls[0, :2] + 4.0
    few = shape_words(walls, P.model_copy(update={"max_words": 1}))
    assert few.words[0, 5] == pytest.approx(np.hypot(4.0, 4.0))
