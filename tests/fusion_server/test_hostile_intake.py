"""One forged message neither mutes a robot, nor joins maps, nor keeps newcomers out."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from mapweave.maps import RobotMap
from mapweave_fusion_server.coordinator import (
    MAX_RUNS,
    REMEMBERED_STATES,
    Coordinator,
    CoordinatorParameters,
)
from mapweave_fusion_server.early import MOST
from mapweave_fusion_server.intake import ASKED_AFTER, FAR, Intake
from mapweave_fusion_server.journal import INTERVAL, MOST_LINES
from mapweave_fusion_server.store import Store
from mapweave_protocol.link.assembler import MapSender
from mapweave_protocol.link.guard import strangers
from mapweave_protocol.link.inbox import Arrival
from mapweave_protocol.narration.story import Story
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import (
    AlignmentMessage,
    MapMessage,
    MarksMessage,
    StatusMessage,
)
from mapweave_protocol.wire.status_message import MAX_PEERS

if TYPE_CHECKING:
    from tests.fusion_server.conftest import MakeAlignments, MakeMap

LIMIT = 3  # robots


class Hearing:
    """An intake on a store of its own."""

    def __init__(self, store: Store, robots: int = LIMIT) -> None:
        self.store = store
        self.story = Story()
        self.coordinator = Coordinator(CoordinatorParameters(max_robots=robots))
        self.intake = Intake(self.coordinator, store, self.story)

    def map(self, robot_map: RobotMap) -> None:
        """Let a whole map come."""
        key = keys.MAP.build(team="t", robot=robot_map.robot)
        self.intake.take(Arrival(key, MapSender().payload(robot_map)), 0.0)

    def alignments(self, message: AlignmentMessage) -> None:
        """Let what was found come."""
        parts = {"reference": message.reference.robot, "other": message.other.robot}
        key = keys.ALIGNMENT.build(team="t", robot=message.robot, **parts)
        self.intake.take(Arrival(key, encode(message)), 0.0)

    def marks(self, robot: str, boot: str) -> None:
        """Let a run say that it made no mark."""
        key = keys.MARK.build(team="t", robot=robot)
        self.intake.take(Arrival(key, encode(MarksMessage.pack(robot, boot, 1, []))), 0.0)

    def presence(self, robot: str, boot: str, *, gone: bool = False) -> None:
        """Let a token come or go."""
        key = keys.LIVE.build(team="t", robot=robot, boot=boot)
        self.intake.take(Arrival(key, b"", gone), 0.0)

    def status(self, robot: str, version: int, boot: str = "first") -> None:
        """Let a robot say which version it has come to."""
        counts = dict.fromkeys(("scans_seen", "scans_placed", "components", "submaps"), 1)
        fields = {"robot": robot, "boot": boot, "stamp": 0.0, "state": "mapping"}
        message = StatusMessage.model_validate({**counts, **fields, "map_version": version})
        self.intake.take(Arrival(keys.STATUS.build(team="t", robot=robot), encode(message)), 0.0)

    @property
    def joined(self) -> int:
        """How many alignments count."""
        draft = self.coordinator.begin(0.0)
        self.coordinator.finish(None)
        return len(draft.alignments)


@pytest.fixture
def hearing(tmp_path: Path) -> Iterator[Hearing]:
    with Store(tmp_path / "store.sqlite", "t") as store:
        yield Hearing(store)


def test_a_map_of_a_version_out_of_reach_is_refused_and_the_robot_goes_on(
    hearing: Hearing, make_map: MakeMap
) -> None:
    hearing.map(make_map("a", 5))
    hearing.map(make_map("a", 2**53))
    hearing.map(make_map("a", 6))
    assert hearing.coordinator.version_of("a", "first") == 6
    assert hearing.intake.refusals.total == 1


def test_a_map_that_is_not_from_the_robot_gives_way_when_that_says_how_far_it_is(
    hearing: Hearing, make_map: MakeMap
) -> None:
    hearing.map(make_map("a", 5))
    hearing.map(make_map("a", FAR // 2, components=3))  # forged, in reach
    hearing.status("a", 6)
    assert hearing.intake.robots_to_ask(0.0) == ([], [])  # it may be on its way
    hearing.status("a", 6)
    assert hearing.intake.robots_to_ask(ASKED_AFTER) == (["a"], [])
    hearing.map(make_map("a", 6))  # what it answers
    assert hearing.coordinator.version_of("a", "first") == 6
    held = hearing.coordinator.map_of("a")
    assert held is not None and len(held.submaps) == 1
    hearing.map(make_map("a", 7))
    assert hearing.coordinator.version_of("a", "first") == 7


def test_what_was_found_about_a_state_that_never_was_does_not_stand_in_the_way(
    hearing: Hearing, make_map: MakeMap, make_alignments: MakeAlignments
) -> None:
    b, forged = make_map("b"), make_map("a", FAR // 2)
    hearing.map(b)
    hearing.map(forged)
    hearing.alignments(make_alignments(b, forged))
    assert hearing.joined == 1
    for now in (0.0, ASKED_AFTER):
        hearing.status("a", 2)
        hearing.intake.robots_to_ask(now)
    right = make_map("a", 2)
    hearing.map(right)
    assert hearing.joined == 0
    hearing.alignments(make_alignments(b, right))
    assert hearing.joined == 1


def test_nobody_joins_two_others(
    hearing: Hearing, make_map: MakeMap, make_alignments: MakeAlignments
) -> None:
    a, b, c = (make_map(robot) for robot in "abc")
    for robot_map in (a, b, c):
        hearing.map(robot_map)
    said = make_alignments(a, b).model_copy(update={"robot": "c"})
    hearing.alignments(said)
    assert hearing.joined == 0
    assert hearing.store.last_alignments() == []
    assert dict(hearing.intake.refusals.counts).popitem()[0][0] == "c"


def test_alignments_count_when_the_maps_that_they_are_about_are_here(
    hearing: Hearing, make_map: MakeMap, make_alignments: MakeAlignments
) -> None:
    a, b = make_map("a"), make_map("b", 4 + REMEMBERED_STATES)
    hearing.map(a)
    hearing.map(make_map("b", 3))
    hearing.alignments(make_alignments(a, b))
    assert (hearing.joined, hearing.store.last_alignments()) == (0, [])
    hearing.map(b)
    assert hearing.joined == 1
    assert len(hearing.store.last_alignments()) == 1


def test_alignments_about_maps_of_nobody_are_neither_stored_nor_kept_without_end(
    hearing: Hearing, make_map: MakeMap, make_alignments: MakeAlignments
) -> None:
    a = make_map("a")
    hearing.map(a)
    for number in range(3 * MOST):
        hearing.alignments(make_alignments(a, make_map("b", boot=f"b{number}")))
    assert len(hearing.intake._early._found) == MOST
    assert hearing.store.last_alignments() == []
    assert hearing.coordinator.alignments_held == ()


def test_invented_names_keep_nobody_out_and_are_forgotten(
    hearing: Hearing, make_map: MakeMap
) -> None:
    hearing.map(make_map("a"))
    hearing.presence("a", "first")
    for number in range(10 * strangers.MOST):
        hearing.presence(f"x{number}", "boot")
        hearing.status(f"x{number}", 1)
    hearing.map(make_map("b"))
    assert hearing.coordinator.version_of("b", "first") == 1
    assert len(hearing.story.robots) <= strangers.MOST + 2
    assert {"a", "b"} <= hearing.story.robots.keys()


def test_who_comes_and_goes_fills_no_log(
    hearing: Hearing, caplog: pytest.LogCaptureFixture
) -> None:
    """A minute has so many lines, and the next one says how many were left out."""
    caplog.set_level(logging.INFO)
    for number in range(1000):
        hearing.presence(f"x{number}", "boot")
    assert len(caplog.records) == MOST_LINES
    hearing.intake.look(2 * INTERVAL, linked=True)
    hearing.presence("late", "boot")
    left_out, late = (record.getMessage() for record in caplog.records[MOST_LINES:])
    assert left_out == f"{1000 - MOST_LINES} more lines about who comes and goes were left out"
    assert late.startswith("late")


def test_invented_runs_of_a_robot_are_bounded(hearing: Hearing, make_map: MakeMap) -> None:
    hearing.map(make_map("a"))
    for number in range(1000):
        hearing.presence("a", f"boot{number}")
    [report] = hearing.intake.reports
    assert report.runs <= 64


def test_robots_beyond_the_limit_are_refused_and_counted(
    hearing: Hearing, make_map: MakeMap
) -> None:
    for robot in "abcd":
        hearing.map(make_map(robot))
    assert len(hearing.coordinator.maps) == LIMIT
    assert hearing.intake.refusals.counts == {("d", MapMessage.format): 1}


def test_what_the_status_says_stays_within_what_it_may_say(
    tmp_path: Path, make_map: MakeMap
) -> None:
    with Store(tmp_path / "store.sqlite", "t") as store:
        hearing = Hearing(store, robots=64)
        for robot in range(20):
            for run in range(MAX_RUNS):
                boot = f"b{run}"
                hearing.map(make_map(f"r{robot}", boot=boot, first=run))
                hearing.marks(f"r{robot}", boot)
                hearing.marks(f"r{robot}", f"invented{run}")
        assert len(hearing.coordinator.maps_held) == MAX_PEERS
        assert len(hearing.coordinator.marks_held) == MAX_PEERS
