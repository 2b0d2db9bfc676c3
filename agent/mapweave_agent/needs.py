"""What others lack of what this robot has published: they say what they hold, it compares.

No clock and no network in here.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from mapweave_protocol.link.lacking import GRACE, Lacking
from mapweave_protocol.wire.messages import (
    AlignmentMessage,
    JointStatusMessage,
    MapVersion,
    StatusMessage,
)
from mapweave_protocol.wire.pairs import Run, is_older, states_of

MAP = "map"
ARRIVAL = 4.0  # [s] after which what was published is not on its way; Zenoh sends lost ones again
RETURN = 10.0  # [s] after somebody came, in which it is not waited for so long: links were broken

_ByRuns: TypeAlias = dict[frozenset[Run], tuple[MapVersion, MapVersion]]


@dataclass(frozen=True, slots=True)
class Missing:
    """What is to be sent again: the whole map, those of past runs, alignments, marks of runs."""

    map: bool = False
    past: tuple[MapVersion, ...] = ()
    alignments: tuple[AlignmentMessage, ...] = ()
    marks: tuple[MapVersion, ...] = ()


class Needs:
    """Takes in what others say they hold; says what to send again.

    Parameters
    ----------
    robot
        Whose maps and alignments it is about.
    """

    def __init__(self, robot: str) -> None:
        self._robot = robot
        self._lacking = Lacking()
        self._coordinators: dict[str, JointStatusMessage] = {}
        self._peers: dict[str, StatusMessage] = {}
        self._here: dict[str, JointStatusMessage] = {}  # the last of each that is alive
        self._published: dict[str, float] = {}  # when, by what
        self._met = -math.inf

    def coordinator(self, status: JointStatusMessage) -> None:
        """Take in what a coordinator holds."""
        self._coordinators[status.boot] = self._here[status.boot] = status

    def coordinator_gone(self, boot: str) -> None:
        """Note that a coordinator is no longer alive."""
        self._here.pop(boot, None)

    def met(self, now: float) -> None:
        """Note that somebody came: what was published before may not have reached everybody."""
        self._met = now

    def published(self, now: float, message: AlignmentMessage | None = None) -> None:
        """Note that the map, or a `message` of what was found, was published just `now` [s]."""
        self._published[MAP if message is None else _pair_of(message)] = now

    def delivered(self, own: MapVersion | None) -> bool:
        """Tell whether every coordinator that is here has said that it holds this robot's map."""
        return own is None or all(own in status.maps for status in self._here.values())

    def peer(self, status: StatusMessage) -> None:
        """Take in what another robot holds."""
        self._peers[status.boot] = status

    def missing(
        self,
        own: MapVersion | None,
        found: Iterable[AlignmentMessage],
        now: float,
        past: Iterable[MapVersion] = (),
        marks: Sequence[MapVersion] = (),
    ) -> Missing:
        """Return what those lack who have spoken since the last time.

        Parameters
        ----------
        own
            The state of this robot's map as published, None while there is none.
        found
            What this robot has published of each pair, the last of each.
        now
            [s] by any clock.
        past
            The maps of this robot's earlier runs, which coordinators should hold.
        marks
            The marks of this robot's runs, as published, likewise.
        """
        if not (self._coordinators or self._peers):
            return Missing()
        coordinators = {f"coordinator {b}": s.maps for b, s in self._coordinators.items()}
        held = coordinators | {f"{s.robot} {b}": s.holds for b, s in self._peers.items()}
        # All are asked, so that each one's time runs.
        sent = own is not None and self._had_time(MAP, now)
        lacks = [sent and self._lacks_map(who, m, own, now) for who, m in held.items() if own]
        alignments = {boot: _by_runs(status) for boot, status in self._coordinators.items()}
        missing = tuple(
            message
            for message in found
            if self._had_time(_pair_of(message), now)
            and self._lacks_alignments(message, alignments, now)
        )
        wanted = [
            run
            for run in past
            for who, m in coordinators.items()
            if self._lacks_map(f"{who} {run.boot}", m, run, now)
        ]
        unmarked = [
            run
            for run in marks
            for boot, status in self._coordinators.items()
            if self._lacks_map(f"marks {boot} {run.boot}", status.marks, run, now)
        ]
        self._coordinators.clear()
        self._peers.clear()
        runs, marked = (tuple(dict.fromkeys(those)) for those in (wanted, unmarked))
        return Missing(any(lacks), runs, missing, marked)

    def _had_time(self, what: str, now: float) -> bool:
        """Tell whether what was published has had time to arrive, and those who got it to say so.

        What was said before counts for nothing.
        """
        wait = GRACE if now - self._met < RETURN else ARRIVAL
        return now - self._published.get(what, -math.inf) >= wait

    def _lacks_map(self, who: str, held: Sequence[MapVersion], own: MapVersion, now: float) -> bool:
        mine = [version for version in held if version.robot == self._robot]
        newest = next((v.version for v in mine if v.boot == own.boot), None)
        lacks = newest is None or newest < own.version
        return self._lacking.due(f"map {who}", newest, now, lacks=lacks)

    def _lacks_alignments(
        self, message: AlignmentMessage, alignments: Mapping[str, _ByRuns], now: float
    ) -> bool:
        ours, pair = (message.reference, message.other), _pair_of(message)
        due = False
        for boot, by_runs in alignments.items():
            held = by_runs.get(frozenset(states_of(ours)))
            lacks = held is None or is_older(held, ours)
            due |= self._lacking.due(f"alignments {boot} {pair}", held, now, lacks=lacks)
        return due


def _pair_of(message: AlignmentMessage) -> str:
    return " ".join(f"{end.robot}@{end.boot}" for end in (message.reference, message.other))


def _by_runs(status: JointStatusMessage) -> _ByRuns:
    """Return of which states of two runs' maps a coordinator has alignments, as said first."""
    return {frozenset(states_of(ends)): ends for ends in reversed(status.alignments)}
