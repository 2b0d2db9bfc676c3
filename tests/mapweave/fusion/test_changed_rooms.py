"""A room whose furniture was moved is the room it was; two rooms that look alike are two."""

from pathlib import Path

import numpy as np
import pytest
import shapely
import shapely.affinity
from numpy.random import Generator

from mapweave.fusion.align import align, align_maps
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.io.readers import read_scans
from mapweave.mapping.mapper import Mapper
from mapweave.maps import Alignment, LineMap, RobotMap
from mapweave.scan.free_space import rings
from tests.mapweave.buildings import BUILDING, MARGIN, line_map, random_pose, shaken, walls_of

CASES = Path(__file__).parents[2] / "cases"
BOXES = 14  # on each visit
NONE = np.empty((0, 4))


def map_of(case: str, log: str, robot: str) -> RobotMap:
    mapper = Mapper(robot)
    for scan in read_scans(CASES / case / log):
        mapper.add(scan)
    return mapper.finish()


def off(alignment: Alignment, truth: FloatArray) -> float:
    """Return by how much an alignment is off [m], ten metres from the frame's origin."""
    corners = np.array([[10.0, 0.0], [-10.0, 0.0], [0.0, 10.0]])
    apart = se2.transform_points(alignment.transform, corners) - se2.transform_points(
        truth, corners
    )
    return float(np.hypot(*apart.T).max())


def test_two_visits_between_which_furniture_was_moved_are_joined() -> None:
    (found,) = align(
        map_of("furniture", "monday.log.gz", "a"), map_of("furniture", "friday.log.gz", "b")
    )
    assert found.decision == "accepted"
    assert found.evidence.common is not None and found.evidence.common > 40
    assert off(found, np.zeros(3)) < 0.1


def test_two_rooms_that_look_alike_are_not_joined_by_what_lies_inside() -> None:
    (found,) = align(
        map_of("twin_rooms", "room201-inside-only.log.gz", "a"),
        map_of("twin_rooms", "room202-inside-only.log.gz", "b"),
    )
    assert found.decision != "accepted" and found.confidence < 0.85


@pytest.mark.parametrize("second", ["room202.log.gz", "room202-inside-only.log.gz"])
def test_two_rooms_that_look_alike_are_not_joined_by_a_corridor_that_looks_alike_as_well(
    second: str,
) -> None:
    (found,) = align(map_of("twin_rooms", "room201.log.gz", "a"), map_of("twin_rooms", second, "b"))
    if found.decision == "accepted":  # they are across the corridor from each other, half a turn
        assert abs(found.transform[2]) == pytest.approx(np.pi, abs=0.1)
        assert np.hypot(*found.transform[:2]) == pytest.approx(13, abs=0.5)


def furnished(rng: Generator, partitions: FloatArray = NONE) -> LineMap:
    """Return a building with boxes of up to 1 m anywhere in it, and (k, 4) `partitions`."""
    building = shapely.Polygon(BUILDING)
    boxes: list[shapely.Polygon] = []
    while len(boxes) < BOXES:
        x, y, width, depth, turn = rng.uniform([0, -4, 0.3, 0.3, 0], [30, 6, 0.9, 0.9, 90])
        box = shapely.affinity.rotate(shapely.box(x, y, x + width, y + depth), turn)
        if building.buffer(-0.4).contains(box) and all(box.distance(b) > 0.5 for b in boxes):
            boxes.append(box)
    solid = shapely.union_all(boxes)
    free = building.buffer(-MARGIN).difference(solid.buffer(MARGIN))
    walls = [walls_of(BUILDING)]
    walls += [walls_of(np.array(b.exterior.coords)[:-1][::-1]) for b in boxes]
    parts = shapely.MultiLineString(partitions.reshape(-1, 2, 2).tolist())
    free = free.difference(parts.buffer(MARGIN))
    return line_map(np.vstack([*walls, partitions]), rings(free))


@pytest.mark.parametrize("seed", range(5))
def test_a_building_whose_boxes_were_all_moved_is_the_same_building(seed: int) -> None:
    rng = np.random.default_rng(seed)
    moved = random_pose(rng)
    first, second = (shaken(furnished(rng), rng) for _ in range(2))
    found = align_maps(("a/0", first), ("b/0", second.moved(moved)))
    assert found.decision == "accepted"
    assert off(found, se2.inverse(moved)) < 0.3


@pytest.mark.parametrize("seed", range(5))
def test_walls_that_are_gone_count_in_full(seed: int) -> None:
    """Across three rooms and the corridor, of two faces: as much as seven boxes have."""
    rng = np.random.default_rng(seed)
    walls = np.array([[x, y, x, y + 2.2] for x, y in ((3.5, -2.8), (13, -4), (24, -2.9), (8, 0))])
    walls[:, [0, 2]] += rng.uniform(-0.2, 0.2)
    walls = np.vstack([walls, walls[:, [2, 3, 0, 1]]])
    parted = furnished(np.random.default_rng(seed), walls)
    there, gone = (
        align_maps(("a/0", parted), ("b/0", other))
        for other in (
            furnished(np.random.default_rng(seed), walls),
            furnished(np.random.default_rng(seed)),
        )
    )
    assert there.decision == "accepted" and there.evidence.contradicted == 0
    assert gone.decision == "refused"
    assert gone.evidence.contradicted is not None and gone.evidence.contradicted > 7
