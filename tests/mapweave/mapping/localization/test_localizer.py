"""A robot set down in a known map: it finds itself, is followed, and claims no place it is not."""

from dataclasses import replace

import numpy as np
import pytest

from mapweave.anchors import placed_marks
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.localization.known_map import KnownMap
from mapweave.mapping.localization.localizer import Localizer
from mapweave.mapping.localization.place_finder import Place, Search
from mapweave.mapping.placement import Placement
from mapweave.maps import JointComponent, JointMap, LineMap, RobotMap, Submap, Trajectory
from mapweave.marks import Anchor, Mark, PlacedMark
from mapweave.scan.scan import Scan
from tests.mapweave.buildings import (
    BUILDING,
    OTHER_BUILDING,
    corridor,
    part,
    random_pose,
    scans_along,
    shaken,
)

WITHIN = 0.1  # [m]
FROM_THE_LEFT = [(3, 1), (13, 1), (13, -3), (13, 1), (18, 1), (18, 4), (18, 1), (28, 1)]


def stored(lines: LineMap, pose: FloatArray) -> RobotMap:
    """Return a map of `lines` as a robot stored it whose frame lies at `pose` (3,) in them."""
    path = Trajectory(np.arange(3), np.full(3, np.nan), np.zeros((3, 3)))
    noisy = shaken(lines, np.random.default_rng(1)).moved(se2.inverse(pose))
    return RobotMap("a", "0", 4, (Submap(7, 2, np.zeros(3), noisy, path),))


def follow(localizer: Localizer, scans: list[Scan]) -> list[Placement]:
    return [localizer.add(scan) for scan in scans]


def assert_right(found: Placement, true: FloatArray, frame: FloatArray) -> None:
    """Assert that a scan taken at `true` (3,) is placed there, in a map whose frame is `frame`."""
    assert found.pose is not None
    x, y, turn = se2.between(se2.between(frame, true), found.pose)
    assert np.hypot(x, y) < WITHIN and abs(turn) < 0.03


@pytest.mark.parametrize("first", [0, 25, 60])
def test_a_robot_set_down_anywhere_finds_itself_and_is_followed(first: int) -> None:
    frame = random_pose(np.random.default_rng(first))
    scans, poses = scans_along(BUILDING, FROM_THE_LEFT, first)
    localizer = Localizer(KnownMap.of(stored(part(BUILDING, 0, 30), frame)))
    found = follow(localizer, scans[first : first + 40])
    located = [k for k, placement in enumerate(found) if placement.placed]
    driven = np.hypot(*np.diff(poses[first:, :2], axis=0).T).cumsum()
    assert driven[located[0]] < 5.0
    assert located == list(range(located[0], 40))
    for k in located:
        assert found[k].component == 2
        assert_right(found[k], poses[first + k], frame)


def test_scans_from_before_the_robot_was_found_are_placed_once_it_is() -> None:
    scans, poses = scans_along(BUILDING, FROM_THE_LEFT, 3)
    localizer = Localizer(KnownMap.of(stored(part(BUILDING, 0, 30), np.zeros(3))))
    follow(localizer, scans[:30])
    robot_map = localizer.finish()
    (path,) = [s.trajectory for s in robot_map.submaps if len(s.trajectory.scan_index)]
    assert path.scan_index.tolist() == list(range(30))
    assert np.hypot(*(path.pose - poses[:30])[:, :2].T).max() < WITHIN


def test_the_known_map_stays_as_it_is_and_says_nothing_of_those_who_mapped_it() -> None:
    known = stored(part(BUILDING, 0, 30), np.zeros(3))
    localizer = Localizer(KnownMap.of(known))
    follow(localizer, scans_along(BUILDING, FROM_THE_LEFT, 4)[0][:30])
    first, *paths = localizer.finish().submaps
    assert first.map is known.submaps[0].map
    assert len(first.trajectory.scan_index) == 0
    assert all(len(submap.map.segments) == 0 for submap in paths)


def test_what_is_marked_in_the_known_map_stays_where_it_is() -> None:
    somewhere = random_pose(np.random.default_rng(1))
    known = stored(part(BUILDING, 0, 30), somewhere)
    mark = Mark("m1", "victim", "anna", 5.0, Anchor(7, 1), np.array([1.0, 2.0]))
    robot_map = Localizer(KnownMap.of(replace(known, marks=(mark,)))).robot_map()
    [placed] = placed_marks(robot_map)
    assert (placed.label, placed.component) == ("victim", "r1/2")
    np.testing.assert_allclose(placed.position, [1.0, 2.0])  # its scan was at the origin

    lies = PlacedMark("m2", "door", "anna", 5.0, "a/0", np.array([3.0, 4.0]))
    one = JointComponent({"a/0": np.zeros(3)}, 1.0, known.lines(2), np.ones(1), (lies,))
    [placed] = placed_marks(Localizer(KnownMap.of(JointMap(1, (one,), ()))).robot_map())
    np.testing.assert_allclose(placed.position, [3.0, 4.0])


def test_a_robot_in_another_building_is_nowhere_which_is_said_once() -> None:
    news: list[str] = []
    known = KnownMap.of(stored(part(OTHER_BUILDING, 0, 26), np.zeros(3)))
    localizer = Localizer(known, on_news=news.append)
    found = follow(localizer, scans_along(BUILDING, FROM_THE_LEFT, 5)[0])
    assert not any(placement.placed for placement in found)
    assert localizer.finish().submaps[1:] == ()
    (line,) = news
    assert line.startswith("nothing that the robot saw is found in the map: it is of another place")


def test_where_two_places_look_alike_the_robot_says_nothing_until_it_sees_a_difference() -> None:
    """Two wings that are alike up to one niche, at x = 16 of the first and 46 of the second."""
    rooms = [(2, 5, 3.0), (8, 9, 0.5)]
    alike = [(a + far, b + far, deep) for far in (0, 30) for a, b, deep in rooms]
    building = corridor(60.0, alike, [(16, 18, 1.5), (45, 49, 3.5)])
    known = KnownMap.of(stored(part(building, 0, 60), np.zeros(3)))
    scans, poses = scans_along(building, [(31, 1), (58, 1)], 6, step=0.25)
    # Without a look at what is far off: each sees as far as the rooms that are alike.
    near = [
        Scan(np.where(s.ranges < 5, s.ranges, np.nan), s.angles, s.index, s.stamp) for s in scans
    ]
    found = follow(Localizer(known), near)
    early = [f for f, pose in zip(found, poses, strict=True) if pose[0] < 38]
    assert not any(f.placed for f in early)
    assert found[-1].placed
    for placement, pose in zip(found, poses, strict=True):
        if placement.placed:
            assert_right(placement, pose, np.zeros(3))


def test_a_robot_carried_elsewhere_finds_itself_again() -> None:
    localizer = Localizer(KnownMap.of(stored(part(BUILDING, 0, 30), np.zeros(3))))
    scans, poses = scans_along(BUILDING, FROM_THE_LEFT, 7)
    follow(localizer, scans[:25])
    carried = [Scan(s.ranges, s.angles, 100 + s.index, 100 + s.stamp) for s in scans[70:]]
    found = follow(localizer, carried)
    assert_right(found[-1], poses[-1], np.zeros(3))
    late = [(f, pose) for f, pose in zip(found, poses[70:], strict=True) if f.placed]
    for placement, pose in late[-5:]:
        assert_right(placement, pose, np.zeros(3))


class Scripted:
    """A searcher that finds what it is told to, and then nothing any more."""

    is_ready = True

    def __init__(self, found: list[Place]) -> None:
        self._found = found
        self.searches: list[Search] = []

    def begin(self, search: Search) -> None:
        """Note it."""
        self.searches.append(search)

    def take(self) -> Place | None:
        """Return the next."""
        return self._found.pop(0) if self._found else None


HERE = Place(2, np.array([3.0, 1.0, 0.0]))


def test_a_place_that_is_not_confirmed_again_and_again_is_given_up_and_said() -> None:
    news: list[str] = []
    known = KnownMap.of(stored(part(BUILDING, 0, 30), np.zeros(3)))
    searcher = Scripted([HERE] * 5)
    localizer = Localizer(known, searcher=searcher, on_news=news.append)
    found = follow(localizer, scans_along(BUILDING, FROM_THE_LEFT, 7)[0])
    assert news[0] == "the robot has found itself in component 2 of the map"
    assert news[1] == "the robot no longer knows where in the map it is"
    assert not found[-1].placed
    patience = localizer.parameters.patience
    given_up = next(k for k, s in enumerate(searcher.searches) if k > 6 and s.near is None)
    confirmed = [k for k, s in enumerate(searcher.searches[:given_up]) if s.near is not None]
    assert len(confirmed) >= patience
    assert localizer.place is None


def test_a_place_found_once_or_here_and_there_is_not_believed() -> None:
    known = KnownMap.of(stored(part(BUILDING, 0, 30), np.zeros(3)))
    there = Place(2, np.array([3.0, 2.0, 0.0]))
    other = Place(1, HERE.transform)
    for found in ([HERE], [HERE, there] * 20, [HERE, other] * 20):
        localizer = Localizer(known, searcher=Scripted(list(found)))
        placed = follow(localizer, scans_along(BUILDING, FROM_THE_LEFT, 7)[0][:40])
        assert not any(placement.placed for placement in placed)


def test_a_joint_map_is_known_by_its_components() -> None:
    frame = random_pose(np.random.default_rng(8))
    lines = shaken(part(BUILDING, 0, 30), np.random.default_rng(8)).moved(se2.inverse(frame))
    sure = np.ones(len(lines.segments))
    other = part(OTHER_BUILDING, 0, 26)
    components = (
        JointComponent({"c/0": np.zeros(3)}, 1.0, other, np.ones(len(other.segments))),
        JointComponent({"a/0": np.zeros(3), "b/0": np.ones(3)}, 0.9, lines, sure),
    )
    localizer = Localizer(KnownMap.of(JointMap(3, components, ())))
    scans, poses = scans_along(BUILDING, FROM_THE_LEFT, 9)
    found = follow(localizer, scans[:25])[-1]
    assert found.component == 1
    assert_right(found, poses[24], frame)


def test_a_long_path_is_kept_in_pieces_that_do_not_change_any_more() -> None:
    localizer = Localizer(KnownMap.of(stored(part(BUILDING, 0, 30), np.zeros(3))))
    length = localizer.parameters.mapper.backend.submap.max_scans
    scans, _ = scans_along(BUILDING, [(3, 1), (28, 1)], 10, step=0.05)
    follow(localizer, scans[: length + 20])
    paths = [s.trajectory.scan_index for s in localizer.finish().submaps[1:]]
    assert [len(path) for path in paths] == [length, 20]
    assert np.concatenate(paths).tolist() == list(range(length + 20))
