"""A raster knows the nearest wall and how deep in the free space each place is."""

import numpy as np
import pytest
import shapely
from numpy.random import Generator
from scipy.spatial import ConvexHull
from shapely.geometry import Polygon

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import LineMap
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters, fill_polygons
from tests.mapweave.buildings import BUILDING, corridor, line_map, part, rectangle, walls_of

P = DistanceFieldParameters()


def star(rng: Generator, corners: int) -> FloatArray:
    """Return the (k, 2) corners of a random simple polygon: as seen from a point inside."""
    bearing = np.sort(rng.uniform(0, 2 * np.pi, corners))
    reach = rng.uniform(1, 6, (corners, 1))
    return np.asarray(reach * np.column_stack([np.cos(bearing), np.sin(bearing)]))


def assert_filled_as_by_shapely(polygon: FloatArray) -> None:
    origin, cell, shape = np.array([-7.3, -7.1]), 0.23, np.array([64, 61])
    filled = fill_polygons([polygon], origin, cell, shape)
    rows, columns = np.indices(tuple(shape))
    centres = origin + cell * (np.stack([rows, columns], axis=-1) + 0.5)
    outline = Polygon(polygon)
    inside = shapely.contains_xy(outline, centres[..., 0], centres[..., 1])
    # A centre on the outline may count as either.
    on_it = shapely.distance(outline.exterior, shapely.points(centres)) < 1e-9
    np.testing.assert_array_equal(filled[~on_it], inside[~on_it])


@pytest.mark.parametrize("seed", range(12))
def test_random_simple_polygons_are_filled_as_by_shapely(seed: int) -> None:
    rng = np.random.default_rng(seed)
    assert_filled_as_by_shapely(star(rng, 3 + 2 * seed))
    assert_filled_as_by_shapely(star(rng, 5)[::-1])  # clockwise
    points = rng.uniform(-6, 6, (8, 2))
    assert_filled_as_by_shapely(points[ConvexHull(points).vertices])


def test_polygons_that_reach_beyond_the_raster_are_filled_within() -> None:
    assert_filled_as_by_shapely(rectangle(-20, -3, 20, 30))
    assert_filled_as_by_shapely(rectangle(-20, -20, 20, 20))


def test_walls_along_the_axes_and_through_centres_fill_exactly() -> None:
    """An outline through cell centres counts each centre once, however polygons are split."""
    left, right = rectangle(0.5, 0.5, 2.5, 4.5), rectangle(2.5, 0.5, 5.5, 4.5)
    shape = np.array([8, 8])
    both = fill_polygons([left, right], np.zeros(2), 1.0, shape)
    whole = fill_polygons([rectangle(0.5, 0.5, 5.5, 4.5)], np.zeros(2), 1.0, shape)
    np.testing.assert_array_equal(both, whole)
    assert whole.sum() == 20


def test_overlapping_polygons_are_filled_once() -> None:
    shape = np.array([10, 10])
    twice = fill_polygons([rectangle(1, 1, 6, 6), rectangle(3, 3, 8, 8)], np.zeros(2), 1.0, shape)
    assert twice.sum() == 25 + 25 - 9


def test_a_place_is_as_deep_in_free_space_as_it_is_far_from_its_edge(rng: Generator) -> None:
    raster = DistanceField.of(
        line_map(walls_of(rectangle(0, 0, 8, 5)), (rectangle(0, 0, 8, 5),)), P
    )
    points = rng.uniform([-0.5, -0.5], [8.5, 5.5], (300, 2))
    _, _, depth = raster.look_up(points)
    true = np.minimum(points, [8, 5] - points).min(axis=1).clip(0)
    assert np.abs(depth - true).max() < 1.5 * P.cell


def test_the_nearest_wall_is_the_nearest_sample(rng: Generator) -> None:
    raster = DistanceField.of(part(BUILDING, 0, 14), P)
    points = rng.uniform([0, -5], [14, 6], (300, 2))
    nearest, distance, _ = raster.look_up(points)
    brute = np.hypot(*(points[:, None] - raster.oriented.points).transpose(2, 0, 1))
    assert np.abs(distance - brute.min(axis=1)).max() < 1.5 * P.cell
    assert np.abs(brute[np.arange(300), nearest] - brute.min(axis=1)).max() < 2 * P.cell


def test_beyond_the_raster_there_is_no_wall_and_no_free_space() -> None:
    raster = DistanceField.of(part(BUILDING, 0, 14), P)
    _, distance, depth = raster.look_up(np.array([[-99.0, 0.0], [1e5, 1e5], [5.0, 60.0]]))
    assert np.isinf(distance).all() and (depth == 0).all()


def test_the_samples_stand_for_the_wall_they_are_of() -> None:
    lines = part(BUILDING, 0, 30)
    raster = DistanceField.of(lines, P)
    lengths = np.hypot(*(lines.segments[:, 2:] - lines.segments[:, :2]).T)
    np.testing.assert_allclose(np.bincount(raster.segment, weights=raster.weight), lengths)


def test_a_wall_that_only_one_scan_saw_counts_half() -> None:
    lines = part(BUILDING, 0, 30)
    once = LineMap(lines.segments, lines.polyline, np.ones_like(lines.support), lines.free_space)
    np.testing.assert_allclose(
        DistanceField.of(once, P).weight, DistanceField.of(lines, P).weight / 2
    )


def test_a_large_map_gets_coarser_cells_instead_of_more() -> None:
    walls = se2.transform_segments(np.array([0, 0, 0.7]), walls_of(corridor(300, [], [])))
    few = DistanceFieldParameters(max_cells=40_000)
    raster = DistanceField.of(line_map(walls), few)
    assert raster.cell > few.cell
    assert raster.distance.size < 1.02 * few.max_cells
