"""What leaves the intake whatever arrives: nothing."""

import logging
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave_fusion_server.coordinator import Coordinator, CoordinatorParameters
from mapweave_fusion_server.intake import ASKED_AFTER, Intake
from mapweave_fusion_server.store import Store
from mapweave_protocol.link.assembler import MapSender
from mapweave_protocol.link.inbox import Arrival
from mapweave_protocol.narration.attendance import GRACE
from mapweave_protocol.narration.story import Story
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.coding import entropy
from mapweave_protocol.wire.keys import LIVE, MAP, STATUS
from mapweave_protocol.wire.messages import StatusMessage

SEGMENTS = 100


def _submap(number: int) -> Submap:
    rng = np.random.default_rng(number)
    starts = rng.uniform(-900, 900, (SEGMENTS, 2))
    segments = np.hstack([starts, starts + rng.uniform(0.1, 0.4, (SEGMENTS, 2))])
    support = rng.integers(0, 2**31, SEGMENTS)
    lines = LineMap(segments, np.arange(SEGMENTS), support, ())
    return Submap(number, 0, np.zeros(3), lines, Trajectory.empty())


def test_a_map_that_is_too_large_as_a_whole_is_logged_once_and_dropped(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(entropy, "MAX_NUMBERS", 4 * 9 * SEGMENTS)  # 5 to 8 of each segment
    submaps = tuple(_submap(number) for number in range(8))
    sender, key = MapSender(), MAP.build(team="t", robot="a")
    with Store(tmp_path / "store.sqlite", "t") as store:
        coordinator = Coordinator(CoordinatorParameters())
        intake = Intake(coordinator, store, Story())
        for version, count in [(1, 4), (2, 8), (3, 8)]:
            robot_map = RobotMap("a", "first", version, submaps[:count])
            intake.take(Arrival(key, sender.payload(robot_map)), 0.0)
    held = coordinator.map_of("a")
    assert held is not None
    assert held.version == 1
    [warning] = [record for record in caplog.records if record.levelno >= logging.WARNING]
    assert "map of a ignored" in warning.getMessage()


def _status(version: int, boot: str = "first", submaps: int = 1) -> Arrival:
    counts = dict.fromkeys(("scans_seen", "scans_placed", "components"), 1)
    fields = {"robot": "a", "boot": boot, "stamp": 0.0, "state": "mapping"}
    message = StatusMessage.model_validate(
        {**counts, **fields, "submaps": submaps, "map_version": version}
    )
    return Arrival(STATUS.build(team="t", robot="a"), encode(message))


@pytest.mark.parametrize(
    ("status", "asked"),
    [
        (_status(3), []),
        (_status(4), ["a"]),
        (_status(1, "another"), ["a"]),
        (_status(1, "another", submaps=0), []),
    ],
)
def test_a_robot_whose_map_has_not_come_is_asked_for_it(
    tmp_path: Path, status: Arrival, asked: list[str]
) -> None:
    lines = LineMap.empty()
    held = RobotMap("a", "first", 3, (Submap(0, 0, np.zeros(3), lines, Trajectory.empty()),))
    with Store(tmp_path / "store.sqlite", "t") as store:
        intake = Intake(Coordinator(CoordinatorParameters()), store, Story())
        intake.take(Arrival(MAP.build(team="t", robot="a"), MapSender().payload(held)), 0.0)
        intake.take(status, 0.0)
        assert intake.robots_to_ask(0.0) == ([], [])  # it may be on its way
        intake.take(status, 0.0)
        assert intake.robots_to_ask(ASKED_AFTER) == (asked, [])
        assert intake.robots_to_ask(10 * ASKED_AFTER) == ([], [])  # nothing was heard since


def test_a_robot_is_reported_with_the_map_of_the_run_that_said_its_status(tmp_path: Path) -> None:
    submap = Submap(0, 0, np.zeros(3), LineMap.empty(), Trajectory.empty())
    with Store(tmp_path / "store.sqlite", "t") as store:
        intake = Intake(Coordinator(CoordinatorParameters()), store, Story())
        for boot, version, number in [("first", 283, 0), ("second", 68, 1)]:
            held = RobotMap("a", boot, version, (replace(submap, component=number),))
            intake.take(Arrival(MAP.build(team="t", robot="a"), MapSender().payload(held)), 0.0)
        for boot, version in [("first", 283), ("second", 68), ("first", 283)]:
            intake.take(_status(version, boot), 0.0)
            [report] = intake.reports
            assert report.status is not None
            assert (report.status.boot, report.map_version) == (boot, version)
        intake.take(_status(1, "third"), 0.0)
        [report] = intake.reports
        assert report.map_version is None


def test_that_our_own_link_is_away_is_no_word_of_robots(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """All tokens go with the link, and come back with it."""
    caplog.set_level(logging.INFO)
    token = LIVE.build(team="t", robot="a", boot="first")
    with Store(tmp_path / "store.sqlite", "t") as store:
        intake = Intake(Coordinator(CoordinatorParameters()), store, Story())
        intake.look(100.0, linked=True)
        intake.take(Arrival(token, b""), 0.0)
        intake.take(Arrival(token, b"", gone=True), 0.0)
        for now in (100.1, 150.0, 200.0):
            intake.look(now, linked=False)
        intake.look(200.1, linked=True)
        intake.take(Arrival(token, b""), 0.0)
        intake.look(300.0, linked=True)
        told = [record.getMessage() for record in caplog.records]
        assert told[0] == "a is here"
        assert not any("a is" in line for line in told[1:])
        intake.take(Arrival(token, b"", gone=True), 0.0)
        intake.look(300.0 + GRACE, linked=True)
    assert caplog.records[-1].getMessage() == "a is gone"


def test_tokens_of_runs_that_were_never_here_leave_nothing(tmp_path: Path) -> None:
    with Store(tmp_path / "store.sqlite", "t") as store:
        intake = Intake(Coordinator(CoordinatorParameters()), store, Story())
        for number in range(1000):
            token = LIVE.build(team="t", robot=f"a{number}", boot="first")
            intake.take(Arrival(token, b"", gone=True), 0.0)
        intake.look(GRACE, linked=True)
        assert not any(report.runs for report in intake.reports)
        assert len(intake.reports) == 0
