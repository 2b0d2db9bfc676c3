"""Two robots in wings that are built alike, joined by mistake, come apart when both saw more."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mapweave.fusion.align import align
from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave.reasons import StatusKind
from mapweave_protocol.wire.messages import AlignmentMessage, MapVersion
from tests.mapweave.buildings import SLANTED, corridor, part

if TYPE_CHECKING:
    from mapweave.maps import JointMap
    from tests.fusion_server.conftest import Network, Robot, StartServer

# Up to x = 16 it is the other wing once more; beyond, rooms are elsewhere.
TWIN = corridor(
    30.0,
    below=[(2, 5, 3.0), (7, 7.9, 0.4), (11, 15, 4.2), (26.5, 28.5, 4.5)],
    above=[(1, 3.5, 2.5), (6, 10, 3.6), (13, 14, 0.6), (21.5, 23.5, 4.0)],
)
TWIN[np.flatnonzero((TWIN == (3.5, 4.7)).all(axis=1)), 0] -= 1.2
ELSEWHERE = np.array([40.0, -12.0, 1.0])


def robot_map(robot: str, version: int, lines: LineMap) -> RobotMap:
    path = Trajectory(np.array([0]), np.array([0.0]), np.zeros((1, 3)))
    return RobotMap(robot, "first", version, (Submap(0, 0, np.zeros(3), lines, path),))


def tell(a: Robot, b: Robot, version: int, high: float) -> None:
    """Publish what both know up to x = `high`, and what comes of comparing it."""
    ours = robot_map("a", version, part(SLANTED, 0, high))
    theirs = robot_map("b", version, part(TWIN, 0, high).moved(ELSEWHERE))
    a.publish_map(ours)
    b.publish_map(theirs)
    found = align(ours, theirs)
    a.publish_alignments(
        AlignmentMessage.pack("a", MapVersion.of(ours), MapVersion.of(theirs), found)
    )


def test_wings_that_were_taken_for_one_come_apart_in_the_version_that_knows_what_contradicts(
    network: Network, start_server: StartServer
) -> None:
    start_server()
    watcher = network.watcher()
    seen: list[JointMap] = []
    with network.robot("a") as a, network.robot("b") as b:
        tell(a, b, 1, 16.0)
        while not seen or network.groups(seen[-1]) != [["a/0", "b/0"]]:
            seen.append(watcher.next())
        tell(a, b, 2, 30.0)
        while network.groups(seen[-1]) != [["a/0"], ["b/0"]]:
            seen.append(watcher.next())
    *before, parted = [a for joint in seen for a in joint.alignments]
    assert {a.decision for a in before} == {"accepted"}  # none knew of it and kept them together
    assert parted.status is not None
    assert parted.status.kind is StatusKind.REVOKED
    assert parted.status.revoked_in == seen[-1].version
    assert "where the other saw free space" in parted.reason
