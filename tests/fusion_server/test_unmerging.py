"""Joins are undone as soon as something contradicts them; the version that does it says why."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from mapweave.geometry import se2
from mapweave.reasons import ReasonKind, Status, StatusKind
from mapweave.team.joint_builder import JointMapBuilder
from mapweave_fusion_server.coordinator import Coordinator, CoordinatorParameters
from mapweave_fusion_server.intake import last_version
from mapweave_fusion_server.store import Store
from mapweave_protocol.narration.story import Story
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import JointMapMessage
from tests.fusion_server.conftest import Network

if TYPE_CHECKING:
    from pathlib import Path

    from mapweave.maps import Alignment, JointMap, RobotMap
    from tests.fusion_server.conftest import MakeAlignments, MakeMap

POSES = {
    "a": (1.0, 1.0, 0.3),
    "b": (3.0, 2.0, -2.0),
    "c": (2.0, 3.0, 1.0),
    "d": (6.0, 2.0, 3.0),
}  # fmt: skip
FAR_AWAY = (40.0, 5.0, 0.5)  # where nothing contradicts it


class Team:
    """A coordinator and what its robots tell it."""

    def __init__(self, make_map: MakeMap, make_alignments: MakeAlignments) -> None:
        self.coordinator = Coordinator(CoordinatorParameters(min_interval=0))
        self._make_map, self._make_alignments = make_map, make_alignments
        self.maps: dict[str, RobotMap] = {}
        self.story = Story()

    def map(self, *robots: str, version: int = 1) -> None:
        """Tell maps of these robots."""
        for robot in robots:
            self.maps[robot] = self._make_map(robot, version, pose=POSES[robot])
            self.coordinator.receive_map(self.maps[robot])

    def align(
        self,
        pair: str,
        decision: str = "accepted",
        *,
        confidence: float = 0.9,
        off: tuple[float, float, float] | None = None,
        reason: str = "40 m of wall in common",
    ) -> None:
        """Tell what was found for a pair such as ``ab``."""
        first, second = pair[0], pair[1]
        transform = se2.between(POSES[first], POSES[second])
        if off is not None:
            transform = se2.compose(transform, off)
        message = self._make_alignments(
            self.maps[first],
            self.maps[second],
            decision,
            transform=tuple(transform),
            confidence=confidence,
            reason=reason,
        )
        assert self.coordinator.receive_alignments(message)

    def next_version(self) -> JointMap:
        """Return the version that is due, built."""
        assert self.coordinator.seconds_until_due(0.0) == 0.0
        joint = self.coordinator.begin(0.0).build(JointMapBuilder())
        self.coordinator.finish(joint)
        return joint


@pytest.fixture
def team(make_map: MakeMap, make_alignments: MakeAlignments) -> Team:
    return Team(make_map, make_alignments)


def alignment_of(joint: JointMap, pair: str) -> Alignment:
    names = {f"{robot}/0" for robot in pair}
    (found,) = (a for a in joint.alignments if {a.reference, a.other} == names)
    return found


def reason_of(joint: JointMap, pair: str) -> str:
    return alignment_of(joint, pair).reason


def status_of(joint: JointMap, pair: str) -> Status | None:
    return alignment_of(joint, pair).status


def test_a_pair_compared_again_and_refused_comes_apart_and_the_version_says_why(
    team: Team,
) -> None:
    team.map("a", "b")
    team.align("ab")
    joined = team.next_version()
    team.map("b", version=2)
    team.align("ab", "refused", reason="only 3 m of wall in common")
    parted = team.next_version()
    assert Network.groups(joined) == [["a/0", "b/0"]]
    assert Network.groups(parted) == [["a/0"], ["b/0"]]
    assert reason_of(joined, "ab") == "40 m of wall in common"
    assert status_of(joined, "ab") == Status(StatusKind.RELIED_ON)
    assert status_of(parted, "ab") == Status(StatusKind.REVOKED, revoked_in=2)
    assert reason_of(parted, "ab") == "revoked in version 2: only 3 m of wall in common"
    for component in parted.components:
        (pose,) = component.robots.values()
        np.testing.assert_array_equal(pose, np.zeros(3))
    lines = [line for joint in (joined, parted) for line in team.story.joined(joint)]
    assert lines == [
        "joint map 1: a/0 + b/0 (90%)",
        "a/0 and b/0: accepted, confidence 90% (40 m of wall in common)",
        "joint map 2 comes apart: alone: a/0, b/0",
        "a/0 and b/0: alignment revoked in version 2 (only 3 m of wall in common)",
    ]


def test_a_join_that_later_cycles_contradict_is_revoked_and_all_come_to_lie_rightly(
    team: Team,
) -> None:
    """Wrong, the surest of all, and alone at first: nothing contradicts it until others come."""
    team.map("a", "b")
    team.align("ab", confidence=0.99, off=FAR_AWAY)
    wrong = team.next_version()
    assert Network.groups(wrong) == [["a/0", "b/0"]]
    team.map("c", "d")
    for pair in ("ac", "bc", "ad", "bd"):
        team.align(pair)
    right = team.next_version()
    (component,) = right.components
    assert list(component.robots) == ["a/0", "b/0", "c/0", "d/0"]
    for name, pose in component.robots.items():
        expected = se2.between(POSES["a"], POSES[name[0]])
        np.testing.assert_allclose(pose, expected, atol=1e-3)
    wrong_one = alignment_of(right, "ab")
    assert wrong_one.reason.startswith("revoked in version 2: 40.1 m and 29° off what ")
    assert wrong_one.cause.kind is ReasonKind.OTHERS_CONTRADICT
    assert wrong_one.status is not None and wrong_one.status.revoked_in == 2
    assert set(wrong_one.status.set_aside_by) <= {
        (f"{a}/0", f"{b}/0") for a, b in ("ac", "bc", "ad", "bd")
    }
    assert wrong_one.status.set_aside_by
    assert component.confidence > 0.99


def test_what_the_maps_themselves_contradict_is_not_believed(team: Team) -> None:
    """Accepted as before, but now by half a turn: walls of one come to lie in the other's room."""
    team.map("a", "b")
    team.align("ab", off=FAR_AWAY)
    assert Network.groups(team.next_version()) == [["a/0", "b/0"]]
    team.align("ab", off=(0.0, 0.0, np.pi))
    parted = team.next_version()
    assert Network.groups(parted) == [["a/0"], ["b/0"]]
    reason = reason_of(parted, "ab")
    assert reason.startswith("revoked in version 2: a/0 and b/0 would have ")
    assert "of wall where the other saw free space" in reason


def test_after_a_restart_it_is_still_known_what_was_relied_on(team: Team, tmp_path: Path) -> None:
    team.map("a", "b")
    team.align("ab")
    with Store(tmp_path / "store.sqlite", "t") as store:
        assert last_version(store) is None
        joined = team.next_version()
        store.add_version(1, 0.0, encode(JointMapMessage.pack(joined, store.series)))
    with Store(tmp_path / "store.sqlite", "t") as store:
        team.coordinator = Coordinator(CoordinatorParameters(min_interval=0), last_version(store))
    team.map("a", "b")
    team.align("ab", "refused", reason="only 2 m of wall in common")
    parted = team.next_version()
    assert parted.version == 2
    assert status_of(parted, "ab") == Status(StatusKind.REVOKED, revoked_in=2)
    assert reason_of(parted, "ab") == "revoked in version 2: only 2 m of wall in common"
