"""Robots that were joined are woven together: each submap lies where it fits all others."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.evidence import Evidence
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.mapping.loops.loop_closing import LoopCloser
from mapweave.maps import Alignment, LineMap, RobotMap, SharedPlace, Submap, Trajectory
from mapweave.reasons import Reason
from mapweave.team.alignment_graph import Cluster
from mapweave.team.joint_map import build_joint_map, fuse
from mapweave.team.joint_optimization import JointOptimizationParameters, JointOptimizer
from tests.mapweave.buildings import corridor, part, random_pose

LONG = corridor(
    60,
    [(1, 2, 4.0), (4, 10, 1.5), (17, 22, 2.0), (30, 32, 1.5), (40, 43, 2.5), (52, 53, 1.0)],
    [(3, 7, 3.2), (13, 16, 2.4), (25, 28, 3.0), (36, 37, 0.8), (46, 51, 1.2), (55, 58.5, 0.7)],
)
PATIENT = JointOptimizationParameters(at_once=1_000_000)
WHOLE = JointOptimizer(JointOptimizationParameters(newest=True, at_once=1_000_000))
BENT = 0.008  # [rad] a submap: what tracking may err by; 1 m between both ends of 60 m


def submaps(bend: float, frame: FloatArray) -> list[Submap]:
    """Return the long corridor in ten submaps, each turned by `bend` [rad] more than it is."""
    pose, found = frame, []
    for k in range(10):
        low = 6.0 * k
        own = part(LONG, max(low - 2, 0), min(low + 8, 60)).moved(np.array([-low, 0, 0]))
        path = Trajectory(np.arange(2), np.zeros(2), np.array([[0.0, 1, 0], [6.0, 1, 0]]))
        found.append(Submap(k, 0, pose, own, path))
        pose = se2.compose(pose, np.array([6.0, 0, bend]))
    return found


def team(
    bend: float, frames: FloatArray
) -> tuple[Cluster, dict[str, list[Submap]], list[Alignment]]:
    """Return two robots, bent against each other, that were aligned where submap 4 is."""
    robots = {"a/0": submaps(bend, frames[0]), "b/0": submaps(-bend, frames[1])}
    there, here = (robot[4].pose for robot in robots.values())
    transform = se2.compose(there, se2.inverse(here))
    alignment = Alignment("a/0", "b/0", transform, "accepted", 0.99, Reason.words("so"))
    return Cluster({"a/0": np.zeros(3), "b/0": transform}, 0.99), robots, [alignment]


def rigid(robot: list[Submap]) -> LineMap:
    return LineMap.union([s.map.moved(s.pose) for s in robot])


def bent(robots: dict[str, list[Submap]], poses: dict[str, FloatArray]) -> dict[str, LineMap]:
    """Return the robots' maps, their submaps where weaving puts them."""
    return {
        name: LineMap.union([s.map.moved(t) for s, t in zip(robots[name], those, strict=True)])
        for name, those in poses.items()
    }


def apart(cluster: Cluster, lines: dict[str, LineMap]) -> FloatArray:
    """(n,) [m] between the same ends of walls in the two robots' maps."""
    first, second = (
        se2.transform_points(cluster.poses[name], lines[name].segments.reshape(-1, 2))
        for name in ("a/0", "b/0")
    )
    distances: FloatArray = np.hypot(*(first - second).T)
    return distances


@pytest.fixture
def frames(rng: Generator) -> FloatArray:
    return np.array([random_pose(rng), random_pose(rng)])


def test_maps_bent_against_each_other_come_to_lie_on_each_other(frames: FloatArray) -> None:
    cluster, robots, alignments = team(BENT, frames)
    before = apart(cluster, {name: rigid(robot) for name, robot in robots.items()})
    assert before.max() > 0.5
    woven, poses = WHOLE.weave(cluster, robots, alignments)
    assert apart(woven, bent(robots, poses)).max() < 0.1
    np.testing.assert_array_equal(woven.poses["a/0"], 0.0)
    assert woven.confidence == cluster.confidence


def test_maps_that_fit_stay_where_they_are(frames: FloatArray) -> None:
    cluster, robots, alignments = team(0.0, frames)
    woven, poses = JointOptimizer(PATIENT).weave(cluster, robots, alignments)
    lines = bent(robots, poses)
    np.testing.assert_allclose(woven.poses["b/0"], cluster.poses["b/0"], atol=0.02)
    for name, robot in robots.items():
        np.testing.assert_allclose(lines[name].segments, rigid(robot).segments, atol=0.03)


def test_the_frames_of_the_components_change_nothing(frames: FloatArray) -> None:
    distances = []
    for each in (frames, np.zeros((2, 3))):
        cluster, robots, alignments = team(BENT, each)
        woven, poses = JointOptimizer(PATIENT).weave(cluster, robots, alignments)
        distances.append(apart(woven, bent(robots, poses)))
    np.testing.assert_allclose(distances[0], distances[1], atol=0.02)


def test_robots_that_are_nowhere_near_each_other_stay_rigid(frames: FloatArray) -> None:
    cluster, robots, _ = team(BENT, frames)
    far = Cluster({"a/0": np.zeros(3), "b/0": np.array([500.0, 0.0, 0.0])}, cluster.confidence)
    woven, poses = JointOptimizer(PATIENT).weave(far, robots, [])
    assert woven is far
    np.testing.assert_array_equal(poses["b/0"], [s.pose for s in robots["b/0"]])


def test_a_submap_that_grows_still_goes_along_with_the_one_before(frames: FloatArray) -> None:
    cluster, robots, alignments = team(BENT, frames)
    alone, poses = JointOptimizer(PATIENT).weave(cluster, robots, alignments)
    lines = bent(robots, poses)
    others = {name: robot[:-1] for name, robot in robots.items()}
    woven, rest = WHOLE.weave(cluster, others, alignments)
    assert apart(woven, bent(others, rest)).max() < 0.1 < apart(alone, lines).max() < 0.2


@pytest.mark.parametrize(
    ("bend", "told", "count"), [(0.012, True, 1), (0.012, False, 2), (0.03, True, 2)]
)
def test_what_maps_are_bent_by_beyond_the_place_told_does_not_part_them(
    frames: FloatArray, bend: float, *, told: bool, count: int
) -> None:
    """They are 2.5 m apart at the ends, or 6 m: that is more than tracking errs by."""
    _, robots, [alignment] = team(bend, frames)
    at = se2.transform_points(robots["a/0"][4].pose, np.array([3.0, 1.0]))
    held = replace(
        alignment,
        evidence=Evidence(reach=20.0),
        places=(SharedPlace(4, 4, np.zeros(3), at),) if told else (),
    )
    joint = build_joint_map({name: rigid(robot) for name, robot in robots.items()}, [held], 1)
    assert len(joint.components) == count


def test_maps_without_walls_come_to_lie_on_each_other_at_the_places_told(
    frames: FloatArray,
) -> None:
    """Nothing is found by comparing submaps here: what is told of places is all there is."""
    cluster, robots, [alignment] = team(BENT, frames)
    bare = {
        name: [replace(s, map=LineMap.empty()) for s in robot] for name, robot in robots.items()
    }
    places = tuple(SharedPlace(k, k, np.zeros(3), np.zeros(2)) for k in (4, 1, 8))
    told = replace(alignment, places=places)
    for told_of, most in ((told, 0.2), (alignment, 2.0)):
        woven, poses = WHOLE.weave(cluster, bare, [told_of])
        here, there = (se2.compose(woven.poses[n], poses[n]) for n in ("a/0", "b/0"))
        off = np.hypot(*(here - there)[[1, 4, 8], :2].T)
        assert (off.max() < most) and (most < 1 or off.max() > 0.5)


def test_what_was_compared_once_is_not_compared_again(
    frames: FloatArray, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A version of the joint map is made every few seconds, of nearly the same submaps."""
    cluster, robots, alignments = team(BENT, frames)
    weaver = JointOptimizer(PATIENT)
    first, _ = weaver.weave(cluster, robots, alignments)
    monkeypatch.delattr(LoopCloser, "compare_two")
    again, _ = weaver.weave(cluster, robots, alignments)
    np.testing.assert_array_equal(again.poses["b/0"], first.poses["b/0"])


def test_what_is_not_compared_at_once_is_compared_the_next_time(frames: FloatArray) -> None:
    """A coordinator that starts anew makes a version all the same."""
    cluster, robots, alignments = team(BENT, frames)
    weaver = JointOptimizer(JointOptimizationParameters(newest=True, at_once=5))
    before: list[float] = []
    while not before or weaver.has_more:
        weaver.turn()
        woven, poses = weaver.weave(cluster, robots, alignments)
        before.append(float(apart(woven, bent(robots, poses)).max()))
    assert len(before) > 2
    assert before[0] > before[-1]
    assert before[-1] < 0.1
    whole, where = WHOLE.weave(cluster, robots, alignments)
    np.testing.assert_array_equal(woven.poses["b/0"], whole.poses["b/0"])
    for name, own in where.items():
        np.testing.assert_array_equal(poses[name], own)


def test_a_version_that_nobody_waits_for_compares_more_until_something_comes(
    frames: FloatArray,
) -> None:
    cluster, robots, alignments = team(BENT, frames)

    def turns(is_overtaken: Callable[[], bool], *, is_awaited: bool = False) -> int:
        few = JointOptimizationParameters(newest=True, at_once=2, beside=1_000_000)
        weaver, count = JointOptimizer(few), 0
        while not count or (weaver.has_more and count < 4):
            weaver.turn(is_awaited=is_awaited, is_overtaken=is_overtaken)
            weaver.weave(cluster, robots, alignments)
            count += 1
        return count

    assert turns(lambda: False, is_awaited=True) == 4
    assert turns(lambda: False) == 1
    assert turns(lambda: True) == 4


def test_a_patient_version_leaves_nothing_to_the_next_one(frames: FloatArray) -> None:
    weaver = JointOptimizer(JointOptimizationParameters(newest=True, at_once=1))
    weaver.turn(patient=True)
    woven, _ = weaver.weave(*team(BENT, frames))
    whole, _ = WHOLE.weave(*team(BENT, frames))
    assert not weaver.has_more
    np.testing.assert_array_equal(woven.poses["b/0"], whole.poses["b/0"])


def test_what_a_version_asks_for_is_remembered_however_much_that_is(frames: FloatArray) -> None:
    """Or the next version would compare it again, and never come to an end."""
    weaver = JointOptimizer(
        JointOptimizationParameters(newest=True, at_once=1_000_000, remembered=1)
    )
    weaver.weave(*team(BENT, frames))
    weaver.turn()
    weaver.weave(*team(BENT, frames))
    assert not weaver.has_more


def test_three_robots_and_one_that_saw_nothing_are_woven(frames: FloatArray) -> None:
    """The third has walked through it all again, and the fourth is blind."""
    cluster, robots, alignments = team(BENT, frames)
    third = [replace(s, id=s.id + 3 * (s.id > 4)) for s in submaps(0.0, frames[1])]  # was lost once
    blind = [Submap(0, 0, np.zeros(3), LineMap.empty(), Trajectory.empty())]
    everyone = {**robots, "c/0": third, "d/0": blind}
    there = se2.compose(robots["a/0"][4].pose, se2.inverse(third[4].pose))
    links = [
        *alignments,
        Alignment("a/0", "c/0", there, "accepted", 0.99, Reason.words("so")),
        Alignment("a/0", "d/0", there, "accepted", 0.99, Reason.words("so")),
    ]
    poses = {**cluster.poses, "c/0": there, "d/0": there}
    woven, own = WHOLE.weave(Cluster(poses, 0.99), everyone, links)
    assert apart(woven, bent(everyone, own)).max() < 0.12
    assert np.isfinite(np.array(list(woven.poses.values()))).all()
    np.testing.assert_allclose(woven.poses["d/0"], there, atol=0.5)


def test_a_joint_map_of_bent_robots_has_no_wall_twice(frames: FloatArray) -> None:
    _, robots, alignments = team(BENT / 2, frames)
    maps = [RobotMap(name[0], "boot", 1, tuple(robot)) for name, robot in sorted(robots.items())]
    (component,) = fuse(maps, alignments).components
    drawn = np.hypot(*(component.map.segments[:, 2:] - component.map.segments[:, :2]).T).sum()
    true = np.hypot(*np.diff(np.vstack([LONG, LONG[:1]]), axis=0).T).sum()
    assert drawn < 1.03 * true
    assert (component.segment_confidence > 0.8).mean() > 0.95
