"""The simplest map: few segments, nothing true lost, nothing doubled, corners met."""

import numpy as np
from numpy.random import Generator
from shapely.geometry import Polygon

from benchmarks.compactness import compactness
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray, IntArray
from mapweave.geometry.segments import units
from mapweave.lines.fitting import FittingParameters
from mapweave.lines.merging import evolve
from mapweave.lines.simplification import SimplificationParameters, simplify, sources
from tests.mapweave.buildings import BUILDING, random_pose, rectangle, walls_of

WALLS = walls_of(BUILDING)


def sightings(walls: FloatArray, scans: int, rng: Generator) -> FloatArray:
    """Return what noisy scans saw of `walls`: 2 cm off, and each only a part."""
    parts = []
    for _ in range(scans):
        low, high = np.sort(rng.uniform(-0.4, 1.4, (2, len(walls))), axis=0).clip(0, 1)[..., None]
        along = walls[:, 2:] - walls[:, :2]
        seen = np.hstack([walls[:, :2] + low * along, walls[:, :2] + high * along])
        seen += rng.normal(0, 0.02, seen.shape)
        parts.append(seen[units(seen)[1] > 0.1])
    return np.concatenate(parts)


def simplified(seen: FloatArray) -> FloatArray:
    once: IntArray = np.ones(len(seen), dtype=np.int64)
    return simplify(evolve(seen).segments, seen, once, Polygon())


def off(found: FloatArray, walls: FloatArray) -> FloatArray:
    """Return how far the nearest of `found` is from each of `walls`, ends compared [m]."""
    return np.asarray(np.abs(found[:, None] - walls).max(axis=-1).min(axis=0))


def test_a_building_is_one_segment_a_wall_and_its_corners_meet(rng: Generator) -> None:
    found = simplified(sightings(WALLS, 25, rng))
    assert len(found) == len(WALLS)
    assert off(found, WALLS).max() < 0.1
    starts = {tuple(np.round(start, 6)) for start in found[:, :2]}
    assert sum(tuple(np.round(end, 6)) in starts for end in found[:, 2:]) == len(WALLS)


def test_the_shape_does_not_depend_on_the_frame(rng: Generator) -> None:
    seen, motion = sightings(WALLS, 25, rng), random_pose(rng)
    here, there = simplified(seen), simplified(se2.transform_segments(motion, seen))
    assert len(there) == len(here)
    assert off(there, se2.transform_segments(motion, here)).max() < 0.1


def test_a_wall_remembered_at_two_places_is_drawn_once(rng: Generator) -> None:
    seen = sightings(WALLS, 25, rng)
    ghost = sightings(WALLS[[0, 2]] + np.array([0.0, 0.18, 0.0, 0.18]), 5, rng)
    found = simplified(np.concatenate([seen, ghost]))
    assert compactness(found).doubled < 0.01
    assert off(found, WALLS).max() < 0.12


def test_a_crumb_goes_and_a_small_true_wall_stays(rng: Generator) -> None:
    pillar = walls_of(rectangle(15, 0.8, 15.4, 1.2)[::-1])
    seen = sightings(np.concatenate([WALLS, pillar]), 25, rng)
    crumb = np.array([[8.0, 1.0, 8.2, 1.1]])
    found = simplified(np.concatenate([seen, crumb]))
    assert off(found, pillar).max() < 0.1
    assert off(found, crumb).max() > 0.5


def test_a_recess_that_merging_drew_through_is_found_again() -> None:
    """What the chosen walls do not explain proposes walls anew."""
    wall = np.array([[0.0, 0, 2, 0], [2.0, -0.15, 3, -0.15], [3.0, 0, 5, 0]])
    seen = np.tile(wall, (6, 1))
    once: IntArray = np.ones(len(seen), dtype=np.int64)
    found = simplify(np.array([[0.0, -0.02, 5, -0.02]]), seen, once, Polygon())
    assert off(found, wall).max() < 0.12


def test_sources_are_the_sightings_along_a_segment_and_not_those_across_or_behind() -> None:
    walls = np.array([[0.0, 0, 4, 0], [4.0, 0, 4, 3]])
    seen = np.array([[0.5, 0.02, 3, 0], [3.95, 0, 4, 3], [4.0, -0.05, 0, -0.05], [0, 1, 4, 1]])
    segment, source = sources(walls, seen)
    assert list(zip(segment, source, strict=True)) == [(0, 0), (1, 1)]


def test_nothing_seen_makes_no_wall() -> None:
    nothing = np.empty((0, 4))
    assert simplify(nothing, nothing, np.empty(0, dtype=np.int64), Polygon()).shape == (0, 4)


def test_sources_lie_as_near_as_what_a_segment_was_placed_by() -> None:
    wall, seen = np.array([[0.0, 0, 4, 0]]), np.array([[0.0, 0.08, 4, 0.08]])
    for tolerance, count in ((0.07, 0), (0.09, 1)):
        p = SimplificationParameters(placement=FittingParameters(tolerance=tolerance))
        assert [len(found) for found in sources(wall, seen, p)] == [count, count]
