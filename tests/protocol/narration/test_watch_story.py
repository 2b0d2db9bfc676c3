"""The story of a team, as a person in charge reads it: what matters, once, with the reason."""

import numpy as np
import pytest

from mapweave.maps import (
    Alignment,
    Decision,
    JointComponent,
    JointMap,
    LineMap,
    RobotMap,
    Submap,
    Trajectory,
)
from mapweave_protocol.narration.story import Story
from mapweave_protocol.narration.story_alignments import gist
from mapweave_protocol.wire.messages import AlignmentMessage, MapVersion


def robot_map(*components: int, boot: str = "x") -> RobotMap:
    """Return the map of robot a, its submaps in these components."""
    submaps = tuple(
        Submap(number, component, np.zeros(3), LineMap.empty(), Trajectory.empty())
        for number, component in enumerate(components)
    )
    return RobotMap("a", boot, len(submaps), submaps)


def found(decision: Decision, reason: str, boot: str = "x", of: str = "a/0") -> AlignmentMessage:
    """Return what was found about robots a and b."""
    a, b = MapVersion(robot="a", boot=boot, version=1), MapVersion(robot="b", boot="y", version=1)
    alignment = Alignment(of, "b/0", np.zeros(3), decision, 0.9, reason)
    return AlignmentMessage.pack("a", a, b, [alignment])


def joint(version: int, *groups: str, sure: float = 0.9) -> JointMap:
    """Return a version in which the parts in each of `groups` are together."""
    components = [
        JointComponent(
            {name: np.zeros(3) for name in group.split()},
            sure if " " in group else 1.0,
            LineMap.empty(),
            np.empty(0),
        )
        for group in groups
    ]
    return JointMap(version, tuple(components), ())


def judged(version: int, decision: Decision, reason: str) -> JointMap:
    """Return a version with an alignment of a and b."""
    return JointMap(version, (), (Alignment("a/0", "b/0", np.zeros(3), decision, 0.9, reason),))


def told(story: Story, *joints: JointMap) -> list[str]:
    return [line for version in joints for line in story.joined(version)]


def decided(story: Story, *messages: AlignmentMessage) -> list[str]:
    return [line for message in messages for line in story.aligned(message)]


def test_a_robot_that_loses_its_way_and_finds_it_is_told_so() -> None:
    story = Story()
    maps = [robot_map(0, 0), robot_map(0, 0, 1), robot_map(0, 0, 1), robot_map(0, 0, 0)]
    lines = [line for map_ in maps for line in story.mapped(map_)]
    assert lines == [
        "a: 2 submaps, 0 segments",
        "a lost its way: a/1 begins",
        "a found its way: a/1 is a part of a/0",
    ]


def test_another_run_of_a_robot_has_not_lost_the_way_of_the_one_before() -> None:
    story = Story()
    maps = [robot_map(0, 0, 1), robot_map(0, boot="z")]
    lines = [line for map_ in maps for line in story.mapped(map_)]
    assert lines == ["a: 3 submaps in 2 components, 0 segments", "a: 1 submap, 0 segments"]


def test_a_growing_map_is_told_whenever_it_has_doubled() -> None:
    story = Story()
    lines = [line for count in range(1, 20) for line in story.mapped(robot_map(*[0] * count))]
    assert [line.split()[1] for line in lines] == ["1", "2", "4", "8", "16"]


def test_a_refusal_is_told_once_however_its_figures_change() -> None:
    story = Story()
    lines = decided(
        story,
        found("refused", "only 2.1 m of wall in common"),
        found("refused", "only 3.4 m of wall in common"),
        found("refused", "40 m of wall in common, but 12 m of wall where the other saw free space"),
        found("refused", "only 5.0 m of wall in common"),
    )
    assert lines == [
        "a/0 and b/0: refused (only 2.1 m of wall in common)",
        "a/0 and b/0: refused"
        " (40 m of wall in common, but 12 m of wall where the other saw free space)",
    ]


def test_a_join_is_told_when_it_comes_and_when_it_goes_not_when_its_evidence_grows() -> None:
    story = Story()
    lines = decided(
        story,
        found("refused", "only 2.1 m of wall in common"),
        found("accepted", "33 m of wall in common; nothing else fits"),
        found("accepted", "51 m of wall in common; next best, 7 m away, has 3 m"),
        found("ambiguous", "51 m of wall in common; but 9 m away fits as well"),
    )
    assert [line.partition(" (")[0] for line in lines] == [
        "a/0 and b/0: refused",
        "a/0 and b/0: now accepted, confidence 90%",
        "a/0 and b/0: no longer accepted, ambiguous, confidence 90%",
    ]


def test_what_was_found_of_a_part_that_became_one_with_another_is_not_told() -> None:
    story = Story()
    for map_ in (robot_map(0), robot_map(0, 1)):
        list(story.mapped(map_))
    part = found("refused", "only 2.1 m of wall in common", of="a/1")
    assert len(decided(story, part)) == 1
    list(story.mapped(robot_map(0, 0, 0)))
    assert decided(story, found("accepted", "40 m of wall in common", of="a/1")) == []
    assert len(decided(story, found("accepted", "40 m of wall in common"))) == 1


def test_what_is_found_of_another_run_is_news() -> None:
    story = Story()
    one, next_one = (found("refused", "only 2.1 m", boot=boot) for boot in "xz")
    assert len(decided(story, one, one, next_one, next_one)) == 2


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("only 2.1 m of wall in common", "only 13 m of wall in common"),
        (
            "8 m of wall in common; nothing else fits; too little to be sure (61%)",
            "10 m in common; next best, 7 m away, has 1 m; too little to be sure (78%)",
        ),
    ],
)
def test_reasons_of_one_kind_have_one_gist(one: str, other: str) -> None:
    assert gist(one) == gist(other)


def test_versions_that_change_neither_who_is_together_nor_how_surely_are_not_told() -> None:
    story = Story()
    lines = told(
        story,
        joint(1, "a/0"),
        joint(2, "a/0", "b/0"),
        joint(3, "a/0 b/0", "c/0"),
        joint(4, "a/0 b/0", "c/0", sure=0.92),
        joint(5, "a/0 b/0", "c/0", "c/1", sure=0.94),
    )
    assert lines == [
        "joint map 1: alone: a/0",
        "joint map 3: a/0 + b/0 (90%), alone: c/0",
    ]
    assert story.joint is not None
    assert story.joint.version == 5


def test_a_version_that_parts_what_was_together_says_so() -> None:
    story = Story()
    lines = told(
        story,
        joint(1, "a/0 b/0 c/0"),
        joint(2, "a/0 b/0", "c/0"),
        joint(3, "a/0", "b/0", "c/0"),
    )
    assert lines[1:] == [
        "joint map 2 comes apart: a/0 + b/0 (90%), alone: c/0",
        "joint map 3 comes apart: alone: a/0, b/0, c/0",
    ]


def test_a_part_that_became_one_with_another_has_not_come_apart() -> None:
    story = Story()
    lines = told(story, joint(1, "a/0 a/1 b/0"), joint(2, "a/0 b/0"))
    assert lines[1] == "joint map 2: a/0 + b/0 (90%)"


def test_a_confidence_that_moved_since_it_was_told_is_told_with_what_it_was() -> None:
    story = Story()
    versions = [joint(number, "a/0 b/0", sure=0.90 + 0.02 * number) for number in range(1, 5)]
    lines = told(story, *versions)
    assert lines[1:] == ["joint map 4: a/0 + b/0 is now 98% sure, 92% before"]


def test_an_alignment_relied_on_again_is_told() -> None:
    story = Story()

    def judged(version: int, decision: Decision, reason: str) -> JointMap:
        return JointMap(version, (), (Alignment("a/0", "b/0", np.zeros(3), decision, 0.9, reason),))

    told(story, judged(1, "ambiguous", "set aside: 9 m off what a/0-c/0 says"))
    decided(story, found("accepted", "33 m of wall in common"))
    lines = told(story, *(judged(n, "accepted", "33 m of wall in common") for n in (2, 3)))
    assert lines == ["a/0 and b/0: alignment relied on again"]


def test_who_comes_late_hears_the_reasons_from_the_joint_map_once() -> None:
    story = Story()
    late = told(story, judged(7, "refused", "only 2.1 m"), judged(8, "refused", "only 2.2 m"))
    assert late[1:] == ["a/0 and b/0: refused (only 2.1 m)"]
    assert decided(story, found("refused", "only 2.3 m")) == []
    assert len(decided(story, found("refused", "only 2.3 m", boot="z"))) == 1
