"""Places by shape: the compiled index and views give what their NumPy twins do."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapweave.kernels.arrays import FloatArray, IntArray
from mapweave.kernels.loading import COMPILED
from mapweave.kernels.matching.place_views import Codes, PlaceViewNumpy, PlaceViewsNumpy
from mapweave.kernels.matching.rasters import cell_codes, cell_codes_numpy
from mapweave.kernels.matching.shape_index import Found, IndexSettings, ShapeIndexNumpy
from mapweave.kernels.matching.shifts import best_shifts_numpy

seeds = st.integers(0, 2**32 - 1)
SETTINGS = IndexSettings(6.0, 0.15, 36, 0.3, 0.1, 0.09, 0.25, 90)
compiled = pytest.mark.skipif(COMPILED is None, reason="no compiled kernels here")


def some_words(rng: np.random.Generator, count: int) -> tuple[FloatArray, IntArray]:
    words = np.column_stack(
        [
            rng.uniform(-20, 20, (count, 2)),
            rng.uniform(-np.pi, np.pi, (count, 1)) + np.zeros((1, 3)),
            rng.choice([1.0, 2.5, 4.0], count),
        ]
    )
    words[:, 3:5] += np.pi / 2 * rng.integers(0, 4, (count, 2)) + rng.normal(0, 0.03, (count, 2))
    return words, rng.integers(0, 4, count)


def moved(words: FloatArray, x: float, y: float, theta: float) -> FloatArray:
    """Return `words` of the same map in another frame."""
    c, s = np.cos(theta), np.sin(theta)
    place = words[:, :2] @ np.array([[c, s], [-s, c]]) + (x, y)
    return np.column_stack([place, words[:, 2:5] + theta, words[:, 5]])


def in_order(found: Found) -> Found:
    """Return what was found, of equals that with the lesser slot and place first."""
    slots, transforms, votes = found
    ranked = np.lexsort((*transforms.round(3).T, slots, -votes.round(3)))
    return slots[ranked], transforms[ranked], votes[ranked]


@compiled
@settings(max_examples=30, deadline=None)
@given(seeds, st.sampled_from([0, 1, 40]), st.sampled_from([200, 100_000]))
def test_the_index_finds_what_its_twin_does(seed: int, count: int, budget: int) -> None:
    assert COMPILED is not None
    rng = np.random.default_rng(seed)
    ours, theirs = COMPILED.ShapeIndex(*SETTINGS), ShapeIndexNumpy(*SETTINGS)
    known = [some_words(rng, 40) for _ in range(6)]
    for words, kind in known:
        assert ours.add(words, kind) == theirs.add(words, kind)
    ours.remove(2)
    theirs.remove(2)
    words, kind = known[4][0][:count], known[4][1][:count]
    words = moved(words, 3.0, -2.0, 1.0)
    allowed = np.array([1, 0, 1, 1, 1, 1], dtype=np.uint8)
    asked = (words, kind, np.array([1.0, 2.0]), allowed, budget, 500, 0.35, 0.1)
    for a, b in zip(in_order(ours.places(*asked)), in_order(theirs.places(*asked)), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-3)


Parts = tuple[Codes, FloatArray, float, FloatArray, FloatArray, FloatArray]


def some_views(rng: np.random.Generator, count: int) -> list[Parts]:
    """Return what views are made of: five codes."""
    return [
        (
            rng.integers(0, 5, (12, 9)).astype(np.uint8),
            rng.uniform(-2, 0, 2),
            0.2,
            rng.uniform(-1, 1, (30, 2)),
            *rng.uniform(0, 1, (2, 30)),
        )
        for _ in range(count)
    ]


@compiled
@settings(max_examples=60, deadline=None)
@given(seeds, st.sampled_from([1, 4]), st.sampled_from([0, 3, 12, 100]))
def test_the_best_places_are_those_of_the_twin(seed: int, stride: int, kept: int) -> None:
    assert COMPILED is not None
    rng = np.random.default_rng(seed)
    parts, table = some_views(rng, 5), rng.normal(size=(5, 8))
    ours, theirs = COMPILED.PlaceViews(), PlaceViewsNumpy()
    for part in parts[1:]:
        assert ours.add(COMPILED.PlaceView(*part)) == theirs.add(PlaceViewNumpy(*part))
    ours.remove(1)
    theirs.remove(1)
    slots = rng.choice([0, 2, 3], 40)
    motions = np.column_stack([rng.normal(size=(40, 2)), rng.uniform(-np.pi, np.pi, 40)])
    asked = slots, motions, table, stride, kept, 10
    found = ours.best(COMPILED.PlaceView(*parts[0]), *asked)
    expected = theirs.best(PlaceViewNumpy(*parts[0]), *asked)
    np.testing.assert_array_equal(found[0], expected[0])
    np.testing.assert_allclose(found[1], expected[1], atol=1e-9)
    assert len(found[0]) == min(kept, 10)


def stores() -> list[tuple[type, type]]:
    twins: list[tuple[type, type]] = [(PlaceViewsNumpy, PlaceViewNumpy)]
    return twins if COMPILED is None else [*twins, (COMPILED.PlaceViews, COMPILED.PlaceView)]


@pytest.mark.parametrize(("make", "view"), stores())
def test_of_a_view_that_is_forgotten_nothing_is_told(make: type, view: type) -> None:
    rng = np.random.default_rng(1)
    one, other = (view(*part) for part in some_views(rng, 2))
    store = make()
    slot = store.add(one)
    motions, table = np.zeros((1, 3)), np.ones((5, 8))
    asked = other, np.array([slot]), motions, table, 1, 5, 5
    assert len(store.best(*asked)[0]) == 1
    store.remove(slot)
    with pytest.raises(ValueError, match="slot"):
        store.best(*asked)
    with pytest.raises(ValueError, match="slot"):
        store.remove(slot)
    assert store.add(other) == slot + 1


def makes() -> list[type]:
    return [ShapeIndexNumpy, *([] if COMPILED is None else [COMPILED.ShapeIndex])]


@pytest.mark.parametrize("make", makes())
def test_words_in_another_frame_vote_for_the_motion_between(make: type) -> None:
    rng = np.random.default_rng(3)
    words, kind = some_words(rng, 40)
    index = make(*SETTINGS)
    for _ in range(3):
        index.add(*some_words(rng, 40))
    right = index.add(words, kind)
    seen = moved(words, 3.0, -2.0, 1.0)
    slots, transforms, _ = index.places(
        seen, kind, np.zeros(2), np.ones(4, dtype=np.uint8), 100_000, 5, 0.35, 0.1
    )
    assert slots[0] == right
    back = moved(seen, *transforms[0].tolist())
    np.testing.assert_allclose(back[:, :2], words[:, :2], atol=0.3)


@pytest.mark.parametrize("make", makes())
def test_a_map_that_was_removed_is_found_no_more(make: type) -> None:
    words, kind = some_words(np.random.default_rng(3), 40)
    index = make(*SETTINGS)
    index.add(words, kind)
    index.remove(0)
    found = index.places(
        words, kind, np.zeros(2), np.ones(1, dtype=np.uint8), 100_000, 5, 0.35, 0.1
    )
    assert len(found[0]) == 0
    with pytest.raises(ValueError, match="slot"):
        index.remove(0)


@pytest.mark.parametrize("make", makes())
def test_where_words_are_many_the_rarest_are_looked_at(make: type) -> None:
    rng = np.random.default_rng(3)
    common = some_words(rng, 1)
    rare = some_words(rng, 1)
    index = make(*SETTINGS)
    for _ in range(20):
        index.add(*common)
    index.add(*rare)
    words, kind = (np.concatenate(parts) for parts in zip(common, rare, strict=True))
    found = index.places(words, kind, np.zeros(2), np.ones(21, dtype=np.uint8), 10, 5, 0.35, 0.1)
    assert found[0].tolist() == [20]


def a_raster(rng: np.random.Generator, walls: int, metres: float = 1.0) -> Parts:
    """Return codes, origin, cell and samples of a map of 32 directions."""
    shape = rng.integers(1, 40, 2)
    codes = rng.integers(0, 34, shape).astype(np.uint8)
    codes[rng.random(shape) < 0.6] = 32
    origin = rng.normal(0, 3, 2)
    places = origin + rng.uniform(0.01, 0.99, (walls, 2)) * shape * 0.2
    return (
        codes,
        origin,
        0.2,
        places,
        rng.random(walls),
        rng.uniform(0, metres, walls),
    )


@compiled
@settings(max_examples=30, deadline=None)
@given(seeds, st.sampled_from([0, 1, 40]), st.sampled_from([0, 3, 1000]), st.sampled_from([1, 30]))
def test_shifts_count_the_same(seed: int, walls: int, count: int, metres: float) -> None:
    """However many metres a sample stands for: sums of sixteen bits hold some 40 m."""
    assert COMPILED is not None
    rng = np.random.default_rng(seed)
    maps = [a_raster(rng, n, metres) for n in (walls, 40)]
    asked = rng.uniform(-np.pi, np.pi, 3), 0.4, 32, 5, count
    ours = COMPILED.best_shifts(*(COMPILED.PlaceView(*m) for m in maps), *asked)
    theirs = best_shifts_numpy(PlaceViewNumpy(*maps[0]), PlaceViewNumpy(*maps[1]), *asked)
    for a, b in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-9, rtol=1e-9)


@compiled
@settings(max_examples=30, deadline=None)
@given(seeds)
def test_mirrored_maps_are_the_same(seed: int) -> None:
    """Told by what their shifts count: upside down twice a map is as it was."""
    assert COMPILED is not None
    rng = np.random.default_rng(seed)
    parts, asked = [a_raster(rng, 40) for _ in range(2)], (rng.uniform(-3, 3, 3), 0.4, 32, 5, 20)
    ours, theirs = ([make(*m) for m in parts] for make in (COMPILED.PlaceView, PlaceViewNumpy))
    found = COMPILED.best_shifts(ours[0], ours[1].mirrored(32), *asked)
    twin = best_shifts_numpy(theirs[0], theirs[1].mirrored(32), *asked)
    again = COMPILED.best_shifts(ours[0], ours[1].mirrored(32).mirrored(32), *asked)
    for a, b in (
        *zip(found, twin, strict=True),
        *zip(again, COMPILED.best_shifts(*ours, *asked), strict=True),
    ):
        np.testing.assert_allclose(a, b, atol=1e-9, rtol=1e-9)


@compiled
def test_cells_too_wide_for_their_sums_are_refused() -> None:
    assert COMPILED is not None
    view = COMPILED.PlaceView(*a_raster(np.random.default_rng(1), 1))
    with pytest.raises(ValueError, match="fewer cells"):
        COMPILED.best_shifts(view, view, np.zeros(1), 30.0, 32, 1, 1)


@compiled
def test_walls_beyond_their_raster_are_refused_by_both() -> None:
    assert COMPILED is not None
    codes, origin, cell, points, *walls = a_raster(np.random.default_rng(1), 1)
    view = codes, origin, cell, points + np.array([100.0, 0]), *walls
    asked = np.zeros(1), 0.4, 32, 5, 1
    with pytest.raises(ValueError, match="inside of the raster"):
        COMPILED.best_shifts(COMPILED.PlaceView(*view), COMPILED.PlaceView(*view), *asked)
    with pytest.raises(ValueError, match="inside of the raster"):
        best_shifts_numpy(PlaceViewNumpy(*view), PlaceViewNumpy(*view), *asked)


@compiled
@settings(max_examples=30, deadline=None)
@given(seeds, st.sampled_from([1, 40]))
def test_cells_say_the_same(seed: int, samples: int) -> None:
    rng = np.random.default_rng(seed)
    nearest = rng.integers(0, samples, (9, 13)).astype(np.int32)
    distance, depth = rng.uniform(0, 1, (2, 9, 13)).astype(np.float32)
    asked = nearest, distance, depth, rng.uniform(0, 1, samples), 0.25, 0.3, 64
    np.testing.assert_array_equal(cell_codes(*asked), cell_codes_numpy(*asked))
