"""What leaves the intake whatever arrives: nothing."""

from pathlib import Path

import numpy as np
import pytest

from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave_fusion_server.coordinator import Coordinator, CoordinatorParameters
from mapweave_fusion_server.intake import Intake
from mapweave_fusion_server.store import Store
from mapweave_protocol.link.assembler import MapSender
from mapweave_protocol.link.inbox import Arrival
from mapweave_protocol.narration.story import Story
from mapweave_protocol.wire.keys import MAP

SEGMENTS = 180_000  # of random numbers: four submaps fit into a message, eight do not


def _submap(number: int) -> Submap:
    rng = np.random.default_rng(number)
    starts = rng.uniform(-900, 900, (SEGMENTS, 2))
    segments = np.hstack([starts, starts + rng.uniform(0.1, 0.4, (SEGMENTS, 2))])
    support = rng.integers(0, 2**31, SEGMENTS)
    lines = LineMap(segments, np.arange(SEGMENTS), support, ())
    return Submap(number, 0, np.zeros(3), lines, Trajectory.empty())


def test_a_map_that_is_too_large_as_a_whole_is_logged_once_and_dropped(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
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
    assert [line for line in caplog.messages if "map of a ignored" in line] == caplog.messages
    assert len(caplog.messages) == 1
