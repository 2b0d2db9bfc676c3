"""The story of a team, as a person in charge reads it: what matters, once, with the reason."""

import numpy as np

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
from mapweave.reasons import Reason, ReasonKind, Status, StatusKind
from mapweave_protocol.narration.story import Story
from mapweave_protocol.wire.messages import AlignmentMessage, MapVersion


def robot_map(*components: int, boot: str = "x") -> RobotMap:
    """Return the map of robot a, its submaps in these components."""
    submaps = tuple(
        Submap(number, component, np.zeros(3), LineMap.empty(), Trajectory.empty())
        for number, component in enumerate(components)
    )
    return RobotMap("a", boot, len(submaps), submaps)


def found(decision: Decision, cause: Reason, boot: str = "x", of: str = "a/0") -> AlignmentMessage:
    """Return what was found about robots a and b."""
    a, b = MapVersion(robot="a", boot=boot, version=1), MapVersion(robot="b", boot="y", version=1)
    alignment = Alignment(of, "b/0", np.zeros(3), decision, 0.9, cause)
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


def judged(
    version: int, decision: Decision, cause: Reason, status: Status | None = None
) -> JointMap:
    """Return a version with an alignment of a and b."""
    alignment = Alignment("a/0", "b/0", np.zeros(3), decision, 0.9, cause, status=status)
    return JointMap(version, (), (alignment,))


def little(common: float) -> Reason:
    return Reason(ReasonKind.LITTLE_COMMON, {"common": common})


def match(kind: ReasonKind, common: float, contradicted: float = 0.0, **others: float) -> Reason:
    return Reason(kind, {"common": common, "contradicted": contradicted, **others})


RIVAL = {"distance": 7.0, "turn": 0.0, "rival_common": 3.0, "rival_contradicted": 0.0}


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


def test_the_map_of_an_earlier_run_does_not_replace_that_of_the_later() -> None:
    story = Story()
    maps = [robot_map(1, 1, boot="z"), robot_map(0)]
    assert [list(story.mapped(map_)) for map_ in maps] == [["a: 2 submaps, 0 segments"], []]
    assert story.robots["a"].submaps == 2


def test_a_growing_map_is_told_whenever_it_has_doubled() -> None:
    story = Story()
    lines = [line for count in range(1, 20) for line in story.mapped(robot_map(*[0] * count))]
    assert [line.split()[1] for line in lines] == ["1", "2", "4", "8", "16"]


def test_a_refusal_is_told_once_however_its_figures_change() -> None:
    story = Story()
    lines = decided(
        story,
        found("refused", little(2.1)),
        found("refused", little(3.4)),
        found("refused", match(ReasonKind.CONTRADICTED, 40, 12)),
        found("refused", little(5)),
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
        found("refused", little(2.1)),
        found("accepted", match(ReasonKind.CONVINCING, 33)),
        found("accepted", match(ReasonKind.CONVINCING, 51, **RIVAL)),
        found("ambiguous", match(ReasonKind.RIVAL, 51, **RIVAL)),
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
    part = found("refused", little(2.1), of="a/1")
    assert len(decided(story, part)) == 1
    list(story.mapped(robot_map(0, 0, 0)))
    assert decided(story, found("accepted", match(ReasonKind.CONVINCING, 40), of="a/1")) == []
    assert len(decided(story, found("accepted", match(ReasonKind.CONVINCING, 40)))) == 1


def test_what_is_found_of_another_run_is_news() -> None:
    story = Story()
    one, next_one = (found("refused", little(2.1), boot=boot) for boot in "xz")
    assert len(decided(story, one, one, next_one, next_one)) == 2


def test_a_reason_of_the_same_kind_is_told_once_whatever_its_numbers() -> None:
    story = Story()
    lines = decided(
        story,
        found("ambiguous", match(ReasonKind.UNSURE, 8, confidence=0.61)),
        found("ambiguous", match(ReasonKind.UNSURE, 10, confidence=0.78, **RIVAL)),
        found("ambiguous", match(ReasonKind.PARALLEL, 10)),
        found("ambiguous", match(ReasonKind.UNSURE, 9, confidence=0.7)),
    )
    assert [line.rpartition("; ")[2] for line in lines] == [
        "too little to be sure of the place (61%))",
        "nearly all of it parallel, so one may slide along the other)",
    ]


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
    convincing = match(ReasonKind.CONVINCING, 33)
    aside = Reason(ReasonKind.UNDECIDED, found=convincing)
    told(story, judged(1, "ambiguous", aside, Status(StatusKind.SET_ASIDE)))
    decided(story, found("accepted", convincing))
    relied_on = Status(StatusKind.RELIED_ON)
    lines = told(story, *(judged(n, "accepted", convincing, relied_on) for n in (2, 3)))
    assert lines == ["a/0 and b/0: alignment relied on again"]


def test_a_join_that_is_held_because_the_robots_met_before_is_relied_on() -> None:
    story = Story()
    cause = Reason(ReasonKind.MET_BEFORE, found=match(ReasonKind.CONVINCING, 33))
    lines = told(story, *(judged(n, "accepted", cause, Status(StatusKind.HELD)) for n in (1, 2)))
    assert lines[1:] == [
        "a/0 and b/0: accepted, confidence 90% (the robots met before;"
        " 33 m of wall in common, 0.0 m contradicted; nothing else fits)"
    ]


def test_who_comes_late_hears_the_reasons_from_the_joint_map_once() -> None:
    story = Story()
    late = told(story, judged(7, "refused", little(2.1)), judged(8, "refused", little(2.2)))
    assert late[1:] == ["a/0 and b/0: refused (only 2.1 m of wall in common)"]
    assert decided(story, found("refused", little(2.3))) == []
    assert len(decided(story, found("refused", little(2.3), boot="z"))) == 1
