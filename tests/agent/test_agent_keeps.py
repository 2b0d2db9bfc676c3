"""A robot that joined its map with a peer's keeps them joined while the peer's map grows."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mapweave.maps import Alignment, LineMap, RobotMap, Submap, Trajectory
from mapweave_protocol.link.assembler import MapSender
from mapweave_protocol.link.session import declare_map_publisher, open_session
from mapweave_protocol.wire import keys
from tests.agent.test_agent import FIRST, PATIENCE, SCANS, SECOND, Listener, agent, mapped

WING = np.array([[60.0, 0.0, 460.0, 0.0], [460.0, 2.0, 60.0, 2.0]])  # [m] of bare corridor


def grown(robot_map: RobotMap) -> RobotMap:
    """Return the map with a wing of the building, far from what it showed before."""
    lines = LineMap(WING, np.arange(2), np.full(2, 5), ())
    last = robot_map.submaps[-1]
    wing = Submap(last.id + 1, last.component, np.zeros(3), lines, Trajectory.empty())
    return replace(robot_map, version=robot_map.version + 1, submaps=(*robot_map.submaps, wing))


@pytest.mark.slow
def test_a_join_is_kept_when_the_map_of_a_peer_has_grown(
    endpoint: str, team: str, logs: list[Path]
) -> None:
    """The test plays the peer: it saw what the robot saw and more, and then a wing beside."""
    small = mapped(SECOND, logs[0], 3 * SCANS)
    with (
        open_session([endpoint], patience=PATIENCE) as session,
        open_session([endpoint], patience=PATIENCE) as peer,
    ):
        listener = Listener(session, team)
        live = keys.LIVE.build(team=team, robot=SECOND, boot=small.boot)
        with (
            declare_map_publisher(peer, keys.MAP.build(team=team, robot=SECOND)) as publisher,
            peer.liveliness().declare_token(live),
            agent(FIRST, logs[0], team, endpoint),
        ):
            sender = MapSender()
            publisher.put(sender.payload(small))
            listener.until(lambda: listener.finished(FIRST) and _last(listener) is not None)
            listener.until(lambda: _compares(listener, small))
            joined = _last(listener)
            large = grown(small)
            publisher.put(sender.payload(large))
            listener.until(lambda: _has_compared(listener, large))
            kept = _last(listener)
    assert joined is not None and kept is not None
    assert joined.decision == "accepted" and joined.confidence > 0.85
    assert kept.decision == "accepted" and kept.confidence > 0.85
    assert kept.places


def _compares(listener: Listener, peer: RobotMap) -> bool:
    """Whether the last comparison was of this version of the peer's map."""
    said = listener.alignments[-1]
    version = {v.robot: v.version for v in (said.reference, said.other)}
    return version[SECOND] == peer.version and version[FIRST] == listener.maps[FIRST].version


def _has_compared(listener: Listener, peer: RobotMap) -> bool:
    """Whether the robot says that it compared this version, whatever it told of that."""
    done = listener.statuses[FIRST].compared.get(SECOND)
    return done is not None and done.peer_version == peer.version


def _last(listener: Listener) -> Alignment | None:
    found = listener.alignments[-1].unpack() if listener.alignments else ()
    return next(iter(found), None)
