"""What was seen to be free: a room is, less a margin; what lies behind a wall is not."""

import numpy as np
import pytest
import shapely
from numpy.random import Generator
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from mapweave.config import Config, Mapping
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.scan.free_space import (
    FreeSpaceParameters,
    from_rings,
    rings,
    seen_free,
    simplified,
    unite,
)
from mapweave.scan.scan import Scan
from mapweave.scan.visibility import sights_of
from tests.mapweave.buildings import (
    AROUND,
    BUILDING,
    FRONT,
    cast,
    random_pose,
    rectangle,
    walls_of,
)

P = FreeSpaceParameters()
CORNERS = rectangle(0, 0, 6, 4)
ROOM = walls_of(CORNERS)
# A wall with a flat bay; begun in it, GEOS takes 0.53 m away where 0.3 m are allowed.
BAY = np.array([(5, -0.28), (5.4, -0.53), (10, 0), (10, 6), (0, 6), (0, 0), (4.6, -0.53)])


def free_of(scan: Scan, pose: FloatArray) -> BaseGeometry:
    """What one scan saw to be free."""
    return seen_free(sights_of([scan], pose[None], P.sight), P)


def test_a_room_seen_from_several_places_is_free_up_to_the_margin() -> None:
    places = [[1, 1, 0], [5, 1, 2], [5, 3, -2], [1, 3, 1], [3, 2, 0]]
    scans = [cast(ROOM, pose, angles=AROUND) for pose in places]
    free = seen_free(sights_of(scans, np.array(places, dtype=float), P.sight), P)
    room = Polygon(CORNERS)
    assert room.buffer(-P.margin + P.simplification).covers(free)  # never nearer to a wall
    shrunk = room.buffer(-2.5 * P.margin)
    assert shapely.difference(shrunk, free).area < 0.01 * shrunk.area


def test_nothing_outside_a_building_is_ever_free(rng: Generator) -> None:
    inside = Polygon(BUILDING)
    for x in rng.uniform(0.5, 29.5, 15):
        pose = np.array([x, rng.uniform(0.4, 1.8), rng.uniform(-np.pi, np.pi)])
        free = free_of(cast(walls_of(BUILDING), pose, noise=rng), pose)
        assert free.area > 1
        assert shapely.difference(free, inside).area == pytest.approx(0, abs=1e-3)


def test_free_space_ends_where_sight_ends() -> None:
    hall = walls_of(rectangle(-50, -50, 50, 50))
    free = free_of(cast(hall, [0, 0, 0], angles=AROUND, max_range=200), np.zeros(3))
    corners = shapely.get_coordinates(free)
    assert np.hypot(*corners.T).max() <= P.sight
    assert free.area == pytest.approx(np.pi * (P.sight - P.margin) ** 2, rel=0.02)


@pytest.mark.parametrize(
    "mapping",
    [Mapping(resolution=1.0), Mapping(clearance=0.05), Mapping(clearance=0.05, resolution=1.0)],
    ids=["coarse", "near walls", "both"],
)
def test_a_raster_coarser_than_its_outline_may_deviate_still_shows_the_room(
    mapping: Mapping,
) -> None:
    """Also where nobody asked for it: large areas are drawn in larger cells."""
    p = FreeSpaceParameters.of(Config(mapping=mapping))
    hall = rectangle(0, 0, 16, 12)
    places = np.array([[4.0, 6, 0], [8, 6, 0], [12, 6, 0]])
    scans = [cast(walls_of(hall), pose, angles=AROUND) for pose in places]
    free = seen_free(sights_of(scans, places, p.sight), p)
    assert Polygon(hall).buffer(0.05).covers(free)
    assert free.area > 0.7 * Polygon(hall).area


def test_beams_that_did_not_come_back_leave_a_gap() -> None:
    """Not a beam nor its neighbours: 10 lost ones open a wedge of 11 steps."""
    scan = cast(ROOM, [1, 2, 0])
    ranges = scan.ranges.copy()
    ranges[85:95] = np.nan
    whole = free_of(scan, np.zeros(3))
    free = free_of(Scan(ranges, scan.angles, 0, 0.0), np.zeros(3))
    wedge = np.radians([-4.9, 3.9])
    for bearing in wedge:
        assert whole.contains(shapely.Point(3 * np.cos(bearing), 3 * np.sin(bearing)))
        assert not free.contains(shapely.Point(3 * np.cos(bearing), 3 * np.sin(bearing)))
    for bearing in np.radians([-8.0, 8.0]):
        assert free.contains(shapely.Point(3 * np.cos(bearing), 3 * np.sin(bearing)))


def test_a_blind_scan_frees_nothing() -> None:
    blind = Scan(np.full(len(FRONT), np.nan), FRONT, 0, 0.0)
    assert free_of(blind, np.zeros(3)).is_empty


def test_free_space_moves_with_the_sensor(rng: Generator) -> None:
    pose, scan = random_pose(rng), cast(ROOM, [2, 1, 0.3])
    here = free_of(scan, np.zeros(3))
    there = free_of(scan, pose)
    back = shapely.transform(there, lambda p: se2.transform_points(se2.inverse(pose), p))
    # The outline may be thinned at other corners, by half the tolerance each.
    assert back.hausdorff_distance(here) < P.simplification


def test_rings_have_no_holes_and_cover_the_same_area() -> None:
    square = Polygon(
        rectangle(0, 0, 9, 9), [rectangle(1, 1, 2, 2), rectangle(4, 4, 6, 7), rectangle(7, 1, 8, 3)]
    )
    outlines = rings(square)
    assert all(Polygon(ring).is_valid and not np.allclose(ring[0], ring[-1]) for ring in outlines)
    assert sum(Polygon(ring).area for ring in outlines) == pytest.approx(square.area)
    assert shapely.symmetric_difference(from_rings(outlines), square).area < 1e-9


def test_what_is_not_free_anywhere_has_no_rings() -> None:
    assert rings(Polygon()) == rings(from_rings([])) == ()


def test_overlapping_rings_are_united_and_slivers_ignored() -> None:
    overlapping = (rectangle(0, 0, 4, 4), rectangle(2, 0, 6, 4), np.array([[0.0, 0.0], [1, 1]]))
    assert from_rings(overlapping).area == pytest.approx(24)
    assert from_rings([]).is_empty


@pytest.mark.parametrize("crumb", [rectangle(20, 0, 20.2, 0.2), rectangle(20, 0, 20.001, 3)])
def test_crumbs_are_left_out_of_the_union(crumb: FloatArray) -> None:
    united = unite([rectangle(0, 0, 4, 4), crumb], P)
    assert united.area == pytest.approx(16, rel=0.03)  # but for the cells at its edge


def test_a_doubled_end_beam_of_a_full_turn_changes_no_free_space() -> None:
    """The fan of a full turn closes on itself."""
    angles = np.linspace(-np.pi, np.pi, 361)
    ranges = 3 + np.cos(angles)
    doubled = free_of(Scan(ranges, angles), np.zeros(3))
    single = free_of(Scan(ranges[:-1], angles[:-1]), np.zeros(3))
    assert doubled.area == pytest.approx(single.area, rel=0.01)
    assert doubled.area == pytest.approx(np.pi * (2.85**2 + 0.5), rel=0.06)
    seam = LineString([[-0.2, 0], [-1.6, 0]])  # where the turn begins and ends
    assert doubled.contains(seam) and single.contains(seam)


def test_an_outline_that_runs_back_along_itself_is_an_area_however_it_is_turned(
    rng: Generator,
) -> None:
    bottom = [[0, 0], [1.7, 0], [1.7, -0.1], [1.85, -0.1], [1.85, 0], [5.41, 0], [5.44, -0.125]]
    back = [[1.2, -0.125], [1.25, -0.1], [1.25, 0], [1.05, 0], [1, -0.125], [0.01, -0.125]]
    outline = np.array([*bottom, *back])
    area = from_rings([outline]).area
    for _ in range(500):
        pose = random_pose(rng)
        turned, beside = (se2.transform_points(pose, part) for part in (outline, outline + 0.05))
        assert from_rings([turned]).area == pytest.approx(area)
        assert area < from_rings([turned, beside]).area < 2 * area


@pytest.mark.parametrize("first", range(len(BAY)))
def test_an_outline_deviates_by_no_more_than_allowed_wherever_it_begins(first: int) -> None:
    room = Polygon(np.roll(BAY, -first, axis=0))
    simpler = simplified(room, 0.3)
    assert shapely.hausdorff_distance(room.boundary, simpler.boundary) <= 0.3
    assert len(simpler.exterior.coords) < len(room.exterior.coords)


def test_an_outline_whose_farthest_corner_may_go_deviates_by_no_more_than_allowed() -> None:
    flat = Polygon([(7, 2), (2, 5), (-5, 5), (-6, -3), (-5, -4), (-4, -5), (7, -1)])
    simpler = simplified(flat, 3.0)
    assert shapely.hausdorff_distance(flat.boundary, simpler.boundary) <= 3.0


def test_outlines_put_together_deviate_by_no_more_than_allowed(rng: Generator) -> None:
    """They begin anywhere, and one of five would go beyond it."""
    angles = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    for _ in range(40):
        radii = rng.uniform(2.7, 3.3, (4, 60, 1))
        ends = radii * np.column_stack([np.cos(angles), np.sin(angles)])
        seen = from_rings(ends + rng.uniform(0, 4, (4, 1, 2)))
        edges = simplified(seen, 0.3).boundary
        corners = shapely.points(shapely.get_coordinates(seen))
        assert shapely.distance(edges, corners).max() <= 0.3 + 1e-9


def test_lines_and_points_beside_an_area_do_not_count() -> None:
    room = Polygon(BAY)
    mixed = shapely.GeometryCollection([LineString([(50, 0), (50, 9)]), room, shapely.Point(99, 9)])
    areas = shapely.get_parts(simplified(mixed, 0.3))
    assert [q for q in areas if q.area] == [simplified(room, 0.3)]
