"""Polylines of a scan are recognised in the map by shape, wherever the scan was (paper, V)."""

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.mapping.tracking.observation import ObservationParameters, observe
from mapweave.maps import LineMap
from mapweave.shape.correspondence import CorrespondenceParameters, correspond
from tests.mapweave.buildings import AROUND, BUILDING, cast, line_map, part, walls_of

P = CorrespondenceParameters()
KNOWN = part(BUILDING, 0, 30)
WALLS = walls_of(BUILDING)


def seen_from(pose: np.ndarray[tuple[int], np.dtype[np.float64]], seed: int) -> LineMap:
    noise = np.random.default_rng(seed)
    scan = cast(WALLS, pose, angles=AROUND, noise=noise)
    return observe(scan, ObservationParameters()).lines


PLACES = [[3.0, 0.5], [8.0, 1.5], [13.0, 0.8], [19.0, 1.2], [24.5, 1.0]]


@pytest.mark.parametrize("place", PLACES)
def test_a_scan_from_anywhere_finds_its_place_among_the_first_agreements(
    place: list[float],
) -> None:
    rng = np.random.default_rng(round(place[0]))
    true = np.array([*place, rng.uniform(-np.pi, np.pi)])
    found = correspond(KNOWN, seen_from(true, 3), P)
    off = se2.between(true, np.array([one.transform for one in found]))
    near = (np.hypot(*off[:, :2].T) < 0.5) & (np.abs(off[:, 2]) < 0.1)
    assert near.any()


def test_corresponding_polylines_lie_on_each_other_after_the_motion() -> None:
    """Two islands of wall: the scan of one corresponds to that one and not to the other."""
    hook = np.array([[0.0, 0, 2, 0], [2, 0, 2, 1.5], [2, 1.5, 3.2, 1.5]])
    fork = np.array([[20.0, 0, 21, 2], [21, 2, 22.5, 1], [22.5, 1, 23, 3]])
    known = line_map(np.vstack([hook, fork]))
    seen = line_map(se2.transform_segments(se2.inverse(np.array([5.0, 3, 1.2])), fork))
    best = correspond(known, seen, P)[0]
    np.testing.assert_allclose(best.transform, [5, 3, 1.2], atol=0.05)
    assert best.corresponding.tolist() == [[False], [True]]


def test_a_wall_seen_in_part_corresponds_all_the_same() -> None:
    hook = np.array([[0.0, 0, 4, 0], [4, 0, 4, 1.5], [4, 1.5, 7.2, 1.5]])
    seen = line_map(np.array([[3.0, 0, 4, 0], [4, 0, 4, 1.5], [4, 1.5, 5, 1.5]]))
    best = correspond(line_map(hook), seen, P)[0]
    np.testing.assert_allclose(best.transform, 0, atol=0.1)


def test_straight_walls_alone_correspond_to_nothing() -> None:
    """No shape, no place: a wall's windows all look alike."""
    wall = line_map(np.array([[0.0, 0, 9, 0]]))
    assert correspond(wall, wall, P) == []


def test_nothing_corresponds_to_nothing() -> None:
    assert correspond(LineMap.empty(), KNOWN, P) == []
    assert correspond(KNOWN, LineMap.empty(), P) == []


def test_no_more_than_the_asked_number_is_handed_on_and_all_differ() -> None:
    found = correspond(KNOWN, seen_from(np.array([13.0, 1.0, 0.0]), 5), P)
    assert 0 < len(found) <= P.count
    for k, one in enumerate(found):
        assert one.corresponding.any()
        assert all(not np.allclose(one.transform, other.transform) for other in found[:k])
