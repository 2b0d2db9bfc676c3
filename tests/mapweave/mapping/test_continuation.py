"""A run that goes on from a stored map."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mapweave.anchors import anchored, placed_marks
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.io.map_files import read_map, write_map
from mapweave.io.readers import read_scans
from mapweave.mapping.continuation import links_to_keep
from mapweave.mapping.mapper import Mapper
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave.marks import Anchor, Mark
from mapweave.scan.scan import Scan
from tests.mapweave.buildings import BUILDING, OTHER_BUILDING, scans_along

THERE = [(3, 1), (13, 1), (13, -3), (13, 1), (18, 1), (18, 4), (18, 1), (28, 1)]
AND_BACK = [(27, 1), (18, 1), (18, 4), (18, 1), (13, 1), (13, -3), (13, 1), (3, 1)]


def mapped(scans: list[Scan], known: RobotMap | None = None) -> RobotMap:
    mapper = Mapper("r1", known=known)
    for scan in scans:
        mapper.add(scan)
    return mapper.finish()


def where(robot_map: RobotMap) -> dict[int, tuple[int, FloatArray]]:
    return {
        int(index): (s.component, se2.compose(s.pose, pose))
        for s in robot_map.submaps
        for index, pose in zip(s.trajectory.scan_index, s.trajectory.pose, strict=True)
    }


def test_a_second_run_is_joined_to_the_first_by_what_both_saw() -> None:
    first, truth = scans_along(BUILDING, THERE, 1)
    second, later = scans_along(BUILDING, AND_BACK, 2, first=len(first))
    after = mapped(second, mapped(first))
    found = where(after)
    assert {component for component, _ in found.values()} == {0}
    poses = np.array([se2.compose(truth[0], found[k][1]) for k in range(len(found))])
    apart = np.hypot(*(poses - np.vstack([truth, later]))[:, :2].T)
    assert len(apart) == len(first) + len(second)
    assert apart.max() < 0.1


def test_a_second_run_elsewhere_stays_a_component_of_its_own_and_the_first_as_it_was() -> None:
    before = mapped(scans_along(BUILDING, THERE, 1)[0])
    elsewhere = scans_along(OTHER_BUILDING, [(2, 1), (24, 1)], 2, first=500)[0]
    after = mapped(elsewhere, before)
    assert after.components == [0, 1]
    for then, now in zip(before.submaps, after.submaps, strict=False):
        np.testing.assert_array_equal(then.pose, now.pose)
        assert then.map is now.map


def test_scans_that_are_counted_from_zero_again_are_counted_on() -> None:
    before = mapped(scans_along(BUILDING, THERE, 1)[0])
    count = 1 + max(where(before))
    again = scans_along(BUILDING, AND_BACK, 2)[0]
    assert again[0].index == 0
    assert sorted(where(mapped(again, before))) == list(range(count + len(again)))


def test_scans_with_later_numbers_keep_them() -> None:
    before = mapped(scans_along(BUILDING, THERE, 1)[0])
    later = scans_along(BUILDING, AND_BACK, 2, first=1000)[0]
    assert max(where(mapped(later, before))) == 999 + len(later)


def test_marks_of_the_stored_map_go_on_with_it() -> None:
    first, _ = scans_along(BUILDING, THERE, 1)
    before = mapped(first)
    found = anchored(before.submaps, 0, np.array([4.0, 0.5]))
    assert found is not None
    held_by_scan = Mark("m1", "victim", "anna", 5.0, *found)
    last = before.submaps[-1]
    held_by_submap = Mark("m2", "door", "anna", 5.0, Anchor(last.id + 7, None), np.zeros(2))
    renumbered = tuple(replace(s, id=s.id + 7) for s in before.submaps)
    stored = replace(before, submaps=renumbered, marks=(held_by_scan, held_by_submap))
    second, _ = scans_along(BUILDING, AND_BACK, 2, first=len(first))
    after = mapped(second[:20], stored)
    victim, door = placed_marks(after)
    np.testing.assert_allclose(victim.position, [4.0, 0.5], atol=0.1)
    np.testing.assert_allclose(door.position, after.submaps[last.id].pose[:2], atol=1e-9)


def at(number: int, x: float, component: int = 0) -> Submap:
    return Submap(number, component, np.array([x, 0, 0]), LineMap.empty(), Trajectory.empty())


def test_submaps_are_held_together_by_those_that_follow_and_those_that_are_near() -> None:
    submaps = [at(0, 0), at(1, 10), at(2, 0, component=1), at(3, 20), at(4, 2), at(5, 1, 1)]
    pairs = {(a.id, b.id) for a, b in links_to_keep(submaps, 6.0)}
    assert pairs == {(0, 1), (1, 3), (3, 4), (0, 4), (2, 5)}


@pytest.mark.slow
def test_fr079_in_two_halves_is_fr079_in_one(data_dir: Path, tmp_path: Path) -> None:
    """Through files: each scan within 0.05 m, once the frames are laid on each other."""
    scans = list(read_scans(data_dir / "fr079.log.gz"))
    half = len(scans) // 2
    write_map(tmp_path / "first.json", mapped(scans[:half]))
    whole = where(mapped(scans))
    halves = where(mapped(scans[half:], read_map(tmp_path / "first.json")))
    assert set(whole) == set(halves)
    assert {component for component, _ in halves.values()} == {0}
    one, other = (np.array([w[k][1][:2] for k in sorted(w)]) for w in (whole, halves))
    centred = one - one.mean(axis=0), other - other.mean(axis=0)
    cross = centred[1].T @ centred[0]
    turn = np.arctan2(cross[0, 1] - cross[1, 0], cross[0, 0] + cross[1, 1])
    apart = np.hypot(*(centred[1] @ se2.rotation(turn).T - centred[0]).T)
    assert apart.max() < 0.05
    assert np.sqrt((apart**2).mean()) < 0.015
    assert np.sqrt(((one - other) ** 2).sum(axis=1).mean()) < 0.05  # as they lie
