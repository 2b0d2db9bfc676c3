"""When a version is due, what goes into it, and that the numbers leave no gap."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.maps import JointMap, RobotMap
from mapweave.team.joint_builder import JointMapBuilder
from mapweave_fusion_server.coordinator import (
    MAX_RUNS,
    Coordinator,
    CoordinatorParameters,
)
from mapweave_fusion_server.draft import Draft
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import JointMapMessage
from mapweave_protocol.wire.model import WORLD_REACH

if TYPE_CHECKING:
    from tests.fusion_server.conftest import MakeAlignments, MakeMap


def _coordinator(last_version: int = 0, **parameters: float) -> Coordinator:
    last = JointMap(last_version, (), ()) if last_version else None
    return Coordinator(CoordinatorParameters.model_validate(parameters), last)


def _make_version(coordinator: Coordinator, now: float = 0.0) -> Draft:
    draft = coordinator.begin(now)
    coordinator.finish(JointMap(draft.version, (), draft.alignments))
    return draft


def _decisions(draft: Draft) -> list[str]:
    return [alignment.decision for alignment in draft.alignments]


def test_the_furthest_alignment_that_may_arrive_makes_a_version_that_can_be_sent(
    make_map: MakeMap, make_alignments: MakeAlignments
) -> None:
    coordinator = _coordinator()
    maps = make_map("a"), make_map("b")
    for robot_map in maps:
        coordinator.receive_map(robot_map)
    coordinator.receive_alignments(make_alignments(*maps, transform=(WORLD_REACH, 0.0, 0.0)))
    encode(JointMapMessage.pack(_make_version(coordinator).build(JointMapBuilder()), "s1"))


def test_no_version_is_due_before_anything_was_received() -> None:
    assert _coordinator().seconds_until_due(1e9) == math.inf


def test_the_first_map_is_due_at_once(make_map: MakeMap) -> None:
    coordinator = _coordinator()
    assert coordinator.receive_map(make_map("a"))
    assert coordinator.seconds_until_due(0.0) == 0.0
    draft = _make_version(coordinator)
    assert draft.version == 1
    assert [robot_map.robot for robot_map in draft.maps] == ["a"]


def test_no_version_is_due_when_nothing_changed(
    make_map: MakeMap, make_alignments: MakeAlignments
) -> None:
    coordinator = _coordinator()
    a, b = make_map("a"), make_map("b")
    for _ in range(3):
        coordinator.receive_map(a)
        coordinator.receive_map(b)
        coordinator.receive_alignments(make_alignments(a, b))
        if coordinator.has_news:
            _make_version(coordinator)
    assert coordinator.begin(0.0).version == 2


def test_a_growing_map_waits_for_the_interval(make_map: MakeMap) -> None:
    coordinator = _coordinator(min_interval=2.0)
    coordinator.receive_map(make_map("a", 1))
    _make_version(coordinator, now=10.0)
    coordinator.receive_map(make_map("a", 2))
    assert coordinator.seconds_until_due(10.5) == pytest.approx(1.5)
    assert coordinator.seconds_until_due(12.0) == 0.0
    assert coordinator.seconds_until_due(1e9) == 0.0


@pytest.mark.parametrize(("before", "after"), [("refused", "accepted"), ("accepted", "refused")])
def test_joining_and_parting_do_not_wait(
    make_map: MakeMap, make_alignments: MakeAlignments, before: str, after: str
) -> None:
    coordinator = _coordinator(min_interval=1e6)
    a, b = make_map("a"), make_map("b")
    for robot_map in (a, b):
        coordinator.receive_map(robot_map)
    coordinator.receive_alignments(make_alignments(a, b, before))
    assert _decisions(_make_version(coordinator)) == [before]
    coordinator.receive_alignments(make_alignments(a, b, after))
    assert coordinator.seconds_until_due(0.0) == 0.0
    assert _decisions(_make_version(coordinator)) == [after]


def test_a_join_does_not_wait_for_the_growth_that_comes_after_it(
    make_map: MakeMap, make_alignments: MakeAlignments
) -> None:
    coordinator = _coordinator(min_interval=1e6)
    a, b = make_map("a"), make_map("b")
    for robot_map in (a, b):
        coordinator.receive_map(robot_map)
    _make_version(coordinator)
    coordinator.receive_alignments(make_alignments(a, b))
    coordinator.receive_map(make_map("a", 2))
    assert coordinator.seconds_until_due(0.0) == 0.0


def test_a_moved_transform_waits_for_the_interval(
    make_map: MakeMap, make_alignments: MakeAlignments
) -> None:
    coordinator = _coordinator(min_interval=2.0)
    a, b = make_map("a"), make_map("b")
    coordinator.receive_map(a)
    coordinator.receive_map(b)
    coordinator.receive_alignments(make_alignments(a, b))
    _make_version(coordinator)
    coordinator.receive_alignments(make_alignments(a, b, transform=(0.1, 0.0, 0.0)))
    assert coordinator.seconds_until_due(0.0) == 2.0
    np.testing.assert_allclose(_make_version(coordinator).alignments[0].transform, [0.1, 0, 0])


def test_what_arrives_while_building_goes_into_one_next_version(make_map: MakeMap) -> None:
    coordinator = _coordinator(min_interval=0.0)
    coordinator.receive_map(make_map("a"))
    first = coordinator.begin(0.0)
    for robot in "bcd":
        coordinator.receive_map(make_map(robot))
        assert coordinator.seconds_until_due(100.0) == math.inf
    coordinator.finish(JointMap(first.version, (), ()))
    draft = _make_version(coordinator, now=100.0)
    assert draft.version == 2
    assert [robot_map.robot for robot_map in draft.maps] == ["a", "b", "c", "d"]
    assert not coordinator.has_news


def test_a_version_that_could_not_be_built_leaves_its_number_to_the_next(
    make_map: MakeMap,
) -> None:
    coordinator = _coordinator()
    coordinator.receive_map(make_map("a"))
    assert coordinator.begin(0.0).version == 1
    coordinator.finish(None)
    assert not coordinator.has_news
    coordinator.receive_map(make_map("b"))
    assert coordinator.begin(0.0).version == 1


def test_another_version_follows_one_that_left_something_to_be_made(make_map: MakeMap) -> None:
    coordinator = _coordinator(min_interval=2.0)
    coordinator.receive_map(make_map("a"))
    first = coordinator.begin(0.0)
    coordinator.finish(JointMap(first.version, (), ()), has_more=True)
    assert coordinator.is_pending
    assert coordinator.seconds_until_due(0.5) == 1.5
    assert _make_version(coordinator, now=2.0).version == 2
    assert not coordinator.is_pending


def test_a_version_that_only_compares_what_was_left_is_overtaken_by_what_comes(
    make_map: MakeMap,
) -> None:
    coordinator = _coordinator(min_interval=2.0)
    coordinator.receive_map(make_map("a"))
    first = coordinator.begin(0.0)
    assert coordinator.is_awaited
    coordinator.finish(JointMap(first.version, (), ()), has_more=True)
    coordinator.begin(7.0)
    assert not coordinator.is_awaited
    assert not coordinator.is_overtaken()
    coordinator.receive_map(make_map("b"))
    assert coordinator.is_overtaken()
    coordinator.finish(None)
    assert coordinator.seconds_until_due(7.1) == 0.0
    assert _make_version(coordinator, now=7.1).version == 2


def test_a_version_is_begun_anew_once_for_a_map_that_comes_meanwhile(make_map: MakeMap) -> None:
    coordinator = _coordinator(min_interval=2.0)
    coordinator.receive_map(make_map("a"))
    coordinator.begin(0.0)
    assert not coordinator.is_overtaken()
    coordinator.receive_map(make_map("b"))
    assert coordinator.is_overtaken()
    coordinator.finish(None)
    assert coordinator.seconds_until_due(0.5) == 0.0
    anew = coordinator.begin(0.5)
    assert len(anew.maps) == 2
    coordinator.receive_map(make_map("c"))
    assert not coordinator.is_overtaken()
    coordinator.finish(JointMap(anew.version, (), ()))
    assert coordinator.begin(3.0).version == anew.version + 1
    coordinator.receive_map(make_map("d"))
    assert coordinator.is_overtaken()


def test_what_was_found_of_a_pair_does_not_overtake_a_version_that_is_awaited(
    make_map: MakeMap, make_alignments: MakeAlignments
) -> None:
    coordinator = _coordinator()
    a, b = make_map("a"), make_map("b")
    coordinator.receive_map(a)
    coordinator.receive_map(b)
    coordinator.begin(0.0)
    coordinator.receive_alignments(make_alignments(a, b))
    assert coordinator.has_news
    assert not coordinator.is_overtaken()


def test_what_follows_a_version_that_was_given_up_is_as_urgent(
    make_map: MakeMap, make_alignments: MakeAlignments
) -> None:
    coordinator = _coordinator(min_interval=2.0)
    a, b = make_map("a"), make_map("b")
    coordinator.receive_map(a)
    coordinator.receive_map(b)
    _make_version(coordinator, now=0.0)
    coordinator.receive_alignments(make_alignments(a, b))
    coordinator.begin(0.1)
    coordinator.receive_map(make_map("c"))
    assert coordinator.seconds_until_due(0.2) == math.inf
    coordinator.finish(None)
    assert coordinator.seconds_until_due(0.2) == 0.0


def test_what_follows_a_version_that_could_not_be_built_keeps_the_interval(
    make_map: MakeMap, make_alignments: MakeAlignments
) -> None:
    coordinator = _coordinator(min_interval=2.0)
    a, b = make_map("a"), make_map("b")
    coordinator.receive_map(a)
    coordinator.receive_map(b)
    coordinator.receive_alignments(make_alignments(a, b))
    coordinator.begin(1.0)
    coordinator.receive_map(make_map("c"))
    coordinator.finish(None, has_failed=True)
    assert coordinator.seconds_until_due(1.5) == 1.5
    coordinator.begin(3.0)
    coordinator.receive_map(make_map("d"))
    assert coordinator.is_overtaken()  # it was not begun anew: the last one just failed


def test_numbering_goes_on_after_a_restart(make_map: MakeMap) -> None:
    coordinator = _coordinator(last_version=41)
    coordinator.receive_map(make_map("a"))
    assert _make_version(coordinator).version == 42


def test_what_was_restored_is_no_news_until_something_is_added(make_map: MakeMap) -> None:
    coordinator = _coordinator(last_version=41)
    coordinator.receive_map(make_map("a"))
    coordinator.forget_news()
    assert coordinator.seconds_until_due(1e9) == math.inf
    assert not coordinator.receive_map(make_map("a"))
    coordinator.receive_map(make_map("b"))
    assert [robot_map.robot for robot_map in coordinator.begin(0.0).maps] == ["a", "b"]


def test_an_older_map_of_the_same_run_is_ignored(make_map: MakeMap) -> None:
    coordinator = _coordinator()
    newest = make_map("a", 5)
    coordinator.receive_map(newest)
    assert not coordinator.receive_map(make_map("a", 4))
    assert coordinator.map_of("a") is newest


def test_each_run_of_a_robot_keeps_its_map(make_map: MakeMap) -> None:
    coordinator = _coordinator()
    first, second = make_map("a", 9, boot="first"), make_map("a", 1, boot="second", first=1)
    assert coordinator.receive_map(second)
    assert coordinator.receive_map(first)
    assert coordinator.map_of("a") is second
    assert coordinator.version_of("a", "first") == 9
    assert _make_version(coordinator).maps == (first, second)


def test_runs_that_claim_the_same_components_are_both_there_named_by_their_boots(
    make_map: MakeMap, make_alignments: MakeAlignments
) -> None:
    coordinator = _coordinator()
    first, second, b = make_map("a", 9, boot="first"), make_map("a", boot="second"), make_map("b")
    for robot_map in (first, b):
        coordinator.receive_map(robot_map)
    coordinator.receive_alignments(make_alignments(first, b))
    assert not coordinator.clashes(first)
    assert [m.robot for m in _make_version(coordinator).maps] == ["a", "b"]
    assert coordinator.receive_map(second)
    coordinator.receive_alignments(make_alignments(second, b, "refused"))
    coordinator.receive_alignments(make_alignments(first, second))
    assert coordinator.clashes(first) and coordinator.clashes(second)
    version = _make_version(coordinator)
    assert [m.robot for m in version.maps] == ["a@first", "a@second", "b"]
    assert [(al.reference, al.other) for al in version.alignments] == [
        ("a@first/0", "b/0"),
        ("a@second/0", "b/0"),
        ("a@first/0", "a@second/0"),
    ]


def test_of_one_robot_there_are_no_more_runs_than_so_many(make_map: MakeMap) -> None:
    coordinator = _coordinator()
    runs = [make_map("a", boot=f"b{number}", first=number) for number in range(MAX_RUNS + 1)]
    assert [coordinator.receive_map(run) for run in runs] == [True] * MAX_RUNS + [False]


def test_a_run_that_has_mapped_nothing_yet_replaces_nothing(make_map: MakeMap) -> None:
    coordinator = _coordinator()
    first = make_map("a", 9)
    coordinator.receive_map(first)
    assert not coordinator.receive_map(make_map("a", 1, boot="second", components=0))
    assert coordinator.map_of("a") is first


def test_alignments_of_a_run_that_is_over_stay(
    make_map: MakeMap, make_alignments: MakeAlignments
) -> None:
    coordinator = _coordinator()
    a, b, second = make_map("a"), make_map("b"), make_map("a", boot="second", first=1)
    for robot_map in (a, b, second):
        coordinator.receive_map(robot_map)
    coordinator.receive_alignments(make_alignments(a, b))
    coordinator.receive_alignments(make_alignments(second, b, "refused"))
    coordinator.receive_alignments(make_alignments(second, a))
    pairs = [(al.reference, al.other) for al in _make_version(coordinator).alignments]
    assert pairs == [("a/0", "b/0"), ("a/1", "b/0"), ("a/1", "a/0")]


def test_alignments_that_arrive_before_their_maps_count_once_those_are_there(
    make_map: MakeMap, make_alignments: MakeAlignments
) -> None:
    coordinator = _coordinator()
    a, b = make_map("a"), make_map("b")
    coordinator.receive_alignments(make_alignments(a, b))
    coordinator.receive_map(a)
    assert _decisions(_make_version(coordinator)) == []
    coordinator.receive_map(b)
    assert _decisions(_make_version(coordinator)) == ["accepted"]


def test_alignments_of_a_component_that_is_gone_are_dropped(
    make_map: MakeMap, make_alignments: MakeAlignments
) -> None:
    coordinator = _coordinator()
    a, b = make_map("a"), make_map("b")
    moved = RobotMap("a", "first", 2, tuple(replace(s, component=3) for s in a.submaps))
    coordinator.receive_map(moved)
    coordinator.receive_map(b)
    coordinator.receive_alignments(make_alignments(a, b))
    assert _decisions(_make_version(coordinator)) == []


def test_alignments_from_older_maps_do_not_replace_newer_ones_whoever_found_them(
    make_map: MakeMap, make_alignments: MakeAlignments
) -> None:
    coordinator = _coordinator()
    a, b = make_map("a", 4), make_map("b", 7)
    coordinator.receive_map(a)
    coordinator.receive_map(b)
    coordinator.receive_alignments(make_alignments(a, b, "accepted"))
    assert not coordinator.receive_alignments(make_alignments(b, make_map("a", 3), "refused"))
    assert _decisions(_make_version(coordinator)) == ["accepted"]
    coordinator.receive_alignments(make_alignments(b, make_map("a", 5), "refused"))
    assert _decisions(_make_version(coordinator)) == ["refused"]


def test_robots_beyond_the_limit_are_not_heard(
    make_map: MakeMap, make_alignments: MakeAlignments
) -> None:
    coordinator = _coordinator(max_robots=2)
    a, b, c = (make_map(robot) for robot in "abc")
    assert coordinator.receive_map(a)
    assert coordinator.receive_map(b)
    assert not coordinator.receive_map(c)
    assert not coordinator.receive_alignments(make_alignments(a, c))
    assert coordinator.receive_alignments(make_alignments(a, b))


def test_an_alignment_moves_with_the_submap_it_was_found_on(
    make_map: MakeMap, make_alignments: MakeAlignments
) -> None:
    """Robot b corrects its map after it was compared; until it is compared again, this holds."""
    coordinator = _coordinator()
    a, b = make_map("a"), make_map("b", 1)
    coordinator.receive_map(a)
    coordinator.receive_map(b)
    coordinator.receive_alignments(make_alignments(a, b, transform=(4.0, 0.0, 0.0)))
    correction = np.array([0.5, -0.3, 0.2])
    later = RobotMap("b", "first", 2, tuple(replace(s, pose=correction) for s in b.submaps))
    coordinator.receive_map(later)
    (alignment,) = _make_version(coordinator).alignments
    np.testing.assert_allclose(
        se2.compose(alignment.transform, correction), [4.0, 0.0, 0.0], atol=1e-9
    )
    coordinator.receive_alignments(make_alignments(a, later, transform=(4.1, 0.0, 0.0)))
    (alignment,) = _make_version(coordinator).alignments
    np.testing.assert_array_equal(alignment.transform, [4.1, 0.0, 0.0])
