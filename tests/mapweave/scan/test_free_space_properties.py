"""Free space as rings: cut up, united and rasterised it stays the same set, whatever its shape."""

from random import Random

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import Polygon

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.matching.distance_field import fill_polygons
from mapweave.scan.free_space import FreeSpaceParameters, from_rings, rings, unite
from tests.mapweave.buildings import rectangle

WHOLE = st.integers(0, 12)
SIZE = st.integers(1, 6)


def box(left: int, bottom: int, width: int, height: int) -> FloatArray:
    return rectangle(left, bottom, left + width, bottom + height)


BOXES = st.lists(st.builds(box, WHOLE, WHOLE, SIZE, SIZE), min_size=1, max_size=8)
MOTIONS = st.tuples(st.floats(-20, 20), st.floats(-20, 20), st.floats(-3, 3)).map(np.array)


def difference(one: shapely.Geometry, other: shapely.Geometry) -> float:
    """Return the area [m²] that is in one of two sets only."""
    return float(shapely.symmetric_difference(one, other).area)


@given(BOXES)
def test_a_union_covers_its_parts_and_no_more(boxes: list[FloatArray]) -> None:
    united = from_rings(boxes)
    cells = {(x, y) for b in boxes for x in range(*_span(b, 0)) for y in range(*_span(b, 1))}
    assert united.area == pytest.approx(len(cells))
    assert all(
        difference(shapely.intersection(united, Polygon(b)), Polygon(b)) < 1e-9 for b in boxes
    )


def _span(ring: FloatArray, axis: int) -> tuple[int, int]:
    return int(ring[:, axis].min()), int(ring[:, axis].max())


@given(BOXES, st.randoms(use_true_random=False))
def test_the_order_of_rings_and_where_each_begins_do_not_matter(
    boxes: list[FloatArray], random: Random
) -> None:
    shuffled = [np.roll(ring, random.randrange(4), axis=0) for ring in boxes]
    random.shuffle(shuffled)
    assert difference(from_rings(shuffled), from_rings(boxes)) < 1e-9


@given(BOXES, BOXES)
def test_rings_are_simple_and_cover_what_they_are_of(
    boxes: list[FloatArray], holes: list[FloatArray]
) -> None:
    """A yard with holes of any shape: rings have none, so that each is a list of corners."""
    yard = from_rings([rectangle(-1, -1, 12, 12), *boxes])
    space = shapely.difference(yard, from_rings(holes))
    outlines = rings(space)
    assert all(Polygon(ring).is_valid and Polygon(ring).area > 0 for ring in outlines)
    assert sum(Polygon(ring).area for ring in outlines) == pytest.approx(space.area, abs=1e-9)
    assert difference(from_rings(outlines), space) < 1e-9


@given(st.integers(0, 2**32 - 1), MOTIONS)
def test_free_space_moves_as_its_corners_do(seed: int, motion: FloatArray) -> None:
    """Of boxes in no special position."""
    rng = np.random.default_rng(seed)
    corners = np.sort(rng.uniform(0, 9, (6, 2, 2)), axis=1)
    boxes = [rectangle(*low, *high) for low, high in corners]
    here = from_rings(boxes)
    moved = shapely.transform(here, lambda points: se2.transform_points(motion, points))
    there = from_rings([se2.transform_points(motion, ring) for ring in boxes])
    assert difference(moved, there) < 1e-6


@given(BOXES)
def test_unions_are_never_larger_than_their_parts_and_united_again_stay(
    boxes: list[FloatArray],
) -> None:
    """But for the tolerance by which outlines are simplified: along a metre, 0.1 m² at the most."""
    parameters = FreeSpaceParameters()
    once = unite(boxes, parameters)
    assert difference(once, from_rings(boxes)) <= parameters.simplification * once.length
    again = unite(rings(once), parameters)
    assert difference(once, again) <= parameters.simplification * once.length
    lost = parameters.cell / 2 * once.length  # half a cell of its edge, at corners
    assert again.area >= once.area - parameters.min_area - lost


@given(BOXES, MOTIONS, st.sampled_from([0.25, 0.4, 1.0]))
def test_a_cell_is_filled_exactly_when_its_centre_is_inside(
    boxes: list[FloatArray], motion: FloatArray, cell: float
) -> None:
    """Of centres that no outline passes within rounding."""
    outlines = [se2.transform_points(motion, ring) for ring in boxes]
    corners = np.vstack(outlines)
    origin = corners.min(axis=0) - 0.7
    shape = np.ceil((corners.max(axis=0) + 0.7 - origin) / cell).astype(np.int64)
    filled = fill_polygons(outlines, origin, cell, shape)
    index = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    centres = shapely.points(origin + cell * (index + 0.5))
    edges = shapely.union_all([Polygon(ring).exterior for ring in outlines])
    clear = shapely.distance(centres, edges) > 1e-6
    inside = np.any([shapely.contains(Polygon(ring), centres) for ring in outlines], axis=0)
    np.testing.assert_array_equal(filled[clear], inside[clear])
