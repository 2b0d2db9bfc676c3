"""The mapper follows a robot from its scans alone, notices when it is lost, and finds it again."""

import copy
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from numpy.random import Generator

from mapweave.errors import InvalidIdError
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.io.map_files import write_map
from mapweave.io.readers import read_reference_poses, read_scans
from mapweave.mapping.backend import BackendResult, FinishedSubmap
from mapweave.mapping.mapper import AGAIN, AT_ONCE, Mapper
from mapweave.mapping.placement import Placement
from mapweave.mapping.tracking.observation import Observation
from mapweave.mapping.tracking.tracker import Found, Tracker
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave.scan.scan import Scan
from tests.mapweave.buildings import (
    BUILDING,
    FRONT,
    OTHER_BUILDING,
    cast,
    scans_along,
    tour,
    walls_of,
)

TOUR = [(1, 1), (3.5, 1), (3.5, -2), (3.5, 1), (13, 1), (13, -3), (13, 1), (18, 1.2)]
BLOCKED = 3  # scans in a row that show another place: fewer than a robot is lost after


@dataclass(frozen=True)
class Run:
    """Scans, where they were taken, what the mapper said of each, and the map."""

    scans: list[Scan]
    true: FloatArray
    placements: list[Placement]
    map: RobotMap


def run(scans: list[Scan], true: FloatArray) -> Run:
    mapper = Mapper("a")
    placements = [mapper.add(scan) for scan in scans]
    return Run(scans, true, placements, mapper.finish())


@pytest.fixture(scope="session")
def followed() -> Run:
    """Return a tour through the building."""
    return run(*scans_along(BUILDING, TOUR, 1))


@pytest.fixture(scope="session")
def kidnapped() -> Run:
    """Return a tour that jumps into another building, and comes back to the first."""
    out, first = scans_along(BUILDING, TOUR[:5], 1)
    away, second = scans_along(
        OTHER_BUILDING, [(5, 1.5), (9, 1.5), (9, -3), (9, 1.5), (14, 1.5)], 2
    )
    back, third = scans_along(BUILDING, [(16, 1.1), (13, 1.1), (2.5, 0.9)], 3)
    scans = [*out, *away, *back]
    numbered = [Scan(s.ranges, s.angles, k, s.stamp) for k, s in enumerate(scans)]
    return run(numbered, np.vstack([first, second, third]))


def placed(robot_map: RobotMap) -> dict[int, tuple[int, FloatArray]]:
    """Return component and pose in it of each scan; each stands in one trajectory once."""
    where: dict[int, tuple[int, FloatArray]] = {}
    for submap in robot_map.submaps:
        poses = se2.compose(submap.pose, submap.trajectory.pose)
        for index, pose in zip(submap.trajectory.scan_index.tolist(), poses, strict=True):
            assert index not in where
            where[index] = (submap.component, pose)
    return where


def steps_right(indices: list[int], poses: FloatArray, true: FloatArray) -> float:
    """Return the share of consecutive steps right within 0.25 m and 5°; all poses (n, 3)."""
    consecutive = np.diff(indices) == 1
    step = se2.between(poses[:-1], poses[1:])[consecutive]
    off = se2.between(se2.between(true[:-1], true[1:])[consecutive], step)
    right = (np.hypot(*off[:, :2].T) <= 0.25) & (np.abs(np.degrees(off[:, 2])) <= 5)
    return float(right.mean())


def off_the_walls(
    robot_map: RobotMap, component: int, origin: FloatArray, walls: FloatArray
) -> FloatArray:
    """(n,) how far [m] samples of the map's wall are from `walls`, mapped from `origin` (3,)."""
    segments = se2.transform_segments(origin, robot_map.lines(component).segments)
    shares = np.linspace(0, 1, 5)[:, None, None]
    samples = (segments[:, :2] + shares * (segments[:, 2:] - segments[:, :2])).reshape(-1, 2)
    lines = shapely.multilinestrings(shapely.linestrings(walls.reshape(-1, 2, 2)))
    return np.asarray(shapely.distance(shapely.points(samples), lines))


def test_a_tour_is_followed_from_its_first_to_its_last_scan(followed: Run) -> None:
    where = placed(followed.map)
    assert sorted(where) == list(range(len(followed.scans)))
    assert all(component == 0 for component, _ in where.values())
    poses = np.array([where[k][1] for k in range(len(followed.scans))])
    assert steps_right(sorted(where), poses, followed.true) == 1.0
    off = se2.between(se2.between(followed.true[0], followed.true), poses)
    assert np.hypot(*off[:, :2].T).max() < 0.3
    assert np.degrees(np.abs(off[:, 2])).max() < 2


def test_what_was_mapped_are_the_walls_of_the_building(followed: Run) -> None:
    off = off_the_walls(followed.map, 0, followed.true[0], walls_of(BUILDING))
    assert np.median(off) < 0.05
    assert np.quantile(off, 0.95) < 0.3


def test_lines_are_few_however_many_scans_saw_them(followed: Run) -> None:
    """Hundreds of sightings, tens of segments, most of them seen again and again."""
    lines = followed.map.lines(0)
    assert len(lines.segments) < 3 * len(BUILDING)
    assert np.median(lines.support) > 5


def test_submaps_are_of_a_bounded_path_and_number_from_0(followed: Run) -> None:
    assert len(followed.map.submaps) >= 2
    assert [s.id for s in followed.map.submaps] == list(range(len(followed.map.submaps)))
    for submap in followed.map.submaps:
        path = np.hypot(*np.diff(submap.trajectory.pose[:, :2], axis=0).T).sum()
        assert path < 14
        # Its frame is where its first scan was tracked to; refined, the scan is nearly there.
        np.testing.assert_allclose(submap.trajectory.pose[0], 0, atol=0.1)


def test_a_placement_says_when_a_submap_was_finished(followed: Run) -> None:
    finished = sum(p.submap_finished for p in followed.placements)
    assert finished == len(followed.map.submaps) - 1  # the last is finished by the end
    assert all(p.placed and not p.lost for p in followed.placements)


def test_a_placement_says_where_the_scan_is_in_the_component_at_that_time() -> None:
    scans, _ = scans_along(BUILDING, TOUR[:4], 1)
    mapper = Mapper("a")
    for scan in [*scans[:20], *scans[25:]]:  # a gap, after which it has to be found again
        placement = mapper.add(scan)
        submaps = mapper.robot_map().submaps
        at = {
            int(index): (s, pose)
            for s in submaps
            for index, pose in zip(s.trajectory.scan_index, s.trajectory.pose, strict=True)
        }
        assert placement.placed == (placement.pose is not None) == (scan.index in at)
        if placement.pose is not None and placement.uncertainty is not None:
            submap, pose = at[scan.index]
            expected = se2.compose(submap.pose, pose)
            np.testing.assert_allclose(se2.between(expected, placement.pose), 0, atol=1e-9)
            assert submap.trajectory.uncertainty is not None
            held = submap.trajectory.uncertainty[submap.trajectory.scan_index == scan.index][0]
            np.testing.assert_allclose(placement.uncertainty[:3], held[:3])
            turned = placement.uncertainty[3] - held[3] - submap.pose[2]
            assert np.sin(turned) == pytest.approx(0, abs=1e-9)


def test_a_snapshot_is_drawn_as_the_map_was_then_however_far_the_robot_has_driven_on() -> None:
    scans, _ = scans_along(BUILDING, TOUR[:5], 1)
    mapper, then = Mapper("a"), []
    for scan in scans:
        mapper.add(scan)
        if scan.index % 15 == 0:
            then.append((mapper.snapshot(), mapper.robot_map()))
    assert len({len(drawn.submaps) for _, drawn in then}) > 1
    for snapshot, expected in then:
        drawn = snapshot.robot_map()
        assert (drawn.version, len(drawn.submaps)) == (expected.version, len(expected.submaps))
        for submap, other in zip(drawn.submaps, expected.submaps, strict=True):
            np.testing.assert_array_equal(submap.map.segments, other.map.segments)
            np.testing.assert_array_equal(submap.trajectory.pose, other.trajectory.pose)


def test_a_kidnapped_robot_starts_a_component_where_nothing_fits(kidnapped: Run) -> None:
    assert sum(p.lost for p in kidnapped.placements) >= 1
    where = placed(kidnapped.map)
    out = len(scans_along(BUILDING, TOUR[:5], 1)[0])
    before, after = where[out - 1][0], where[out + 15][0]
    assert before == 0 and after != 0


def test_a_loss_holds_nobody_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """What waited is placed with the scans that come next, two with each, however many waited."""
    asked = 0
    place = Tracker.place

    def counted(tracker: Tracker, seen: Observation, known: Callable[[], LineMap]) -> Found:
        nonlocal asked
        asked += 1
        return place(tracker, seen, known)

    monkeypatch.setattr(Tracker, "place", counted)
    mapper, costs, lost = Mapper("a"), [], 0
    for scan in jumping():
        asked = 0
        lost += mapper.add(scan).lost
        costs.append(asked)
    assert lost and max(costs) == AT_ONCE < mapper.parameters.patience
    assert costs[-1] == 1  # it has caught up


def test_what_was_missed_is_tried_two_with_each_scan_once_the_robot_is_found_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The map is the same as if all were tried at once, and no scan waits in the end."""
    tried = 0
    revisit = Tracker.revisit

    def counted(tracker: Tracker, seen: Observation, near: FloatArray, reach: float) -> object:
        nonlocal tried
        tried += 1
        return revisit(tracker, seen, near, reach)

    monkeypatch.setattr(Tracker, "revisit", counted)
    mapper, costs, where = Mapper("a"), [], list[bool]()
    for scan in blocked():
        tried = 0
        where.append(mapper.add(scan).placed)
        costs.append(tried)
    assert sum(costs) == BLOCKED > max(costs) == AT_ONCE
    assert where[-1]
    prompt = Mapper("a", prompt=True)
    for scan in blocked():
        prompt.add(scan)
    for submap, other in zip(mapper.finish().submaps, prompt.finish().submaps, strict=True):
        np.testing.assert_array_equal(submap.map.segments, other.map.segments)
        np.testing.assert_array_equal(submap.trajectory.pose, other.trajectory.pose)


@pytest.mark.parametrize(("late", "most"), [(30, 1), (2, AGAIN)])
def test_beside_a_scan_that_is_looked_for_everywhere_none_is_placed_unless_many_wait(
    monkeypatch: pytest.MonkeyPatch, late: int, most: int
) -> None:
    placed = 0
    place = Mapper._place

    def noted(mapper: Mapper, seen: Observation) -> bool:
        nonlocal placed
        placed += 1
        found = place(mapper, seen)
        mapper._tracker.searched = True
        return found

    monkeypatch.setattr(Mapper, "_place", noted)
    monkeypatch.setattr("mapweave.mapping.mapper.LATE", late)
    mapper, costs, lost = Mapper("a"), [], 0
    for scan in jumping():
        placed = 0
        lost += mapper.add(scan).lost
        costs.append(placed)
    assert lost and max(costs) == most


def blocked() -> list[Scan]:
    """Return scans of a robot that sees another place for a moment."""
    scans, _ = scans_along(BUILDING, TOUR[:5], 1)
    others, _ = scans_along(OTHER_BUILDING, [(5, 1.5), (9, 1.5)], 2)
    first = len(scans) // 2
    for k in range(BLOCKED):
        scans[first + k] = replace(others[k], index=first + k, stamp=scans[first + k].stamp)
    return scans


def test_a_map_that_ends_with_a_loss_holds_the_scans_that_waited() -> None:
    mapper, scans = Mapper("a"), jumping()
    last = next(scan.index for scan in scans if mapper.add(scan).lost)
    where = placed(mapper.finish())
    assert where[last][0] == where[last - 1][0] != 0


def jumping() -> list[Scan]:
    """Return scans of a robot that is carried into another building."""
    here, _ = scans_along(BUILDING, TOUR[:2], 1)
    there, _ = scans_along(OTHER_BUILDING, [(5, 1.5), (9, 1.5), (9, -3), (9, 1.5)], 2)
    return [*here, *(replace(scan, index=scan.index + len(here)) for scan in there)]


def test_a_robot_that_comes_back_is_reunited_with_what_it_knew(kidnapped: Run) -> None:
    where = placed(kidnapped.map)
    first, last = where[0], where[len(kidnapped.scans) - 1]
    assert first[0] == last[0] == 0
    true = se2.between(kidnapped.true[0], kidnapped.true[-1])
    off = se2.between(true, se2.between(first[1], last[1]))
    assert np.hypot(off[0], off[1]) < 0.4 and np.degrees(abs(off[2])) < 2


def test_what_was_seen_elsewhere_stays_out_of_the_first_building(kidnapped: Run) -> None:
    assert len(kidnapped.map.components) == 2
    off = off_the_walls(kidnapped.map, 0, kidnapped.true[0], walls_of(BUILDING))
    assert np.quantile(off, 0.95) < 0.4


def test_no_scan_is_placed_twice_and_none_of_the_tour_is_lost(kidnapped: Run) -> None:
    where = placed(kidnapped.map)
    assert len(where) >= len(kidnapped.scans) - 3  # at the jumps a few may fit nowhere


def test_a_blind_scan_is_not_placed_and_loses_nothing() -> None:
    """A robot that looked into the void for a while goes on where it was."""
    scans, _ = scans_along(BUILDING, [(2, 1), (6, 1)], 4)
    void = np.full(len(FRONT), np.nan)
    blind = [Scan(void, FRONT, 6 + k) for k in range(8)]
    after = [Scan(s.ranges, s.angles, s.index + 8, s.stamp) for s in scans[6:]]
    mapper = Mapper("a")
    said = [mapper.add(scan) for scan in [*scans[:6], *blind, *after]]
    assert [p.placed for p in said[6:14]] == [False] * 8
    where = placed(mapper.finish())
    assert sorted(where) == [*range(6), *(scan.index for scan in after)]
    assert {component for component, _ in where.values()} == {0}


def test_blind_scans_alone_make_no_map() -> None:
    mapper = Mapper("a")
    for k in range(20):
        assert not mapper.add(Scan(np.full(len(FRONT), np.nan), FRONT, k, 0.0)).placed
    assert mapper.finish().submaps == ()


def test_the_same_scans_give_the_same_map_to_the_byte(tmp_path: Path) -> None:
    scans, _ = scans_along(BUILDING, TOUR[:4], 5)
    for name in ("one", "other"):
        mapper = Mapper("a")
        for scan in scans:
            mapper.add(scan)
        write_map(tmp_path / name, mapper.finish())
    assert (tmp_path / "one").read_bytes() == (tmp_path / "other").read_bytes()


def test_odometry_that_is_wrong_does_not_decide_where_the_robot_is(rng: Generator) -> None:
    """It is one more guess of where to look; what was seen decides."""
    scans, _ = scans_along(BUILDING, TOUR[:3], 5)
    lying = np.cumsum(rng.normal(0, [0.5, 0.5, 0.5], (len(scans), 3)), axis=0)
    without, misled = Mapper("a"), Mapper("a")
    for scan, guess in zip(scans, lying, strict=True):
        without.add(scan)
        misled.add(Scan(scan.ranges, scan.angles, scan.index, scan.stamp, guess))
    ours, theirs = placed(without.finish()), placed(misled.finish())
    assert ours.keys() == theirs.keys()
    for index, (component, pose) in ours.items():
        assert theirs[index][0] == component
        x, y, turn = se2.between(pose, theirs[index][1])
        assert np.hypot(x, y) < 0.05
        assert abs(turn) < np.radians(1)


def test_a_map_can_be_taken_while_it_grows_and_its_version_grows_with_it(rng: Generator) -> None:
    mapper = Mapper("a", "second")
    versions = []
    for k, x in enumerate(np.arange(2, 5, 0.5)):
        mapper.add(cast(walls_of(BUILDING), [x, 1, 0], index=k, noise=rng))
        so_far = mapper.robot_map()
        assert sorted(placed(so_far)) == list(range(k + 1))
        versions.append(so_far.version)
    assert (so_far.robot, so_far.boot) == ("a", "second")
    assert (np.diff(versions) > 0).all()


def test_what_is_published_of_a_submap_that_is_being_settled_are_its_walls(
    rng: Generator,
) -> None:
    """Places are recognised by an outline, which draws a wall as often as merging left it."""
    mapper = Mapper("a")
    for k, pose in enumerate(tour([(1, 1), (16, 1)], 0.4)):
        placement = mapper.add(cast(walls_of(BUILDING), pose, index=k, noise=rng))
        if placement.submap_finished:
            break
    finished, *_ = mapper.robot_map().submaps
    settled, *_ = mapper.finish().submaps
    assert finished.trajectory.scan_index.tolist() == settled.trajectory.scan_index.tolist()
    assert abs(len(finished.map.segments) - len(settled.map.segments)) <= 2
    assert finished.map.free_space


class JoinsAll:
    """Settles every submap by joining it to component 0, where it is."""

    def __init__(self) -> None:
        self._submaps: list[Submap] = []

    def begin(self, finished: FinishedSubmap) -> None:
        """Take the next submap."""
        self._submaps.append(replace(finished.submap, component=0))

    is_ready = True

    def take(self) -> BackendResult:
        """Return where all are."""
        poses = np.array([s.pose for s in self._submaps])
        return BackendResult(np.zeros(len(poses), dtype=np.int64), poses, (self._submaps[-1],), 0)


def test_the_number_of_a_component_that_joined_another_is_not_used_again() -> None:
    """Who remembers what was said of component 1 never takes another place for it."""
    mapper = Mapper("a", backend=JoinsAll())
    numbers = []
    places = [(BUILDING, (1, 1), (5, 1)), (OTHER_BUILDING, (5, 1.5), (9, 1.5))] * 2
    for visit, (outline, start, end) in enumerate(places):
        scans, _ = scans_along(outline, [start, end], visit)
        said = [
            mapper.add(Scan(s.ranges, s.angles, 100 * visit + k, s.stamp))
            for k, s in enumerate(scans)
        ]
        numbers += [p.component for p in said if p.lost]
    assert len(numbers) >= 2
    assert numbers == sorted(set(numbers))
    assert mapper.finish().components == [0]


class CutsTheSecond:
    """Cuts the second submap in two, and leaves all else as it is."""

    def __init__(self) -> None:
        self._submaps: list[Submap] = []
        self._settled: BackendResult | None = None

    def begin(self, finished: FinishedSubmap) -> None:
        """Take the next submap."""
        newest, used = finished.submap, finished.submap.component
        renewed: tuple[Submap, ...] = (newest,)
        if newest.id == 1:
            used, middle = finished.spare, len(newest.trajectory.stamp) // 2
            parts = [
                Trajectory(t.scan_index[k], t.stamp[k], t.pose[k], None)
                for t, k in (
                    (newest.trajectory, slice(middle)),
                    (newest.trajectory, slice(middle, None)),
                )
            ]
            renewed = (
                replace(newest, trajectory=parts[0]),
                replace(newest, id=2, component=used, trajectory=parts[1]),
            )
        self._submaps += renewed
        components = np.array([s.component for s in self._submaps])
        poses = np.array([s.pose for s in self._submaps])
        self._settled = BackendResult(components, poses, renewed, used)

    is_ready = True

    def take(self) -> BackendResult | None:
        """Return where all are."""
        return self._settled


def test_a_submap_that_is_cut_and_a_robot_that_is_lost_meanwhile_share_no_number() -> None:
    mapper = Mapper("a", backend=CutsTheSecond())
    out, _ = scans_along(BUILDING, [(1, 1), (29, 1)], 1)
    away, _ = scans_along(OTHER_BUILDING, [(5, 1.5), (9, 1.5), (9, -3)], 2)
    cut_at = 60  # the second submap is finished and not yet adopted
    for k, scan in enumerate([*out[:cut_at], *away]):
        mapper.add(Scan(scan.ranges, scan.angles, k, scan.stamp))
    robot_map = mapper.finish()
    assert [s.id for s in robot_map.submaps] == list(range(len(robot_map.submaps)))
    assert len(robot_map.components) == 3
    assert sorted(placed(robot_map))[-1] == cut_at + len(away) - 1
    runs = [s.component for s in robot_map.submaps]
    assert runs == sorted(runs)  # each number is one stretch of the path


def test_a_mapper_needs_a_valid_robot_id() -> None:
    with pytest.raises(InvalidIdError):
        Mapper("Not valid")


def real(path: Path, scans: int | None = None) -> tuple[float, float]:
    """Map a real log; return the share of scans in the largest component, and of right steps."""
    mapper = Mapper("a")
    seen = 0
    for scan in read_scans(path, on_warning=pytest.fail):
        if seen == scans:
            break
        mapper.add(scan)
        seen += 1
    where = placed(mapper.finish())
    indices, poses = read_reference_poses(path)
    truth = dict(zip(indices.tolist(), poses, strict=True))
    components = [component for component, _ in where.values()]
    largest = max(set(components), key=components.count)
    known = sorted(k for k, (component, _) in where.items() if component == largest and k in truth)
    right = steps_right(
        known, np.array([where[k][1] for k in known]), np.array([truth[k] for k in known])
    )
    return components.count(largest) / seen, right


def test_the_start_of_a_real_log_is_followed(data_dir: Path) -> None:
    share, right = real(data_dir / "fr079.log.gz", 150)
    assert share >= 0.95
    assert right >= 0.95


@pytest.mark.slow
def test_a_real_corridor_is_followed_to_its_end(data_dir: Path) -> None:
    share, right = real(data_dir / "seattle.log.gz")
    assert share >= 0.95
    assert right >= 0.85


@pytest.mark.slow
def test_a_real_building_is_followed_as_the_issue_asks(data_dir: Path) -> None:
    share, right = real(data_dir / "fr079.log.gz")
    assert share >= 0.95
    assert right >= 0.97


def test_a_copied_mapper_goes_on_by_itself() -> None:
    """As an experiment does that asks what would happen if the robot were carried off here."""
    scans, _ = scans_along(BUILDING, [(3, 1), (9, 1), (9, 3)], 20)
    half = len(scans) // 2
    whole, stopped = Mapper("a"), Mapper("a")
    for scan in scans[:half]:
        whole.add(scan)
        stopped.add(scan)
    copied = copy.deepcopy(stopped)
    for scan in scans[half:]:
        whole.add(scan)
        copied.add(scan)
    expected, found = whole.finish().lines(0).segments, copied.finish().lines(0).segments
    np.testing.assert_array_equal(found, expected)
    assert len(stopped.finish().lines(0).segments) < len(expected)
