import numpy as np
import pytest

from mapweave.maps import LineMap, RobotMap, Submap, Trajectory
from mapweave_protocol.errors import MessageError
from mapweave_protocol.wire import geometry
from mapweave_protocol.wire.codec import decode, encode
from mapweave_protocol.wire.messages import MapMessage


def a_map_of(walls: int) -> RobotMap:
    """Return a robot's map of parallel walls, each 1800 m long."""
    segments = np.tile([-900.0, 0.0, 900.0, 0.0], (walls, 1))
    segments[:, [1, 3]] = np.linspace(-900, 900, walls)[:, None]
    lines = LineMap(segments, np.arange(walls), np.ones(walls, dtype=np.int64))
    submap = Submap(0, 0, np.zeros(3), lines, Trajectory.empty())
    return RobotMap("a", "b1", 1, (submap,))


def test_a_map_of_more_wall_than_any_robot_maps_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Few bytes may claim much wall, and comparing maps costs memory by the metre."""
    decode(MapMessage, encode(MapMessage.pack(a_map_of(50))))
    with monkeypatch.context() as careless:
        careless.setattr(geometry, "MAX_WALL", np.inf)  # a sender that does not check
        forged = encode(MapMessage.pack(a_map_of(60)))
    with pytest.raises(MessageError, match="m of wall"):
        decode(MapMessage, forged)
