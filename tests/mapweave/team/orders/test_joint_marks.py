"""A mark lies with what holds it, wherever that comes to lie."""

from dataclasses import replace

import numpy as np

from mapweave.anchors import anchored, find, placed_marks, tied
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import RobotMap, Submap, Trajectory
from mapweave.marks import Anchor, Mark
from mapweave.team.joint_map import fuse
from tests.mapweave.whole_maps import robot_map

PLACE = np.array([3.0, 4.0])


def marked(some_map: RobotMap, component: int, place: FloatArray) -> RobotMap:
    """Return a map with a victim at (2,) `place` [m] in the frame of a component."""
    found = anchored(some_map.submaps, component, place)
    assert found is not None
    return replace(some_map, marks=(Mark("m1", "victim", "anna", 5.0, *found),))


def where(some_map: RobotMap) -> FloatArray:
    [mark] = placed_marks(some_map)
    return mark.position


def test_a_mark_lies_where_it_was_set_held_by_the_nearest_scan() -> None:
    some_map = robot_map(np.random.default_rng(3))
    submap = some_map.submaps[1]
    pose = se2.compose(submap.pose, submap.trajectory.pose[4])
    place = se2.transform_points(pose, [0.3, -0.2])
    with_mark = marked(some_map, 0, place)
    [mark] = with_mark.marks
    assert mark.anchor == Anchor(1, int(submap.trajectory.scan_index[4]))
    np.testing.assert_allclose(mark.position, [0.3, -0.2], atol=1e-9)
    np.testing.assert_allclose(where(with_mark), place, atol=1e-9)


def test_a_mark_moves_with_its_submap_and_not_with_others() -> None:
    with_mark = marked(robot_map(np.random.default_rng(4)), 0, PLACE)
    [held] = [s for s in with_mark.submaps if find([s], with_mark.marks[0].anchor)]
    motion = np.array([0.7, -0.4, 0.3])
    for submap in with_mark.submaps:
        moved = replace(submap, pose=se2.compose(motion, submap.pose))
        others = [moved if s is submap else s for s in with_mark.submaps]
        after = where(replace(with_mark, submaps=tuple(others)))
        expected = se2.transform_points(motion, PLACE) if submap is held else PLACE
        np.testing.assert_allclose(after, expected, atol=1e-9)


def test_a_mark_stays_with_its_scan_where_the_submap_is_cut_and_numbers_move_on() -> None:
    with_mark = marked(robot_map(np.random.default_rng(5)), 0, PLACE)
    [mark] = with_mark.marks
    assert mark.anchor.scan is not None
    cut: list[Submap] = []
    for submap in with_mark.submaps:
        path = submap.trajectory
        before = path.scan_index < mark.anchor.scan
        for part in (before, ~before):
            kept = Trajectory(path.scan_index[part], path.stamp[part], path.pose[part])
            cut.append(Submap(len(cut), len(cut), submap.pose, submap.map, kept))
    after = replace(with_mark, submaps=tuple(cut))
    np.testing.assert_allclose(where(after), PLACE, atol=1e-9)


def test_a_mark_whose_scan_has_not_come_is_nowhere_until_it_comes() -> None:
    with_mark = marked(robot_map(np.random.default_rng(6)), 0, PLACE)
    [mark] = with_mark.marks
    early = replace(mark, anchor=Anchor(7, 1000))
    assert placed_marks(replace(with_mark, marks=(early,))) == []


def test_a_map_without_scans_holds_marks_by_its_submaps() -> None:
    bare = robot_map(np.random.default_rng(7))
    submaps = tuple(replace(s, trajectory=Trajectory.empty()) for s in bare.submaps)
    with_mark = marked(replace(bare, submaps=submaps), 0, PLACE)
    assert with_mark.marks[0].anchor.scan is None
    np.testing.assert_allclose(where(with_mark), PLACE, atol=1e-9)


def test_a_mark_is_at_its_place_in_the_joint_map() -> None:
    rng = np.random.default_rng(8)
    one = robot_map(rng, "a", ((0.0, 12.0), (10.0, 20.0)), (0, 0))
    two = marked(robot_map(rng, "b", ((4.0, 16.0), (14.0, 26.0)), (0, 0)), 0, PLACE)
    joint = fuse([one, two])
    [component] = joint.components
    [mark] = component.marks
    assert (mark.label, mark.by, mark.component) == ("victim", "anna", "b/0")
    expected = se2.transform_points(component.robots["b/0"], PLACE)
    np.testing.assert_allclose(mark.position, expected, atol=0.1)


def test_a_mark_that_two_maps_have_is_in_the_joint_map_once() -> None:
    rng = np.random.default_rng(8)
    maps = [robot_map(rng, robot, ((0.0, 12.0), (10.0, 20.0)), (0, 0)) for robot in "ab"]
    joint = fuse([marked(some_map, 0, PLACE) for some_map in maps])
    assert [mark.id for component in joint.components for mark in component.marks] == ["m1"]


def test_what_ties_two_components_says_the_same_of_them_as_the_transform() -> None:
    rng = np.random.default_rng(9)
    one, two = robot_map(rng, "a"), robot_map(rng, "b")
    transform = np.array([2.0, -1.0, 0.7])
    ours, theirs, step = tied(one.submaps, two.submaps, transform)
    ends = [find(m.submaps, anchor) for m, anchor in ((one, ours), (two, theirs))]
    assert ends[0] is not None and ends[1] is not None
    there = se2.compose(ends[0][0].pose, step)
    again = se2.compose(there, se2.inverse(ends[1][0].pose))
    np.testing.assert_allclose(again, transform, atol=1e-9)
