"""Which pair of maps to compare next; no clock and no network in here."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from mapweave.maps import Alignment, RobotMap
from mapweave.team.hysteresis import joins
from mapweave_agent.publication_schedule import AgentParameters
from mapweave_protocol.wire.messages import AlignmentMessage, Compared, MapVersion
from mapweave_protocol.wire.pairs import is_earlier_run, ordered, responsible


@dataclass(frozen=True, slots=True)
class Comparison:
    """Two robots' maps to compare; `reference` is the robot of the smaller id."""

    peer: str
    reference: RobotMap
    other: RobotMap


@dataclass
class _Peer:
    """What is known of another robot.

    Attributes
    ----------
    newest
        Its newest map.
    boots
        The runs of it that are alive.
    gone
        Whether there were some, and are no longer; its map may be here before its token.
    last
        Boot and version of the map it said to be its last.
    compared, published
        The versions compared last: by whomever, and by us.
    met
        The runs of it whose map was joined with ours, by whomever.
    rests_until
        While it still maps, the pair is not compared before.
    """

    newest: RobotMap | None = None
    boots: set[str] = field(default_factory=set)
    gone: bool = False
    last: tuple[str, int] | None = None
    compared: Compared | None = None
    published: Compared | None = None
    met: set[str] = field(default_factory=set)
    rests_until: float = 0.0

    def outdated(self, own: RobotMap | None) -> bool:
        """Tell whether the newest maps have not been compared."""
        if own is None or self.newest is None:
            return False
        return self.compared != _versions(own, self.newest)

    def done_mapping(self) -> bool:
        """Tell whether its newest map is its last."""
        return self.newest is not None and self.last == (self.newest.boot, self.newest.version)


def _versions(own: RobotMap | MapVersion, peer: RobotMap | MapVersion) -> Compared:
    return Compared(own_version=own.version, peer_boot=peer.boot, peer_version=peer.version)


class ComparisonSchedule:
    """Which pair to compare next: always of the newest maps, and in the end of the last ones.

    Parameters
    ----------
    robot
        The robot that plans.
    """

    def __init__(self, robot: str, parameters: AgentParameters) -> None:
        self._robot = robot
        self._parameters = parameters
        self._own: RobotMap | None = None
        self._own_finished = False
        self._peers: dict[str, _Peer] = {}

    def own_map(self, robot_map: RobotMap, *, finished: bool) -> None:
        """Take in this robot's map as published; `finished` says that it is the last."""
        self._own = robot_map
        self._own_finished = finished

    def peer_map(self, robot_map: RobotMap) -> None:
        """Take in a peer's map, unless one of a later run is known."""
        peer = self._peer(robot_map.robot)
        if peer.newest is None or not is_earlier_run(robot_map, peer.newest):
            peer.newest = robot_map

    def earlier_map(self, robot_map: RobotMap) -> None:
        """Take in the map of this robot's run before this one: it is compared as a peer's."""
        earlier = self._peer(robot_map.robot)
        earlier.newest, earlier.last = robot_map, (robot_map.boot, robot_map.version)

    def peer_finished(self, robot: str, boot: str, version: int) -> None:
        """Note that the map of that version is a peer's last."""
        self._peer(robot).last = boot, version

    def peer_here(self, robot: str, boot: str) -> None:
        """Note that a run of a peer is alive."""
        peer = self._peer(robot)
        peer.boots.add(boot)
        peer.gone = False

    def peer_gone(self, robot: str, boot: str) -> None:
        """Note that a run of a peer is no longer alive: its duties fall to us."""
        peer = self._peer(robot)
        peer.boots.discard(boot)
        peer.gone = not peer.boots

    def learned(self, message: AlignmentMessage) -> None:
        """Take in what a peer found out about our pair: we need not do it again."""
        versions = {version.robot: version for version in (message.reference, message.other)}
        own, peer = versions.get(self._robot), versions.get(message.robot)
        if self._own is None or own is None or peer is None or own.boot != self._own.boot:
            return
        self._peer(message.robot).compared = _versions(own, peer)
        self._note_meeting(message.robot, peer.boot, message.unpack())

    def begin(self, now: float) -> Comparison | None:
        """Return the next comparison, None if none is due; of several, the one due longest."""
        own = self._own
        due = [(p.rests_until, name) for name, p in self._peers.items() if self._due(name, now)]
        newest = self._peers[min(due)[1]].newest if due else None
        if own is None or newest is None:
            return None
        first, _ = ordered(own.robot, newest.robot)
        pair = (own, newest) if own.robot == first else (newest, own)
        return Comparison(newest.robot, *pair)

    def have_met(self, comparison: Comparison) -> bool:
        """Tell whether the two runs that `comparison` is of were joined once."""
        _, other = self._sides(comparison)
        return other.boot in self._peer(comparison.peer).met

    def is_final(self, comparison: Comparison) -> bool:
        """Tell whether both maps are the last ones of their robots."""
        return self._own_finished and self._peer(comparison.peer).done_mapping()

    def done(
        self, comparison: Comparison, now: float, took: float, found: Sequence[Alignment] = ()
    ) -> None:
        """Note that `comparison` has taken `took` [s], and what was `found` and published."""
        own, other = self._sides(comparison)
        peer = self._peer(comparison.peer)
        self._note_meeting(comparison.peer, other.boot, found)
        peer.compared = peer.published = _versions(own, other)
        rest = max(self._parameters.comparison_interval, took * self._parameters.comparison_rest)
        peer.rests_until = now + rest

    @property
    def published(self) -> Mapping[str, Compared]:
        """By peer, the versions we compared last."""
        peers = self._peers.items()
        return {name: peer.published for name, peer in peers if peer.published is not None}

    @property
    def held(self) -> tuple[MapVersion, ...]:
        """Which state of each peer's map is here."""
        names = sorted(self._peers.keys() - {self._robot})
        newest = (self._peers[name].newest for name in names)
        return tuple(MapVersion.of(robot_map) for robot_map in newest if robot_map is not None)

    @property
    def idle(self) -> bool:
        """Whether nothing is left for us to compare, unless something new arrives."""
        return not any(self._ours(name) for name in self._peers)

    def _due(self, name: str, now: float) -> bool:
        peer = self._peers[name]
        both_finished = self._own_finished and peer.done_mapping()
        return self._ours(name) and (both_finished or now >= peer.rests_until)

    def _ours(self, name: str) -> bool:
        """Tell whether there is something to compare with a peer, and it is for us to do it."""
        peer = self._peers[name]
        duty = responsible(self._robot, name) == self._robot or peer.gone
        return duty and peer.outdated(self._own)

    def _note_meeting(self, peer: str, boot: str, found: Sequence[Alignment]) -> None:
        if joins(found):
            self._peer(peer).met.add(boot)

    def _sides(self, comparison: Comparison) -> tuple[RobotMap, RobotMap]:
        """Return our map and the peer's."""
        pair = comparison.reference, comparison.other
        return pair if pair[0].robot == self._robot else pair[::-1]

    def _peer(self, name: str) -> _Peer:
        return self._peers.setdefault(name, _Peer())
