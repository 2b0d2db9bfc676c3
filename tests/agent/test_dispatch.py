"""What a robot hears goes to its plan of comparisons, but for what it said itself."""

from pathlib import Path

import numpy as np
import pytest

from mapweave.maps import Alignment, LineMap, RobotMap, Submap, Trajectory
from mapweave.reasons import Reason, ReasonKind
from mapweave_agent.by_hand.kept_orders import KeptOrders
from mapweave_agent.comparison_schedule import ComparisonSchedule
from mapweave_agent.dispatch import Dispatcher
from mapweave_agent.live.whereabouts import Whereabouts
from mapweave_agent.needs import Needs
from mapweave_agent.past_runs import StateFolder
from mapweave_agent.publication_schedule import AgentParameters
from mapweave_protocol.link.inbox import Arrival
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import (
    AlignmentMessage,
    MapMessage,
    MapVersion,
    StatusMessage,
)
from mapweave_protocol.wire.pairs import responsible

OURS = responsible("a", "b")  # compares the two
PEER = "b" if OURS == "a" else "a"


def a_map(robot: str, version: int = 1) -> RobotMap:
    submap = Submap(0, 0, np.zeros(3), LineMap.empty(), Trajectory.empty())
    return RobotMap(robot, "x", version, (submap,))


def map_of(robot: str, version: int = 1) -> Arrival:
    payload = encode(MapMessage.pack(a_map(robot, version)))
    return Arrival(keys.MAP.build(team="t", robot=robot), payload)


def status_of(robot: str, state: str, version: int) -> Arrival:
    counts = dict.fromkeys(("scans_seen", "scans_placed", "components", "submaps"), 1)
    fields = {"robot": robot, "boot": "x", "stamp": 0.0, "state": state, "map_version": version}
    message = StatusMessage.model_validate({**counts, **fields})
    return Arrival(keys.STATUS.build(team="t", robot=robot), encode(message))


def token_of(robot: str, *, gone: bool = False, boot: str = "x") -> Arrival:
    return Arrival(keys.LIVE.build(team="t", robot=robot, boot=boot), b"", gone)


def found_by(robot: str) -> Arrival:
    ends = {name: MapVersion.of(a_map(name)) for name in ("a", "b")}
    found = Alignment("a/0", "b/0", np.zeros(3), "refused", 0.1, Reason(ReasonKind.NO_SHAPE))
    message = AlignmentMessage.pack(robot, ends["a"], ends["b"], [found])
    key = keys.ALIGNMENT.build(team="t", robot=robot, reference="a", other="b")
    return Arrival(key, encode(message))


class Robot:
    """One that has a map and listens."""

    def __init__(self, name: str, folder: Path) -> None:
        self.plan = ComparisonSchedule(name, AgentParameters())
        self.plan.own_map(a_map(name), finished=True)
        self.orders = KeptOrders(StateFolder(folder))
        whereabouts = Whereabouts(name, "x", 0)
        self._dispatcher = Dispatcher(name, "x", self.plan, Needs(name), whereabouts, self.orders)

    def hears(self, *arrivals: Arrival) -> None:
        """Take in what arrives, in this order."""
        for arrival in arrivals:
            self._dispatcher.take(arrival)

    @property
    def refused(self) -> int:
        """How many arrivals were no messages."""
        return self._dispatcher.refused


def test_the_map_of_a_peer_is_something_to_compare_and_the_own_one_is_not(tmp_path: Path) -> None:
    robot = Robot(OURS, tmp_path)
    robot.hears(token_of(OURS), map_of(OURS, 9))
    assert robot.plan.idle
    robot.hears(token_of(PEER), map_of(PEER))
    assert not robot.plan.idle


def test_a_robot_takes_over_when_it_hears_that_the_responsible_one_is_gone(tmp_path: Path) -> None:
    robot = Robot(PEER, tmp_path)
    robot.hears(token_of(OURS), map_of(OURS))
    assert robot.plan.idle
    robot.hears(token_of(OURS, gone=True))
    assert not robot.plan.idle


def test_another_run_of_the_robot_itself_is_nobody_to_compare_with(
    caplog: pytest.LogCaptureFixture, tmp_path: Path
) -> None:
    robot = Robot(OURS, tmp_path)
    robot.hears(token_of(OURS, boot="y"), token_of(OURS, boot="x"))
    assert caplog.text.count("2 agents call themselves") == 1
    assert robot.plan.idle


@pytest.mark.parametrize(("state", "at_once"), [("mapping", False), ("finished", True)])
def test_a_pair_rests_until_the_peer_says_that_its_map_is_the_last(
    state: str, at_once: bool, tmp_path: Path
) -> None:
    robot = Robot(OURS, tmp_path)
    robot.hears(token_of(PEER), map_of(PEER))
    comparison = robot.plan.begin(0.0)
    assert comparison is not None
    robot.plan.done(comparison, now=0.0, took=1.0)
    robot.hears(map_of(PEER, 2), status_of(PEER, state, 2))
    assert (robot.plan.begin(0.1) is not None) == at_once


def test_what_a_peer_found_of_the_pair_spares_the_comparison(tmp_path: Path) -> None:
    robot = Robot(PEER, tmp_path)
    robot.hears(token_of(OURS), map_of(OURS), found_by(OURS), token_of(OURS, gone=True))
    assert robot.plan.idle


def test_what_the_robot_itself_published_is_no_news(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    robot = Robot(PEER, tmp_path)
    learned: list[AlignmentMessage] = []
    monkeypatch.setattr(robot.plan, "learned", learned.append)
    robot.hears(found_by(PEER))
    assert learned == []
    robot.hears(found_by(OURS))
    assert [message.robot for message in learned] == [OURS]


def test_what_is_no_message_is_counted_and_changes_nothing(tmp_path: Path) -> None:
    robot = Robot(OURS, tmp_path)
    for key in (map_of(PEER).key, status_of(PEER, "mapping", 1).key, found_by(PEER).key):
        robot.hears(Arrival(key, b"nonsense"))
    assert robot.refused == 3
    assert robot.plan.idle
