"""What comparing maps takes: the compiled kernels compute what their NumPy twins do."""

import numpy as np
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st

from mapweave.kernels.arrays import FloatArray
from mapweave.kernels.loading import COMPILED
from mapweave.kernels.matching import (
    corners,
    distinct,
    fields,
    judging,
    marks,
    nearness,
    parts,
    raster_icp,
    rasters,
    standing,
    windows,
)

pytestmark = pytest.mark.skipif(COMPILED is None, reason="no compiled kernels here")
seeds = st.integers(0, 2**32 - 1)
counts = st.sampled_from([0, 1, 2, 30])
some = st.sampled_from([1, 2, 30])
ORIGIN, CELL = np.array([-1.5, -2.0]), 0.2


def same(one: object, other: object) -> None:
    """Check that two results, or two tuples of them, agree."""
    results = (x if isinstance(x, tuple) else (x,) for x in (one, other))
    for a, b in zip(*results, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-9, rtol=1e-9)


def units(rng: np.random.Generator, count: int) -> FloatArray:
    angle = rng.uniform(-np.pi, np.pi, count)
    return np.column_stack([np.cos(angle), np.sin(angle)])


def some_places(rng: np.random.Generator, count: int) -> FloatArray:
    return rng.uniform(-1.2, 1.2, (count, 2))


def a_polygon(rng: np.random.Generator, corners_: int) -> FloatArray:
    """A star: simple, about some place in or beyond the raster."""
    angle = np.sort(rng.uniform(0, 2 * np.pi, corners_))
    reach = rng.uniform(0.1, 2.0, (corners_, 1))
    rim = reach * np.column_stack([np.cos(angle), np.sin(angle)])
    return np.asarray(rng.uniform(-2, 2, 2) + rim, dtype=np.float64)


def some_walls(rng: np.random.Generator, count: int) -> FloatArray:
    """Lines of half a metre, many of them near each other, one without length."""
    starts = some_places(rng, count)
    return np.hstack([starts, starts + 0.5 * units(rng, count) * (np.arange(count) > 0)[:, None]])


@settings(max_examples=60, deadline=None)
@given(seeds, some, st.sampled_from([0.0, 0.05, 0.5, 3.0]), st.sampled_from([20, 1_000_000]))
def test_maps_are_rasterised_alike(seed: int, count: int, same_wall: float, cells: int) -> None:
    """Of samples equally near a cell another may be told, but no nearer one."""
    rng = np.random.default_rng(seed)
    free = tuple(a_polygon(rng, 5) for _ in range(count % 3))
    asked = some_walls(rng, count), rng.integers(0, 4, count), free, 0.2, 2, same_wall, 0.8, 0.7
    found = fields.rasterised(*asked, 0.2, cells)
    twin = fields.rasterised_numpy(*asked, 0.2, cells)
    for name in set(found._fields) - {"nearest"}:
        np.testing.assert_allclose(getattr(found, name), getattr(twin, name), atol=1e-9, rtol=1e-9)
    cell = np.floor((found.points - found.origin) / found.cell)
    here = np.stack(np.meshgrid(*map(np.arange, found.nearest.shape), indexing="ij"), axis=-1)
    away = np.hypot(*np.moveaxis(cell[found.nearest] - here, -1, 0)) * found.cell
    np.testing.assert_allclose(away, found.distance, rtol=1e-6)


@settings(max_examples=40, deadline=None)
@given(seeds, st.integers(0, 4), st.integers(3, 12))
def test_the_same_cells_are_filled(seed: int, count: int, corners_: int) -> None:
    rng = np.random.default_rng(seed)
    asked = [a_polygon(rng, corners_) for _ in range(count)], ORIGIN, CELL, 16, 21
    np.testing.assert_array_equal(rasters.filled_cells(*asked), rasters.filled_cells_numpy(*asked))


@settings(max_examples=40, deadline=None)
@given(seeds, counts, some, counts)
def test_samples_find_the_same_in_a_raster(seed: int, count: int, walls: int, starts: int) -> None:
    rng = np.random.default_rng(seed)
    there, facing = some_places(rng, walls), units(rng, walls)
    nearest, distance = rasters.nearest_samples_numpy(there, ORIGIN, CELL, 16, 21)
    depth = rng.uniform(0, 1, nearest.shape).astype(np.float32)
    points, normals = 1.5 * some_places(rng, count), units(rng, count)
    pose = rng.normal(0, 0.3, 3)
    samples = judging.Samples(points, normals, rng.uniform(0, 1, count).astype(np.float32))
    raster = judging.Raster(facing, nearest, distance, depth, ORIGIN, CELL)
    asked = pose, raster, judging.Limits(0.3, 0.5, 0.4)
    same(judging.judge_samples(samples, *asked), judging.judge_samples_numpy(samples, *asked))
    poses, scales = rng.normal(0, 0.3, (starts, 3)), np.geomspace(0.5, 0.1, 4)
    for most in (1, 7, 100):
        moved = points, normals, most, poses, scales, there, facing, nearest, ORIGIN, CELL, 0.7, 0.3
        same(raster_icp.align_on_raster(*moved), raster_icp.align_on_raster_numpy(*moved))


def a_map(rng: np.random.Generator, count: int) -> judging.WeighedMap:
    points, normals = some_places(rng, count), units(rng, count)
    nearest, distance = rasters.nearest_samples_numpy(points, ORIGIN, CELL, 16, 21)
    depth, own = (rng.uniform(0, 1, n).astype(np.float32) for n in (nearest.shape, count))
    raster = judging.Raster(normals, nearest, distance, depth, ORIGIN, CELL)
    weight, missing = rng.uniform(0, 1, (2, count))
    return judging.WeighedMap(judging.Samples(points, normals, own), weight, missing, raster)


@settings(max_examples=40, deadline=None)
@given(seeds, some, some)
def test_maps_weigh_the_same_in_each_other(seed: int, one: int, two: int) -> None:
    rng = np.random.default_rng(seed)
    asked = a_map(rng, one), a_map(rng, two), rng.normal(0, 0.3, 3), judging.Limits(0.3, 0.5, 0.4)
    for found, twin in zip(
        judging.weigh_maps(*asked), judging.weigh_maps_numpy(*asked), strict=True
    ):
        same(tuple(found), tuple(twin))


@settings(max_examples=40, deadline=None)
@given(seeds, counts)
def test_the_same_walls_make_corners(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    walls = np.hstack([start := some_places(rng, count), start + 0.7 * units(rng, count)])
    same(corners.corner_pairs(walls, 1.0, 0.6), corners.corner_pairs_numpy(walls, 1.0, 0.6))


def some_corners(rng: np.random.Generator, count: int) -> corners.Frames:
    frame = np.hstack([4 * some_places(rng, count), rng.uniform(-np.pi, np.pi, (count, 1))])
    angle = np.pi / 2 + rng.normal(0, 0.05, count)
    return corners.Frames(frame, angle, rng.uniform(0.4, 3, count))


@settings(max_examples=40, deadline=None)
@given(seeds, counts, counts, st.sampled_from([3, 1000]))
def test_the_same_transforms_are_proposed_most(seed: int, one: int, two: int, most: int) -> None:
    rng = np.random.default_rng(seed)
    asked = some_corners(rng, one), some_corners(rng, two), 0.09, 0.4, 0.09, most
    same(corners.most_proposed(*asked), corners.most_proposed_numpy(*asked))


def some_windows(rng: np.random.Generator, count: int) -> windows.WindowSamples:
    place = np.cumsum(rng.integers(1, 3, count)).astype(np.int64)
    return windows.WindowSamples(rng.uniform(0, 0.9, count), place, rng.normal(0, 1, (count, 5, 2)))


@settings(max_examples=40, deadline=None)
@given(seeds, counts, counts)
def test_the_same_windows_are_alike(seed: int, one: int, two: int) -> None:
    rng = np.random.default_rng(seed)
    rows, columns = some_windows(rng, one), some_windows(rng, two)
    size = rng.choice([0.75, 0.9, 1.0], (one, two))  # equals among them
    product = size * np.exp(1j * rng.uniform(-np.pi, np.pi, (one, two)))
    asked = product, rows, columns, 0.7, -0.1
    same(tuple(windows.alike_windows(*asked)), tuple(windows.alike_windows_numpy(*asked)))


@settings(max_examples=40, deadline=None)
@given(seeds, st.integers(1, 12), counts)
def test_windows_are_sampled_alike(seed: int, walls: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    segments = rng.uniform(-3, 3, (walls, 4))
    segments[0, 2:] = segments[0, :2]  # of no length
    begin = np.sort(rng.uniform(0, 3, count))  # the last ones beyond the end
    asked = segments, begin, 1.5, 7
    codes, points = windows.sample_windows(*asked)
    twin_codes, twin_points = windows.sample_windows_numpy(*asked)
    np.testing.assert_allclose(codes, twin_codes, rtol=0, atol=1e-9)
    np.testing.assert_allclose(points, twin_points, rtol=0, atol=1e-9)


@settings(max_examples=40, deadline=None)
@given(seeds, counts, st.sampled_from([0, 1, 5, 50]))
def test_the_same_transforms_agree(seed: int, count: int, most: int) -> None:
    rng = np.random.default_rng(seed)
    asked = some_places(rng, count), rng.uniform(-4, 4, count), most, 1.0, 0.6
    for one, other in zip(distinct.agreeing(*asked), distinct.agreeing_numpy(*asked), strict=True):
        np.testing.assert_array_equal(one, other)


@settings(max_examples=40, deadline=None)
@given(seeds, counts, counts, counts, st.booleans())
def test_maps_put_the_same_into_cells(
    seed: int, wall: int, near: int, seen: int, is_reference: bool
) -> None:
    rng = np.random.default_rng(seed)
    at, normal = (
        [(f(rng, n) @ np.array([1, 1j])).astype(np.complex128) for n in (wall, near, seen)]
        for f in (some_places, units)
    )
    places = marks.Places(at[0], normal[0], rng.uniform(0, 1, wall), at[1], normal[1], at[2])
    asked = places, ORIGIN, 0.5, (6, 7), 0.25, 2.5, is_reference
    np.testing.assert_allclose(
        marks.mark_cells(*asked), marks.mark_cells_numpy(*asked), rtol=1e-5, atol=1e-6
    )


@settings(max_examples=40, deadline=None)
@given(seeds, counts, st.sampled_from([1, 5, 50]))
def test_the_same_transforms_are_distinct(seed: int, count: int, most: int) -> None:
    rng = np.random.default_rng(seed)
    scores = rng.integers(0, 9, count).astype(np.float64)  # equals among them
    poses = np.column_stack([some_places(rng, count), rng.uniform(-4, 4, count)])
    asked = poses, scores, np.array([0.4, -0.3]), most, 0.5, 0.3
    np.testing.assert_array_equal(distinct.distinct(*asked), distinct.distinct_numpy(*asked))


def test_lengths_that_do_not_agree_are_told() -> None:
    points, normals = np.zeros((3, 2)), np.zeros((2, 2))
    nearest = np.zeros((2, 2), dtype=np.int32)
    asked = points, normals, 9, np.zeros((1, 3)), np.ones(1), points, points, nearest
    for align in (raster_icp.align_on_raster, raster_icp.align_on_raster_numpy):
        with pytest.raises(ValueError, match="expected"):
            align(*asked, ORIGIN, CELL, 0.7, 0.3)


@settings(max_examples=40, deadline=None)
@given(seeds, some, st.sampled_from([0, 1, 20, 10_000]))
def test_grids_are_correlated_alike(seed: int, rows: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    parts = rng.integers(-3, 4, (4, 3, rows, 7)).astype(
        np.float32
    )  # whole: exact, equals among them
    here, there = (parts[:2] + 1j * parts[2:]).astype(np.complex64)
    product = marks.conjugate_products(here, there)
    np.testing.assert_array_equal(product, marks.conjugate_products_numpy(here, there))
    np.testing.assert_array_equal(
        marks.highest(product, count), marks.highest_numpy(product, count)
    )


@settings(max_examples=60, deadline=None)
@given(seeds, some, st.sampled_from([0.0, CELL / 4, CELL, 1.5 * CELL]))
def test_the_same_things_stand_free(seed: int, count: int, reach: float) -> None:
    """Distances of whole cells and limits of as many are told apart alike."""
    rng = np.random.default_rng(seed)
    points = np.repeat(some_places(rng, count), 5, axis=0) + rng.uniform(-0.2, 0.2, (5 * count, 2))
    _, distance = rasters.nearest_samples_numpy(points, ORIGIN, CELL, 15, 20)
    for side in (0.1, 0.4, 1.1):
        asked = points, ORIGIN, CELL, distance, reach, side
        found = standing.standing_free(*asked)
        np.testing.assert_array_equal(found, standing.standing_free_numpy(*asked))


@pytest.mark.parametrize("outside", [[-9.0, 0.0], [0.0, 9.0], [np.nan, 0.0]])
def test_what_stands_outside_of_the_raster_is_refused(outside: list[float]) -> None:
    distance = np.zeros((15, 20), dtype=np.float32)
    with pytest.raises(ValueError, match="inside of the raster"):
        standing.standing_free(np.array([outside]), ORIGIN, CELL, distance, 0.1, 1.0)


@settings(max_examples=40, deadline=None)
@given(seeds, st.sampled_from([(1, 1), (7, 9), (30, 20)]), st.sampled_from([0.0, 0.1, 0.5, 1.0]))
def test_cells_fall_into_the_same_parts(seed: int, shape: tuple[int, int], share: float) -> None:
    """And the nearest part is as near."""
    chosen = np.random.default_rng(seed).random(shape) < share
    label, nearest = parts.nearest_parts(chosen)
    twin, other = parts.nearest_parts_numpy(chosen)
    np.testing.assert_array_equal(label, twin)
    np.testing.assert_array_equal(nearest == 0, other == 0)
    least = scipy.ndimage.distance_transform_edt(label == 0)
    for number in range(1, int(label.max(initial=0)) + 1):
        apart = scipy.ndimage.distance_transform_edt(label != number)
        for named in (nearest, other):
            np.testing.assert_allclose(apart[named == number], least[named == number])


@settings(max_examples=40, deadline=None)
@given(seeds, counts, counts)
def test_the_nearest_points_are_as_far(seed: int, count: int, places: int) -> None:
    rng = np.random.default_rng(seed)
    asked = rng.normal(0, 5, (count, 2)), rng.normal(0, 9, (places, 2))
    same(nearness.nearest_distances(*asked), nearness.nearest_distances_numpy(*asked))
