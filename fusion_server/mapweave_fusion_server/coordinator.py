"""What the team knows, and when it is worth a new version of the joint map.

Pure logic: no network, no clock (`now` is passed in), no threads. The caller runs the drafts.
"""

import math
from collections.abc import Iterator, Set
from dataclasses import replace
from typing import TypeAlias

from pydantic import BaseModel, ConfigDict, Field

from mapweave.maps import Alignment, JointMap, RobotMap, component_name, parse_component
from mapweave.team.rebase import Change, SubmapPlace, carry, places_of
from mapweave_fusion_server.draft import Draft, Urgency
from mapweave_fusion_server.said import Said
from mapweave_protocol.link.order_ledger import OrderLedger
from mapweave_protocol.wire.messages import (
    AlignmentMessage,
    MapVersion,
    MarksMessage,
    OrderMessage,
)
from mapweave_protocol.wire.model import MAX_ALIGNMENTS
from mapweave_protocol.wire.pairs import (
    Run,
    clash,
    is_older,
    name_with_boot,
    run_of,
    states_of,
    with_boots,
)
from mapweave_protocol.wire.status_message import MAX_PEERS

MAX_CHANGES = 1_000_000  # of the marks of a run
MAX_RUNS = 64  # of a robot: a new battery every hour for a week of days
REMEMBERED_STATES = 64  # of a robot's map: an alignment comes a few versions after what it is of


# A message, the maps that it is carried over to, and the alignments that come of it.
_CarriedOver: TypeAlias = tuple[AlignmentMessage, tuple[RobotMap, ...], tuple[Alignment, ...]]


class CoordinatorParameters(BaseModel):
    """How often versions are made, and of how large a team."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    min_interval: float = Field(default=1.0, ge=0, allow_inf_nan=False)
    """Least time between two versions [s] unless an alignment is joined or revoked: a person
    watching sees the map grow. Of a large team building takes longer; the next one waits."""

    max_robots: int = Field(default=64, ge=1)
    """Robots listened to; the largest teams of the DARPA Subterranean Challenge had a dozen."""


class Coordinator:
    """Takes maps and alignments; says what goes into the next version, and when.

    Parameters
    ----------
    parameters
        See there.
    last
        The last version, from which judging goes on; None before the first one, or where it is
        lost.
    number
        Of the last version, from which numbering goes on; that of `last` unless told.
    """

    def __init__(
        self,
        parameters: CoordinatorParameters,
        last: JointMap | None = None,
        number: int | None = None,
    ) -> None:
        self._parameters = parameters
        self._version = number if number is not None else last.version if last else 0
        self._judged = last.alignments if last else ()
        self._is_last_known = last is not None
        self._doubted: set[Run] = set()
        self._maps: dict[Run, RobotMap] = {}
        self._clashing: set[Run] = set()  # those that a robot's id does not tell apart
        self._states: dict[Run, dict[int, dict[int, SubmapPlace]]] = {}
        self._alignments: dict[frozenset[Run], AlignmentMessage] = {}
        self._carried: dict[frozenset[Run], _CarriedOver] = {}
        self._said = Said()
        self._urgency = Urgency.NONE
        self._draft: Draft | None = None
        self._drafted = Urgency.NONE
        self._has_another_map = False  # since the draft
        self._is_begun_anew = False  # the draft, after an awaited one was given up
        self._begun = self._drafted_at = -math.inf

    @property
    def has_news(self) -> bool:
        """Whether something that matters is in no draft yet."""
        return self._urgency > Urgency.NONE

    @property
    def has_version(self) -> bool:
        """Whether the last version is known, if there was one."""
        return self._version == 0 or self._is_last_known

    @property
    def is_pending(self) -> bool:
        """Whether something was received that is in no version yet."""
        return self.has_news or self._draft is not None

    @property
    def is_awaited(self) -> bool:
        """Whether the draft has something in it that was received, and not only compares more."""
        return self._drafted > Urgency.MORE

    def is_overtaken(self) -> bool:
        """Tell whether the draft should give way to another one; usable from another thread.

        One that only compares more keeps nobody waiting. One that is awaited is begun anew once,
        early, for a map that comes meanwhile: that waits for one version then and not for two.
        """
        if not self.is_awaited:
            return self._urgency > Urgency.MORE
        return self._has_another_map and not self._is_begun_anew

    @property
    def maps_held(self) -> tuple[MapVersion, ...]:
        """Which state of the map of each run of each robot is here."""
        return tuple(MapVersion.of(self._maps[run]) for run in sorted(self._maps))

    @property
    def maps(self) -> tuple[RobotMap, ...]:
        """The maps of all runs but those to be forgotten, with their marks.

        Each is named as the joint map names it.
        """
        maps = self._said.marked(self._shown_maps)
        return tuple(sorted(maps.values(), key=lambda m: (m.robot, min(m.components))))

    @property
    def _shown_maps(self) -> dict[Run, RobotMap]:
        maps = self._said.without_forgotten(self._maps)
        return {run: with_boots(m) if run in self._clashing else m for run, m in maps.items()}

    @property
    def marks_held(self) -> tuple[MapVersion, ...]:
        """Which version of the marks of each run is here."""
        return self._said.marks_held

    @property
    def orders(self) -> OrderLedger:
        """The orders of operators; to be given one, see `receive_order`."""
        return self._said.ledger

    @property
    def alignments_held(self) -> tuple[tuple[MapVersion, MapVersion], ...]:
        """Of which states of the maps the alignments of each pair are that are here."""
        return tuple((held.reference, held.other) for held in self._alignments.values())

    def map_of(self, robot: str) -> RobotMap | None:
        """Return the map of a robot's last run, None when there is none."""
        return max(self._runs_of(robot), key=lambda m: max(m.components), default=None)

    def version_of(self, robot: str, boot: str) -> int | None:
        """Return which version of the map of a run is here, None if none is."""
        held = self._maps.get((robot, boot))
        return None if held is None else held.version

    def clashes(self, new: RobotMap) -> bool:
        """Tell whether the run of a map that is held is named by its boot as well."""
        return run_of(new) in self._clashing

    def admits(self, robots: Set[str]) -> bool:
        """Return whether there is room for these robots; those count that have a map here."""
        return len({robot for robot, _ in self._maps} | robots) <= self._parameters.max_robots

    def has_maps_of(self, message: AlignmentMessage) -> bool:
        """Tell whether the maps that `message` is about are here, or soon may be."""
        for end in _ends(message):
            held = self.version_of(end.robot, end.boot)
            if held is None or end.version > held + REMEMBERED_STATES:
                return False
        return True

    def doubt(self, robot: str, boot: str) -> None:
        """Take the next map of a run whatever its version: the one here is not the robot's."""
        self._doubted.add((robot, boot))

    def receive_map(self, new: RobotMap) -> bool:
        """Take a robot's map; return whether it is news.

        Each run of a robot has its map, and none replaces another's. It is no news when it is no
        newer than the one known, or empty; nor when the robot has too many runs. Runs whose
        components have the same numbers are named by their boots from then on.
        """
        if not new.submaps or not self.admits({new.robot}):
            return False
        known = self._maps.get(run_of(new))
        if run_of(new) in self._doubted:
            self._replace_doubted(new)
        elif known is not None and known.version >= new.version:
            return False
        runs = len(self._runs_of(new.robot))
        if known is None and (runs >= MAX_RUNS or len(self._maps) >= MAX_PEERS):
            return False
        self._maps[run_of(new)] = new
        same = [run_of(held) for held in self._runs_of(new.robot) if clash(held, new)]
        self._clashing.update([*same, run_of(new)] if same else [])
        self._remember_state(new)
        self._has_another_map = True
        self._raise_urgency(Urgency.SOON)
        return True

    def receive_alignments(self, new: AlignmentMessage) -> bool:
        """Take what was found for a pair of robots; return whether it is news.

        It is not when what is known was computed from newer maps of the same runs or says the same.
        """
        if not self.admits(pair_of(new)):
            return False
        runs = frozenset(states_of(_ends(new)))
        known = self._alignments.get(runs)
        if known is None and len(self._alignments) >= MAX_ALIGNMENTS:
            return False
        if known is not None and is_older(_ends(new), _ends(known)):
            return False
        self._alignments[runs] = new
        if known is not None and new.alignments == known.alignments:
            return False
        joined_or_parted = _accepted_links(new) != _accepted_links(known)
        self._raise_urgency(Urgency.NOW if joined_or_parted else Urgency.SOON)
        return True

    def _replace_doubted(self, new: RobotMap) -> None:
        """Forget what was said of states of a run that it never was in."""
        run = run_of(new)
        self._doubted.discard(run)
        self._states.pop(run, None)
        for runs, message in list(self._alignments.items()):
            if states_of(_ends(message)).get(run, 0) > new.version:
                del self._alignments[runs]

    def holds(self, message: AlignmentMessage) -> bool:
        """Tell whether this is what is known of its pair of runs."""
        return self._alignments.get(frozenset(states_of(_ends(message)))) is message

    def receive_marks(self, new: MarksMessage) -> bool:
        """Take the marks that a run of a robot made; return whether they are news.

        They are once its map is here, on which they are.
        """
        if (new.robot, new.boot) not in self._maps or new.version > MAX_CHANGES:
            return False
        if not self._said.take_marks(new):
            return False
        self._raise_urgency(Urgency.NOW)
        return True

    def receive_order(self, new: OrderMessage) -> bool:
        """Take an operator's order; return whether it is news."""
        if not self._said.ledger.take(new):
            return False
        self._raise_urgency(Urgency.NOW)
        return True

    def forget_news(self) -> None:
        """Take what was received so far as part of the last version: after a restart."""
        self._urgency = Urgency.NONE

    def seconds_until_due(self, now: float) -> float:
        """Return how long to wait from `now` [s] before the next draft; infinite without news."""
        if self._draft is not None or not self.has_news:
            return math.inf
        if self._urgency is Urgency.NOW:
            return 0.0
        return max(0.0, self._begun + self._parameters.min_interval - now)

    def begin(self, now: float) -> Draft:
        """Return the draft of the next version, made of all that is known; `finish` must follow."""
        if self._draft is not None:
            raise RuntimeError("the last draft is not finished")
        alignments = tuple(self._alignments_in_force())
        orders = self._said.orders(self._maps, self._shown_maps)
        self._draft = Draft(self._version + 1, self.maps, alignments, self._judged, orders)
        self._drafted, self._urgency = self._urgency, Urgency.NONE
        self._has_another_map = False
        self._drafted_at = now
        return self._draft

    def finish(
        self, joint: JointMap | None, *, has_more: bool = False, has_failed: bool = False
    ) -> None:
        """End the draft that became `joint`; None, where it was not built, keeps its number.

        Where what is known `has_more` in it than was made of it, another version follows. What
        follows one that was given up is as urgent; what follows one that `has_failed` may fail as
        well, and keeps the interval.
        """
        self._raise_urgency(Urgency.MORE if has_more else Urgency.NONE)
        was_given_up = joint is None and not has_failed
        self._is_begun_anew = was_given_up and self.is_awaited
        if joint is None and self.has_news:
            self._raise_urgency(self._drafted if was_given_up else Urgency.SOON)
        if not was_given_up:
            self._begun = self._drafted_at
        if joint is not None:
            self._version, self._judged = joint.version, joint.alignments
            self._is_last_known = True
        self._draft, self._drafted = None, Urgency.NONE

    def _alignments_in_force(self) -> Iterator[Alignment]:
        """Yield the alignments between components that exist."""
        shown = self._shown_maps
        existing = {
            component_name(robot_map.robot, component)
            for robot_map in shown.values()
            for component in robot_map.components
        }
        for message in self._alignments.values():
            if shown.keys() >= states_of(_ends(message)).keys():
                for alignment in self._carried_over(message):
                    if {alignment.reference, alignment.other} <= existing:
                        yield alignment

    def _carried_over(self, message: AlignmentMessage) -> tuple[Alignment, ...]:
        """Return the alignments of `message` for the maps as they are; kept until these change."""
        runs = frozenset(states_of(_ends(message)))
        states = tuple(self._maps[run_of(end)] for end in _ends(message))
        kept = self._carried.get(runs)
        if kept is None or kept[:2] != (message, states) or not runs.isdisjoint(self._clashing):
            kept = message, states, tuple(self._carry(message))
            self._carried[runs] = kept
        return kept[2]

    def _carry(self, message: AlignmentMessage) -> Iterator[Alignment]:
        for alignment in message.unpack():
            ours, theirs = message.ends_of(alignment)
            carried = carry(alignment, self._change(ours), self._change(theirs))
            yield replace(
                carried,
                reference=self._shown(ours, alignment.reference),
                other=self._shown(theirs, alignment.other),
            )

    def _shown(self, end: MapVersion, component: str) -> str:
        """Return the name of a component in the joint map, whatever it was called by who found."""
        _, number = parse_component(component)
        run = run_of(end)
        return component_name(name_with_boot(run) if run in self._clashing else end.robot, number)

    def _runs_of(self, robot: str) -> list[RobotMap]:
        return [robot_map for run, robot_map in self._maps.items() if run[0] == robot]

    def _remember_state(self, robot_map: RobotMap) -> None:
        states = self._states.setdefault(run_of(robot_map), {})
        states[robot_map.version] = places_of(robot_map)
        while len(states) > REMEMBERED_STATES:
            del states[min(states)]

    def _change(self, source: MapVersion) -> Change:
        """Return what became of a map since the state `source`; nothing, if that is not known."""
        now = self._maps[run_of(source)]
        then = self._states[run_of(source)].get(source.version)
        return Change(places_of(now) if then is None else then, now)

    def _raise_urgency(self, urgency: Urgency) -> None:
        self._urgency = max(self._urgency, urgency)


def pair_of(message: AlignmentMessage) -> frozenset[str]:
    """Return the robots compared; one when a robot's own components were."""
    return frozenset({message.reference.robot, message.other.robot})


def _ends(message: AlignmentMessage) -> tuple[MapVersion, MapVersion]:
    return message.reference, message.other


def _accepted_links(message: AlignmentMessage | None) -> set[frozenset[str]]:
    alignments = message.alignments if message else ()
    return {frozenset({a.reference, a.other}) for a in alignments if a.decision == "accepted"}
