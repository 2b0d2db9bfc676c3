"""Follows a team by its messages: what happens, what was sent, whether it is done."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from mapweave.errors import InvalidIdError
from mapweave_protocol.errors import ForeignKeyError
from mapweave_protocol.link.inbox import Arrival
from mapweave_protocol.narration.watch import Watcher
from mapweave_protocol.wire.keys import ALIGNMENT, MAP, POSE, STATUS, KeyFormat
from mapweave_protocol.wire.messages import JointStatusMessage, MapVersion, StatusMessage

KINDS = {"map": MAP, "alignment": ALIGNMENT, "pose": POSE, "status": STATUS}


@dataclass
class Count:
    """Messages and the size of their payloads [bytes]."""

    messages: int = 0
    size: int = 0

    def add(self, payload: bytes) -> None:
        """Count one more."""
        self.messages += 1
        self.size += len(payload)


class Recorder:
    """Takes in everything a team publishes.

    Attributes
    ----------
    traffic
        By robot and kind of message, what it published.
    """

    def __init__(self) -> None:
        self.traffic: dict[tuple[str, str], Count] = {}
        self._watcher = Watcher()

    def take(self, arrival: Arrival) -> Iterator[str]:
        """Take in a message; yield the lines that tell what is new about it."""
        for kind, keys in KINDS.items():
            sender = _sender(keys, arrival.key)
            if sender is not None:
                self.traffic.setdefault((sender, kind), Count()).add(arrival.payload)
        yield from self._watcher.tell(arrival)

    @property
    def statuses(self) -> dict[str, StatusMessage]:
        """The last status of each robot that was heard."""
        states = self._watcher.story.robots.items()
        return {robot: state.status for robot, state in states if state.status is not None}

    def sent(self, robot: str) -> dict[str, Count]:
        """Return by kind of message what `robot` published."""
        return {kind: self.traffic.get((robot, kind), Count()) for kind in KINDS}


def _sender(keys: KeyFormat, key: str) -> str | None:
    """Return the robot that publishes at `key`, None if that is no key of a robot's."""
    try:
        return keys.parse(key)["robot"]
    except (ForeignKeyError, InvalidIdError):
        return None


def is_done(robots: list[str], statuses: Mapping[str, StatusMessage]) -> bool:
    """Return whether all `robots` have finished and each pair was compared as it now is."""
    if any(robot not in statuses or statuses[robot].state != "finished" for robot in robots):
        return False
    return all(
        _compared(statuses[a], statuses[b]) or _compared(statuses[b], statuses[a])
        for a, b in combinations(robots, 2)
    )


def to_come(
    robots: Sequence[str],
    statuses: Mapping[str, StatusMessage],
    coordinators: Sequence[JointStatusMessage],
) -> list[str]:
    """Return which last maps of `robots` no coordinator has, or that a joint map is being made.

    Parameters
    ----------
    statuses
        Of robots that are done, by their ids.
    coordinators
        What each says of itself; nothing where none answers.
    """
    held = {state for said in coordinators for state in said.maps}
    last = {
        robot: MapVersion(robot=robot, boot=status.boot, version=status.map_version)
        for robot in robots
        if (status := statuses[robot]).submaps > 0
    }
    missing = [f"map of {robot}" for robot, state in last.items() if state not in held]
    making = any(said.pending for said in coordinators) or not coordinators
    return missing or ["the last joint map"] * making


def _compared(own: StatusMessage, peer: StatusMessage) -> bool:
    """Return whether the robot of `own` compared both last maps."""
    said = own.compared.get(peer.robot)
    return said is not None and (said.own_version, said.peer_boot, said.peer_version) == (
        own.map_version,
        peer.boot,
        peer.map_version,
    )
