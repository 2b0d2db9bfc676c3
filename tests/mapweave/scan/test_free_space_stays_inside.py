"""Free space never reaches beyond what was seen: after no step, whatever the room and the view."""

from itertools import pairwise

import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.scan.free_space import (
    FreeSpaceParameters,
    free_cells,
    from_rings,
    rings,
    seen_free,
    unite,
)
from mapweave.scan.scan import Scan
from mapweave.scan.visibility import sights_of
from mapweave_protocol.wire.coding.free_space_code import CodedFreeSpace
from tests.mapweave.buildings import cast, rectangle, walls_of

P = FreeSpaceParameters()
WEDGE = np.array([[0, -1], [5, -0.1], [5, 0.1], [0, 1]])  # at its end narrower than `min_width`
CELL = 2 * P.cell  # [m] of the rasters that free space is looked up in
WIRE = 0.3  # [m]: `clearance`, from which free space counts against a wall
EXAMPLES = settings(max_examples=40, deadline=None)
SEEDS = st.integers(0, 2**32 - 1)


def beyond(free: BaseGeometry, seen: BaseGeometry) -> float:
    """Return how far `free` goes beyond what was `seen` [m]."""
    outside = shapely.get_coordinates(shapely.difference(free, seen))
    return float(shapely.distance(shapely.points(outside), seen).max(initial=0.0))


def covered(scan: Scan, pose: FloatArray) -> BaseGeometry:
    """Return what lies between neighbouring beams of `scan`, up to what they hit."""
    reach = np.minimum(np.nan_to_num(scan.ranges, nan=0.0), P.sight)
    ends = reach[:, None] * np.column_stack([np.cos(scan.angles), np.sin(scan.angles)])
    at = se2.transform_points(pose, ends)
    fan = [Polygon([pose[:2], a, b]) for a, b in pairwise(at)]
    return shapely.union_all(shapely.make_valid(fan))


def views(seed: int) -> tuple[list[Scan], FloatArray, BaseGeometry]:
    """Return narrow and wide views into a room with crates, their poses, and what they cover."""
    rng = np.random.default_rng(seed)
    crates = [
        shapely.affinity.rotate(Polygon(rectangle(x, y, x + w, y + h)), turn)
        for x, y, w, h, turn in rng.uniform([1, 1, 0.2, 0.2, 0], [6, 6, 1.5, 1.5, 90], (4, 5))
    ]
    inside = Polygon(rectangle(0, 0, *rng.uniform(5, 9, 2))).difference(shapely.union_all(crates))
    outlines = shapely.get_rings(shapely.orient_polygons(shapely.get_parts(inside)))
    walls = np.vstack([walls_of(np.array(ring.coords)[:-1]) for ring in outlines])
    places = rng.uniform(0.4, 4.6, (60, 2))
    free = places[shapely.contains_xy(inside.buffer(-0.05), *places.T)][:3]
    poses = np.column_stack([free, rng.uniform(-np.pi, np.pi, len(free))])
    widths = rng.uniform(0.03, 3.0, len(poses))  # [rad] to either side
    scans = [
        cast(walls, pose, angles=np.arange(-width, width, 0.01))
        for pose, width in zip(poses, widths, strict=True)
    ]
    seen = shapely.union_all([covered(s, pose) for s, pose in zip(scans, poses, strict=True)])
    return scans, poses, seen


@EXAMPLES
@given(SEEDS)
def test_nothing_is_free_that_no_beam_passed(seed: int) -> None:
    scans, poses, seen = views(seed)
    assert beyond(seen_free(sights_of(scans, poses, P.sight), P), seen) <= CELL


@EXAMPLES
@given(SEEDS)
def test_what_is_united_or_sent_goes_on_to_nothing_that_no_beam_passed(seed: int) -> None:
    """Of the wire, by less than its outlines are straightened by."""
    scans, poses, seen = views(seed)
    each = [
        seen_free(sights_of([scan], pose[None], P.sight), P)
        for scan, pose in zip(scans, poses, strict=True)
    ]
    pieces = [ring for free in each for ring in rings(free)]
    assert beyond(unite(pieces, P), seen) <= CELL
    few = P.model_copy(update={"max_cells": 1})  # as polygons
    assert beyond(unite(pieces, few), seen) <= CELL
    arrived = from_rings(CodedFreeSpace.of(pieces, 0, 100.0).restore(0, 100.0))
    assert beyond(arrived, seen) < WIRE


@pytest.mark.parametrize("turn", np.radians([0, 17, 45, 90, 160]))
@pytest.mark.parametrize("max_cells", [1, P.max_cells], ids=["polygons", "cells"])
def test_a_wedge_ends_where_it_gets_narrow(turn: float, max_cells: int) -> None:
    ring = se2.transform_points(np.array([1.0, 2.0, turn]), WEDGE)
    opened = unite([ring], P.model_copy(update={"max_cells": max_cells}))
    assert beyond(opened, Polygon(ring)) <= P.cell
    assert opened.area > 0.9 * Polygon(ring).area


def test_a_wedge_of_a_grid_ends_where_it_gets_narrow() -> None:
    centres = (np.indices((60, 110)) + 0.5) * P.cell
    wedge = shapely.affinity.translate(Polygon(WEDGE), 0.0, 1.5)
    free = shapely.contains_xy(wedge, centres[1], centres[0])
    assert beyond(free_cells(free, P.cell, P), wedge) <= P.cell


@pytest.mark.parametrize("half_width", [0.1, 0.25, 0.35])
def test_a_wedge_that_is_sent_goes_no_further_than_straightening_takes_it(
    half_width: float,
) -> None:
    wedge = np.array([[0, -1], [5, -half_width], [5, half_width], [0, 1]])
    for turn in np.radians(np.arange(0, 180, 7)):
        ring = se2.transform_points(np.array([0.1, 0.2, turn]), wedge)
        arrived = from_rings(CodedFreeSpace.of([ring], 0, 100.0).restore(0, 100.0))
        assert beyond(arrived, Polygon(ring)) < WIRE
