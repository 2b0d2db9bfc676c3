"""A single scan is found in the whole of a known map, or nowhere: not at a look-alike."""

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.mapping.localization.known_map import KnownMap
from mapweave.mapping.localization.scan_finder import ScanFinder
from mapweave.mapping.tracking.observation import ObservationParameters, observe
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from tests.mapweave.buildings import BUILDING, part, random_pose, scans_along, shaken

WAY = [(3, 1), (13, 1), (13, -3), (13, 1), (18, 1), (18, 4), (18, 1), (28, 1)]


def known(lines: LineMap) -> KnownMap:
    """Return a map of `lines`, a little off, of a robot that stood still."""
    path = Trajectory(np.arange(3), np.full(3, np.nan), np.zeros((3, 3)))
    noisy = shaken(lines, np.random.default_rng(1))
    return KnownMap.of(RobotMap("a", "0", 4, (Submap(0, 2, np.zeros(3), noisy, path),)))


@pytest.mark.parametrize("seed", [1, 2])
def test_single_scans_are_found_where_they_were_taken_or_not_at_all(seed: int) -> None:
    frame = random_pose(np.random.default_rng(seed))
    finder = ScanFinder(known(part(BUILDING, 0, 30).moved(se2.inverse(frame))))
    scans, poses = scans_along(BUILDING, WAY, seed)
    found = 0
    for scan, pose in list(zip(scans, poses, strict=True))[::10]:
        place = finder.find(observe(scan, ObservationParameters()))
        if place is not None:
            x, y, turn = se2.between(se2.between(frame, pose), place.pose)
            assert place.component == 2
            assert np.hypot(x, y) < 0.2 and abs(turn) < 0.05
            found += 1
    assert found >= 0.5 * len(scans[::10])


def test_of_two_rooms_that_look_alike_a_scan_is_in_neither() -> None:
    there = part(BUILDING, 0, 30)
    both = LineMap.union([there, there.moved(np.array([60.0, 0.0, 0.0]))])
    finder = ScanFinder(known(both))
    scans, _ = scans_along(BUILDING, WAY, 1)
    assert all(finder.find(observe(s, ObservationParameters())) is None for s in scans[::20])


def test_in_an_empty_map_a_scan_is_nowhere() -> None:
    scans, _ = scans_along(BUILDING, WAY, 1)
    finder = ScanFinder(KnownMap(()))
    assert finder.find(observe(scans[0], ObservationParameters())) is None
