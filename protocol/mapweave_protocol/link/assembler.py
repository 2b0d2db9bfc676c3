"""A robot's map as a stream of messages: what to send, and how to put it together again.

Both ends know neither clock nor network. What changed is sent, with a digest of the whole: who has
missed something sees it. Now and then the whole map is sent, so that somebody who comes late soon
has it.
"""

from dataclasses import dataclass, field, replace

from mapweave.maps import RobotMap, Submap
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.geometry import PackedSubmap, SubmapStream
from mapweave_protocol.wire.map_message import MapMessage, Place, state_of

MESSAGES_TO_COMPLETE = 64  # at most, from one complete message to the next: a cache holds as many
REMEMBERED_BOOTS = 16


class MapSender:
    """Turns the versions of one robot's map into payloads, complete or only what changed."""

    def __init__(self) -> None:
        self._packed: dict[int, tuple[Submap, PackedSubmap]] = {}
        self._sent: dict[int, bytes] = {}
        self._places: dict[int, Place] = {}
        self._messages_since: int | None = None
        self._stream = SubmapStream()

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
        whole = complete or self._due
        if whole:
            payload = self.whole(robot_map)
        else:
            payload = encode(MapMessage.of_packed(robot_map, packed, changed, self._places))
        self._sent = {p.id: p.digest for p in packed}
        self._places = {submap.id: Place.of(submap) for submap in robot_map.submaps}
        self._messages_since = 0 if whole else (self._messages_since or 0) + 1
        return payload

    def whole(self, robot_map: RobotMap) -> bytes:
        """Return the complete message of `robot_map`; what was in the last one is not coded again.

        Raises
        ------
        MessageError
            If the map is too large for a message.
        """
        packed = [self._pack(submap) for submap in robot_map.submaps]
        return encode(MapMessage.whole(robot_map, packed, self._stream))

    def as_sent(self, robot_map: RobotMap) -> RobotMap:
        """Return `robot_map` as it arrives, so that both ends decide alike."""
        submaps = (
            replace(self._pack(s).restored, component=s.component, pose=Place.of(s).pose)
            for s in robot_map.submaps
        )
        return replace(robot_map, submaps=tuple(submaps))

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
        """Whether everything is to be sent again: at first, and before a cache has lost it."""
        return self._messages_since is None or self._messages_since >= MESSAGES_TO_COMPLETE - 1


@dataclass
class _Held:
    """The geometry of a submap as of a message."""

    version: int
    packed: PackedSubmap


@dataclass
class _Run:
    """What is held of one run of a robot.

    Attributes
    ----------
    places
        By submap, since which version it lies there; nowhere when it is no longer part of the map.
    """

    boot: str
    held: dict[int, _Held] = field(default_factory=dict)
    places: dict[int, tuple[int, Place | None]] = field(default_factory=dict)
    newest: MapMessage | None = None
    delivered: int = -1
    stream: SubmapStream = field(default_factory=SubmapStream)

    def take(self, message: MapMessage) -> None:
        """Keep what is newer in `message` than what is held."""
        for packed in message.changes.submaps:
            self._take_geometry(packed, message.version)
        gone = set(message.changes.gone)
        if message.complete:
            gone = self.places.keys() - {place.id for place in message.changes.places}
        for submap in gone:
            self._take_place(submap, None, message.version)
        for place in message.changes.places:
            self._take_place(place.id, place, message.version)
        if self.newest is None or self.newest.version < message.version:
            self.newest = message

    def deliver(self) -> RobotMap | None:
        """Return the newest map, once: None while what is held is not what is meant."""
        newest = self.newest
        if newest is None or newest.version <= self.delivered or not self._is(newest.state):
            return None
        self.delivered = newest.version
        submaps = tuple(self._placed(place) for place in self.present)
        return RobotMap(newest.robot, newest.boot, newest.version, submaps)

    @property
    def present(self) -> list[Place]:
        """Where the submaps of the newest map lie, as far as it is known, ids ascending."""
        places = (self.places[submap][1] for submap in sorted(self.places))
        return [place for place in places if place is not None]

    def _take_geometry(self, packed: PackedSubmap, version: int) -> None:
        held = self.held.get(packed.id)
        if held is not None and held.packed.digest == packed.digest:
            held.version = max(held.version, version)  # and the same object still
        elif held is None or held.version <= version:
            self.held[packed.id] = _Held(version, packed)

    def _take_place(self, submap: int, place: Place | None, version: int) -> None:
        if submap not in self.places or self.places[submap][0] <= version:
            self.places[submap] = version, place

    def _is(self, state: bytes) -> bool:
        """Tell whether what is held is the map of that digest."""
        present = self.present
        if any(place.id not in self.held for place in present):
            return False
        return state_of((p, self.held[p.id].packed.digest) for p in present) == state

    def _placed(self, place: Place) -> Submap:
        submap = self.held[place.id].packed.restored
        return replace(submap, component=place.component, pose=place.pose)


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

    def complete(self, robot_map: RobotMap) -> MapMessage:
        """Return the complete message of a map that `update` has just given.

        Raises
        ------
        MessageError
            If the parts that came make too large a whole.
        """
        run = self._runs[robot_map.robot][robot_map.boot]
        packed = [run.held[submap.id].packed for submap in robot_map.submaps]
        return MapMessage.whole(robot_map, packed, run.stream)

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
