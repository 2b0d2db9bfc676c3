"""A robot's map as a stream of messages: what to send, and how to put it together again.

Both ends know neither clock nor network. A sender repeats the whole map whenever what it sent
since the last time outweighs it: the total stays within twice the changes, and somebody who comes
late, or missed something, soon has the whole map.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mapweave.maps import RobotMap, Submap
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.geometry import PackedSubmap
from mapweave_protocol.wire.map_message import MapMessage, Place

MESSAGES_TO_COMPLETE = 64  # at most, from one complete message to the next: a cache holds as many
REMEMBERED_BOOTS = 16


class MapSender:
    """Turns the versions of one robot's map into payloads, complete or only what changed."""

    def __init__(self) -> None:
        self._packed: dict[int, tuple[Submap, PackedSubmap]] = {}
        self._sent: dict[int, bytes] = {}
        self._bytes_complete = 0
        self._bytes_since = 0
        self._messages_since = 0

    def payload(self, robot_map: RobotMap, *, complete: bool = False) -> bytes:
        """Return what to publish so that receivers get to `robot_map`.

        Parameters
        ----------
        robot_map
            Of a higher version than the last time.
        complete
            Include everything, as for the last version of all.

        Raises
        ------
        MessageError
            If the map is too large for a message.
        """
        packed = [self._pack(submap) for submap in robot_map.submaps]
        changed = {p.id for p in packed if self._sent.get(p.id) != p.digest}
        everything = {p.id for p in packed}
        whole = complete or self._due
        payload = encode(MapMessage.of_packed(robot_map, packed, everything if whole else changed))
        self._sent = {p.id: p.digest for p in packed}
        self._count(len(payload), whole=whole)
        return payload

    def _pack(self, submap: Submap) -> PackedSubmap:
        """Return `submap` packed; a finished one keeps its map, so it is packed once."""
        before = self._packed.get(submap.id)
        if before and before[0].map is submap.map and before[0].trajectory is submap.trajectory:
            return before[1]
        packed = PackedSubmap.pack(submap)
        self._packed[submap.id] = submap, packed
        return packed

    @property
    def _due(self) -> bool:
        """Whether everything is to be sent again."""
        many = self._messages_since >= MESSAGES_TO_COMPLETE - 1
        return many or self._bytes_since >= self._bytes_complete

    def _count(self, size: int, *, whole: bool) -> None:
        if whole:
            self._bytes_complete, self._bytes_since, self._messages_since = size, 0, 0
        else:
            self._bytes_since += size
            self._messages_since += 1


@dataclass
class _Held:
    """The geometry of a submap as of a message."""

    version: int
    digest: bytes
    submap: Submap


@dataclass
class _Run:
    """What is held of one run of a robot."""

    boot: str
    held: dict[int, _Held] = field(default_factory=dict)
    newest: MapMessage | None = None
    delivered: int = -1

    def take(self, message: MapMessage) -> None:
        """Keep what is newer in `message` than what is held."""
        digests = {place.id: place.digest for place in message.places}
        for packed in message.submaps:
            held, digest = self.held.get(packed.id), digests[packed.id]
            if held is not None and held.digest == digest:
                held.version = max(held.version, message.version)  # and the same object still
            elif held is None or held.version <= message.version:
                submap = packed.unpack(0, np.zeros(3))
                self.held[packed.id] = _Held(message.version, digest, submap)
        if self.newest is None or self.newest.version < message.version:
            self.newest = message

    def deliver(self) -> RobotMap | None:
        """Return the newest map, once: None while some of its geometry is missing."""
        newest = self.newest
        if newest is None or newest.version <= self.delivered or not self._has(newest.places):
            return None
        self.delivered = newest.version
        submaps = tuple(self._placed(place) for place in newest.places)
        return RobotMap(newest.robot, newest.boot, newest.version, submaps)

    def _has(self, places: Sequence[Place]) -> bool:
        return all(
            (held := self.held.get(place.id)) is not None and held.digest == place.digest
            for place in places
        )

    def _placed(self, place: Place) -> Submap:
        submap = self.held[place.id].submap
        return replace(submap, component=place.component, pose=np.array(place.pose))


class MapAssembler:
    """Puts robots' maps together from messages, whatever was lost or came in another order.

    What `update` returns is exactly what some sender packed, and its versions ascend. A submap
    that did not change keeps the same `map` and `trajectory` objects from version to version.
    """

    def __init__(self) -> None:
        self._runs: dict[str, dict[str, _Run]] = {}  # by robot and boot

    def update(self, message: MapMessage) -> RobotMap | None:
        """Take in `message`; return the newest map if that is now complete and was not before."""
        run = self._run(message)
        run.take(message)
        return run.deliver()

    def missing(self, robot: str) -> bool:
        """Tell whether a newer map of `robot` is known of than could be put together."""
        runs = self._runs.get(robot, {}).values()
        return any(r.newest is not None and r.newest.version > r.delivered for r in runs)

    def forget(self, robot: str, boot: str | None = None) -> None:
        """Forget what is held of a robot, or of one run of it."""
        if boot is None:
            self._runs.pop(robot, None)
        else:
            self._runs.get(robot, {}).pop(boot, None)

    def _run(self, message: MapMessage) -> _Run:
        """Return what is held of the run of `message`; of too many, the longest unheard goes."""
        runs = self._runs.setdefault(message.robot, {})
        run = runs.pop(message.boot, None) or _Run(message.boot)
        runs[message.boot] = run
        if len(runs) > REMEMBERED_BOOTS:
            del runs[next(iter(runs))]
        return run
