"""The scans of a submap move to where they fit each other and the walls that stay."""

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.tracking.observation import ObservationParameters, observe
from mapweave.maps import LineMap
from mapweave.matching.multiview_icp import MultiviewIcpParameters, refine
from mapweave.scan.points import OrientedPoints, join_points, points_on_lines
from tests.mapweave.buildings import BUILDING, FRONT, cast, line_map, random_pose, tour, walls_of

SIGMAS = np.array([0.03, 0.03, 0.01])  # [m, m, rad] by which each scan is off
NOTHING = points_on_lines(LineMap.empty(), 0.1)[0]


@pytest.fixture
def true() -> FloatArray:
    """Return poses through a building with alcoves."""
    return np.array(list(tour([(1, 1), (3.5, 1), (3.5, -2), (3.5, 1), (9, 1)], 0.4)))


@pytest.fixture
def seen(true: FloatArray, rng: Generator) -> list[OrientedPoints]:
    """Return what was seen from each pose, sensor frame."""
    scans = [cast(walls_of(BUILDING), pose, angles=FRONT, noise=rng) for pose in true]
    return [observe(scan, ObservationParameters()).oriented for scan in scans]


def walls(frame: FloatArray) -> OrientedPoints:
    """Return the true walls in the frame at the pose `frame` (3,)."""
    lines = line_map(se2.transform_segments(se2.inverse(frame), walls_of(BUILDING)), ())
    return points_on_lines(lines, 0.1)[0]


def errors(true: FloatArray, found: FloatArray) -> FloatArray:
    """(n,) how far [m] each pose is from the true one, both relative to the first."""
    off = se2.between(se2.between(true[0], true), se2.between(found[0], found))
    return np.hypot(off[:, 0], off[:, 1])


def test_scans_that_were_placed_badly_come_to_fit_each_other(
    seen: list[OrientedPoints], true: FloatArray, rng: Generator
) -> None:
    off = se2.compose(true, rng.normal(0, SIGMAS, true.shape))
    found = refine(seen, off, NOTHING)
    assert errors(true, found).mean() < 0.5 * errors(true, off).mean()
    assert np.abs(found - true)[:, 2].mean() < 0.01


def test_walls_that_stay_say_where_all_of_it_is(
    seen: list[OrientedPoints], true: FloatArray, rng: Generator
) -> None:
    off = se2.compose(true, rng.normal(0, SIGMAS, true.shape)) + np.array([0.05, -0.05, 0])
    found = refine(seen, off, walls(se2.IDENTITY))
    assert np.hypot(*(found - true)[:, :2].T).mean() < 0.02


def test_what_is_known_exactly_stays(seen: list[OrientedPoints], true: FloatArray) -> None:
    found = refine(seen, true, walls(se2.IDENTITY))
    assert np.hypot(*(found - true)[:, :2].T).max() < 0.03


def test_moving_everything_moves_the_result_and_no_more(
    seen: list[OrientedPoints], true: FloatArray, rng: Generator
) -> None:
    off = se2.compose(true, rng.normal(0, SIGMAS, true.shape))
    motion = random_pose(rng)
    here = refine(seen, off, walls(se2.IDENTITY))
    there = refine(seen, se2.compose(motion, off), walls(se2.IDENTITY).moved(motion))
    np.testing.assert_allclose(se2.between(motion, there), here, atol=2e-3)


def test_where_there_is_nothing_to_see_tracking_is_kept(true: FloatArray) -> None:
    np.testing.assert_allclose(refine([NOTHING] * len(true), true, NOTHING), true, atol=1e-9)


def test_a_single_scan_without_walls_stays(seen: list[OrientedPoints], true: FloatArray) -> None:
    np.testing.assert_allclose(refine(seen[:1], true[:1], NOTHING), true[:1], atol=1e-9)


def test_a_scan_that_tracking_put_beside_its_place_is_moved_to_where_the_others_have_it(
    seen: list[OrientedPoints], true: FloatArray
) -> None:
    """A step off by three sigmas, as one into another minimum, is not held against all that see."""
    for k in (4, 8, 12):
        off = true.copy()
        off[k] += [0.1, -0.1, 0.06]
        found = refine(seen, off, NOTHING)
        assert errors(true, found)[k] < 0.02
        assert abs(se2.between(true[0], true[k])[2] - se2.between(found[0], found[k])[2]) < 0.004


def test_along_a_bare_corridor_the_tracked_steps_are_kept() -> None:
    """Its walls say nothing of how far along it the scans were; only tracking does."""
    corridor = line_map(np.array([[-40.0, -1, 40, -1], [40, 1, -40, 1]]), ())
    bare = points_on_lines(corridor, 0.1)[0]
    tracked = np.array([[0.5 * k, 0.03 * (-1) ** k, 0.0] for k in range(8)])
    oriented = [bare.at(np.abs(bare.points[:, 0]) < 5)] * len(tracked)
    found = refine(oriented, tracked, bare, MultiviewIcpParameters(max_points=100))
    np.testing.assert_allclose(found[:, 0], tracked[:, 0], atol=0.01)
    assert np.abs(found[:, 1]).max() < 0.5 * 0.03


def test_what_follows_does_not_come_off_where_one_step_is_far_off() -> None:
    """Two rooms, one of which was mapped 0.5 m aside: the path between them bends, all along."""
    room = line_map(
        np.array([[-3.0, -2, 3, -2], [3, -2, 3, 2], [3, 2, -3, 2], [-3, 2, -3, -2]]), ()
    )
    sight, other, aside = points_on_lines(room, 0.1)[0], np.array([50.0, 0, 0]), 0.5
    tracked = np.array([[0.1 * k, 0.0, 0.0] for k in range(10)])
    seen = [sight.moved(se2.inverse(pose)) for pose in tracked[:5]]
    seen += [sight.moved(se2.between(pose, other)) for pose in tracked[5:]]
    mapped = join_points([sight, sight.moved(other + np.array([aside, 0.0, 0.0]))])
    p = MultiviewIcpParameters(noise=0.5, scales=(1e3,) * 8, partners=60)
    moved = (refine(seen, tracked, mapped, p) - tracked)[:, 0]
    assert moved[-1] > 0.3
    assert np.diff(moved).max() < 0.25 * aside
