"""The joint map: components at their poses, merged, with how sure each wall is."""

import numpy as np
import pytest
import shapely
from numpy.random import Generator
from shapely.geometry import Polygon

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment, LineMap
from mapweave.reasons import Reason
from mapweave.scan.free_space import from_rings
from mapweave.team.joint_map import build_joint_map
from tests.mapweave.buildings import (
    BUILDING,
    line_map,
    part,
    random_pose,
    rectangle,
    shaken,
    walls_of,
)

ROOM = rectangle(0, 0, 8, 6)
FREE = (rectangle(0.15, 0.15, 7.85, 5.85),)
PARTITION = np.array([[4.0, 1.5, 4, 4.5]])
LEFT, RIGHT = part(BUILDING, 0, 18), part(BUILDING, 8, 30)


def link(reference: str, other: str, transform: FloatArray, confidence: float = 0.9) -> Alignment:
    return Alignment(
        reference, other, transform, "accepted", confidence, Reason.words("30 m of wall in common")
    )


def wall_of(lines: LineMap) -> float:
    return float(np.hypot(*(lines.segments[:, 2:] - lines.segments[:, :2]).T).sum())


def off_the_walls(segments: FloatArray, walls: FloatArray) -> float:
    """Return how far the farthest end of `segments` is from `walls` [m]."""
    lines = shapely.multilinestrings(shapely.linestrings(walls.reshape(-1, 2, 2)))
    return float(shapely.distance(shapely.points(segments.reshape(-1, 2)), lines).max())


def test_the_joint_map_of_one_map_is_itself() -> None:
    joint = build_joint_map({"a/0": LEFT}, [], version=7)
    assert joint.version == 7 and joint.alignments == ()
    (component,) = joint.components
    assert list(component.robots) == ["a/0"] and component.confidence == 1.0
    np.testing.assert_array_equal(component.robots["a/0"], np.zeros(3))
    order = [np.lexsort(lines.segments.T) for lines in (component.map, LEFT)]
    np.testing.assert_allclose(
        component.map.segments[order[0]], LEFT.segments[order[1]], atol=1e-12
    )
    assert (component.map.support == 5).all()


def test_two_sightings_of_a_building_become_one_and_their_support_adds(rng: Generator) -> None:
    lines = {"a/0": shaken(LEFT, rng, 0.01), "b/0": shaken(LEFT, rng, 0.01)}
    (component,) = build_joint_map(lines, [link("a/0", "b/0", np.zeros(3))], 1).components
    assert len(component.map.segments) == len(LEFT.segments)
    assert (component.map.support == 10).all()
    assert off_the_walls(component.map.segments, walls_of(BUILDING)) < 0.05


def test_two_halves_make_the_whole(rng: Generator) -> None:
    true = random_pose(rng)
    other = shaken(RIGHT, rng, 0.01).moved(se2.inverse(true))
    alignments = [link("a/0", "b/0", true)]
    (component,) = build_joint_map({"a/0": LEFT, "b/0": other}, alignments, 1).components
    np.testing.assert_allclose(component.robots["b/0"], true)
    assert off_the_walls(component.map.segments, walls_of(BUILDING)) < 0.06
    assert wall_of(component.map) == pytest.approx(wall_of(part(BUILDING, 0, 30)), rel=0.03)
    # What either saw free is free, and no more.
    free = from_rings(component.map.free_space)
    assert free.area == pytest.approx(Polygon(BUILDING).buffer(-0.15).area, rel=0.02)
    assert shapely.difference(free, Polygon(BUILDING)).area < 0.01


def test_the_shape_does_not_depend_on_the_robots_frames(rng: Generator) -> None:
    here = build_joint_map({"a/0": LEFT, "b/0": RIGHT}, [link("a/0", "b/0", np.zeros(3))], 1)
    a, b = random_pose(rng), random_pose(rng)
    moved = {"a/0": LEFT.moved(a), "b/0": RIGHT.moved(b)}
    there = build_joint_map(moved, [link("a/0", "b/0", se2.compose(a, se2.inverse(b)))], 1)
    (one,), (other,) = here.components, there.components
    back = se2.transform_segments(se2.inverse(a), other.map.segments)
    assert len(back) == len(one.map.segments)
    apart = np.abs(back[:, None] - one.map.segments).max(axis=-1).min(axis=1)
    assert apart.max() < 0.01
    assert sorted(other.segment_confidence) == pytest.approx(sorted(one.segment_confidence))


def test_what_is_not_joined_stays_a_component_of_its_own() -> None:
    refused = Alignment(
        "a/0", "b/0", np.zeros(3), "refused", 0.1, Reason.words("only 2 m of wall in common")
    )
    joint = build_joint_map({"a/0": LEFT, "b/0": RIGHT}, [refused], 1)
    assert [list(c.robots) for c in joint.components] == [["a/0"], ["b/0"]]
    assert joint.alignments == (refused,)


def test_an_alignment_that_contradicts_surer_ones_is_set_aside_in_the_joint_map() -> None:
    still = np.zeros(3)
    alignments = [
        link("a/0", "b/0", still),
        link("b/0", "c/0", still),
        link("a/0", "c/0", np.array([5.0, 0, 0]), 0.6),
    ]
    joint = build_joint_map(dict.fromkeys(("a/0", "b/0", "c/0"), LEFT), alignments, 1)
    assert [a.decision for a in joint.alignments] == ["accepted", "accepted", "ambiguous"]
    assert len(joint.components) == 1 and (joint.components[0].map.support == 15).all()


def confidence_of_partition(*others: LineMap) -> float:
    """Return how sure the partition is that robot a saw, once the `others` have joined."""
    seen = line_map(np.vstack([walls_of(ROOM), PARTITION]))
    lines = {"a/0": seen, **{f"b/{k}": other for k, other in enumerate(others)}}
    alignments = [link("a/0", name, np.zeros(3)) for name in lines if name != "a/0"]
    (component,) = build_joint_map(lines, alignments, 1).components
    across = np.isclose(component.map.segments[:, [0, 2]], 4, atol=0.1).all(axis=1)
    assert across.sum() == 1
    return float(component.segment_confidence[across][0])


def test_a_wall_is_less_sure_once_another_robot_saw_through_it() -> None:
    alone = confidence_of_partition()
    confirmed = confidence_of_partition(line_map(np.vstack([walls_of(ROOM), PARTITION]), FREE))
    denied = confidence_of_partition(line_map(walls_of(ROOM), FREE))
    assert alone == pytest.approx(5 / 6)  # n sightings: n / (n + 1)
    assert confirmed == pytest.approx(10 / 11)
    assert denied == pytest.approx(5 / 12, abs=0.05)  # one robot for it, one against
    assert confidence_of_partition(*[line_map(walls_of(ROOM), FREE)] * 4) < 0.2


def test_segment_confidence_is_a_probability_that_grows_with_sightings() -> None:
    once, often = (
        build_joint_map({"a/0": line_map(walls_of(ROOM), FREE, support=n)}, [], 1).components[0]
        for n in (1, 9)
    )
    assert once.segment_confidence == pytest.approx(np.full(4, 1 / 2))
    assert often.segment_confidence == pytest.approx(np.full(4, 9 / 10))


def test_a_robot_that_saw_nothing_breaks_nothing() -> None:
    joint = build_joint_map({"a/0": LEFT, "b/0": LineMap.empty()}, [], 1)
    assert [len(c.map.segments) > 0 for c in joint.components] == [True, False]


def test_no_robots_give_an_empty_joint_map() -> None:
    joint = build_joint_map({}, [], 1)
    assert joint.components == () and joint.alignments == ()
