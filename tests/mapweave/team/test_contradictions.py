"""What maps that nobody compared say of how they were joined."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.random import Generator

from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment, JointMap, LineMap
from mapweave.reasons import Reason, ReasonKind, Status, StatusKind
from mapweave.team.joint_map import build_joint_map
from tests.mapweave.buildings import BUILDING, line_map, part, random_pose, shaken

LEFT, RIGHT = part(BUILDING, 0, 16), part(BUILDING, 14, 30)
# These saw nothing as free: only the left one's free space can contradict.
MIDDLE, WALLS = (replace(part(BUILDING, *ends), free_space=()) for ends in [(8, 22), (14, 30)])
STILL = np.zeros(3)
ELSEWHERE = np.array([-15.0, 0.4, 0.0])  # puts the right part over the left one


def link(reference: str, other: str, transform: FloatArray, confidence: float) -> Alignment:
    return Alignment(
        reference, other, transform, "accepted", confidence, Reason.words("20 m in common")
    )


def joined_by_way_of_the_middle(transform: FloatArray, *, left: float, right: float) -> JointMap:
    alignments = [link("a/0", "b/0", STILL, left), link("b/0", "c/0", transform, right)]
    return build_joint_map({"a/0": LEFT, "b/0": MIDDLE, "c/0": WALLS}, alignments, 1)


def test_maps_that_fit_each_other_where_nobody_compared_them_change_nothing() -> None:
    joint = joined_by_way_of_the_middle(STILL, left=0.95, right=0.8)
    assert [list(c.robots) for c in joint.components] == [["a/0", "b/0", "c/0"]]
    assert joint.components[0].confidence == pytest.approx(0.8)


def test_walls_where_a_third_robot_saw_through_part_the_weakest_link_between() -> None:
    joint = joined_by_way_of_the_middle(ELSEWHERE, left=0.98, right=0.8)
    assert [list(c.robots) for c in joint.components] == [["a/0", "b/0"], ["c/0"]]
    kept, aside = joint.alignments
    assert (kept.decision, aside.decision) == ("accepted", "ambiguous")
    assert kept.status == Status(StatusKind.RELIED_ON)
    assert aside.status == Status(StatusKind.SET_ASIDE, (("a/0", "c/0"),))
    assert aside.cause.kind is ReasonKind.MAPS_CONTRADICT
    assert aside.cause.found == Reason.words("20 m in common")
    assert aside.reason.startswith("set aside: a/0 and c/0 would have ")
    assert "m of wall where the other saw free space" in aside.reason
    # The other one may be the wrong one: odds 49 to 4, and its own 49 to 1.
    assert joint.components[0].confidence == pytest.approx(1 / (1 + 4 / 49 + 1 / 49), abs=0.002)


def test_two_links_as_sure_as_each_other_are_both_parted() -> None:
    joint = joined_by_way_of_the_middle(ELSEWHERE, left=0.9, right=0.9)
    assert [list(c.robots) for c in joint.components] == [["a/0"], ["b/0"], ["c/0"]]
    for alignment in joint.alignments:
        assert alignment.status == Status(StatusKind.SET_ASIDE, (("a/0", "c/0"),))
        assert alignment.cause.kind is ReasonKind.MAPS_CONTRADICT_JOINTLY
        assert "by this alignment or another one between them" in alignment.reason
        assert alignment.confidence == pytest.approx(0.5, abs=0.01)


def test_a_little_contradiction_makes_less_sure_and_parts_nothing() -> None:
    """One wall of 6 m too many: 2.3 m beyond the allowance, which is less than two sure links."""
    ghost = np.array([[4.0, 0.9, 10.0, 0.9]])
    haunted = LineMap.union([WALLS, line_map(ghost)])
    alignments = [link("a/0", "b/0", STILL, 0.95), link("b/0", "c/0", STILL, 0.95)]
    joint = build_joint_map({"a/0": LEFT, "b/0": MIDDLE, "c/0": haunted}, alignments, 1)
    assert len(joint.components) == 1
    assert 0.5 < joint.components[0].confidence < 0.8


@pytest.mark.parametrize("confidence", [0.7, 0.99])
def test_what_maps_saw_decides_a_cycle_that_nothing_else_decides(confidence: float) -> None:
    """Three robots, one wrong alignment, the surest: no majority, but it contradicts the maps."""
    alignments = [
        link("a/0", "b/0", STILL, 0.8),
        link("b/0", "c/0", STILL, 0.8),
        link("a/0", "c/0", ELSEWHERE, confidence),
    ]
    joint = build_joint_map({"a/0": LEFT, "b/0": MIDDLE, "c/0": RIGHT}, alignments, 1)
    (component,) = joint.components
    for pose in component.robots.values():
        np.testing.assert_allclose(pose, STILL, atol=1e-9)
    assert [a.decision for a in joint.alignments] == ["accepted", "accepted", "ambiguous"]


def test_doubts_depend_on_no_frame(rng: Generator) -> None:
    frames = [random_pose(rng) for _ in range(3)]
    a, b, c = (
        shaken(lines, rng).moved(frame)
        for lines, frame in zip((LEFT, MIDDLE, WALLS), frames, strict=True)
    )
    seen_from = [se2.inverse(frame) for frame in frames]
    first = se2.compose(frames[0], seen_from[1])
    second = se2.compose(frames[1], se2.compose(ELSEWHERE, seen_from[2]))
    alignments = [link("a/0", "b/0", first, 0.98), link("b/0", "c/0", second, 0.8)]
    joint = build_joint_map({"a/0": a, "b/0": b, "c/0": c}, alignments, 1)
    assert [list(component.robots) for component in joint.components] == [["a/0", "b/0"], ["c/0"]]
