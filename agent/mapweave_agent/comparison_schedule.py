"""Which pair of maps to compare next; no clock and no network in here."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import TypeAlias

from mapweave.maps import Alignment, RobotMap
from mapweave.matching.encounters import Encounters
from mapweave.team.hysteresis import joins
from mapweave_agent.comparing.team_maps import JoinedRuns, TeamMaps
from mapweave_agent.publication_schedule import AgentParameters
from mapweave_protocol.link.lacking import Lacking
from mapweave_protocol.wire.messages import (
    AlignmentMessage,
    Compared,
    JointStatusMessage,
    MapVersion,
)
from mapweave_protocol.wire.pairs import Run, is_older, ordered, responsible, run_of, states_of

PairOfRuns: TypeAlias = frozenset[Run]

LOOKED_UP_AT_ONCE = 4  # submaps, some 4 ms each: scans wait meanwhile


@dataclass(frozen=True, slots=True)
class Comparison:
    """Two runs' maps to compare; `reference` is of the robot of the smaller id."""

    peer: str
    reference: RobotMap
    other: RobotMap


@dataclass
class _Pair:
    """What is known of two runs.

    Attributes
    ----------
    compared
        Of which states of their maps an alignment was published last, by whomever.
    published
        The same, by us.
    met
        Whether their maps were joined once, by whomever.
    learned
        What another one found out last.
    rests_until
        While they still map, the pair is not compared before.
    waits_since
        When it was due and others may have gone first; None while it is not.
    """

    compared: tuple[MapVersion, MapVersion] | None = None
    published: Compared | None = None
    met: bool = False
    learned: AlignmentMessage | None = None
    rests_until: float = field(default=0.0)
    waits_since: float | None = None


class ComparisonSchedule:
    """Which pair to compare next: always of the newest maps, and in the end of the last ones.

    Maps of runs that are over never change: each is compared with what may show its place until
    the joint map has it there. Those whose shapes say that they saw one place come first; of the
    others, only those of small teams are compared at all.

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
        self._alone = False  # whether nobody else has our map
        self._earlier: dict[str, RobotMap] = {}  # this robot's runs before, by boot
        self._team = TeamMaps()
        self._joined = JoinedRuns()
        self._wanted: list[MapVersion] = []
        self._lacking = Lacking()
        self._pairs: dict[PairOfRuns, _Pair] = {}
        self._encounters = Encounters()
        self._quiet_until = -math.inf

    def own_map(self, robot_map: RobotMap, *, finished: bool) -> None:
        """Take in this robot's map as published; `finished` says that it is the last."""
        self._own = robot_map
        self._own_finished = finished
        self._encounters.take(robot_map)
        self._wake()

    def follow_in(self, known: RobotMap) -> None:
        """Compare a stored `known` map in place of this robot's own; nobody else can."""
        self._alone = True
        self.own_map(known, finished=False)

    def earlier_map(self, robot_map: RobotMap) -> None:
        """Take in the map of a run of this robot before this one: it is compared as a peer's."""
        self._earlier[robot_map.boot] = robot_map
        self._wake()

    def peer_map(self, robot_map: RobotMap) -> None:
        """Take in the map of a run of a peer, or of another process with this robot's id."""
        if robot_map.robot != self._robot or robot_map.boot not in self._own_boots:
            self._team.take(robot_map)
            self._encounters.take(robot_map)
            self._wake()

    @property
    def team(self) -> TeamMaps:
        """The maps of the others."""
        return self._team

    def peer_finished(self, robot: str, boot: str, version: int) -> None:
        """Note that the map of that version is the last of a run."""
        self._team.note_last(robot, boot, version)
        self._wake()

    def peer_here(self, robot: str, boot: str) -> None:
        """Note that a run of a peer is alive."""
        self._team.here(robot, boot)
        self._wake()

    def peer_gone(self, robot: str, boot: str) -> None:
        """Note that a run of a peer is no longer alive: its duties fall to us."""
        self._team.left(robot, boot)
        self._wake()

    def coordinator(self, status: JointStatusMessage) -> None:
        """Take in which pairs' alignments a coordinator holds, and which runs it has joined."""
        self._joined.take(status)
        others = [state for state in status.maps if run_of(state) not in self._own_runs]
        for state in others:
            self._team.note_map_of(state.robot)
        self._wanted = [state for state in others if self._team.is_gone(state.robot)]
        for ends in status.alignments:
            self._note_compared(ends)
        self._wake()

    def to_ask_for(self, now: float) -> list[MapVersion]:
        """Return which maps to ask a coordinator for at `now` [s]: their robots are gone."""
        return [
            state
            for state in self._wanted
            if self._lacking.due(str(run_of(state)), state, now, lacks=not self._team.holds(state))
        ]

    def learned(self, message: AlignmentMessage) -> None:
        """Take in what another found out about a pair: we need not do it again."""
        self._note_compared((message.reference, message.other))
        pair = self._pair(message.reference, message.other)
        pair.met |= joins(message.unpack())
        pair.learned = message
        self._wake()

    def begin(self, now: float) -> Comparison | None:
        """Return the next comparison, None if none is due.

        Those of runs that are over come last: what they are like does not change. Before them, and
        of each kind, those come first whose shapes speak for it; of several the one due longest.
        As long as submaps wait to be looked up, what shapes speak for is not known: ask again.
        """
        if self._own is None or now < self._quiet_until:
            return None
        self._encounters.catch_up(LOOKED_UP_AT_ONCE)
        if self._encounters.is_behind:
            return None
        ours = [(self._is_over(*pair), self._pair(*pair).rests_until, pair) for pair in self._ours]
        due = [(over, since, pair) for over, since, pair in ours if self._due(pair, since, now)]
        if not due:
            self._quiet_until = min((since for _, since, _ in ours), default=math.inf)
            return None
        ranked = [(over, self._lets_others_go(*pair, now), since) for over, since, pair in due]
        own, other = due[ranked.index(min(ranked))][2]
        first, _ = ordered(own.robot, other.robot)
        return Comparison(other.robot, *((own, other) if own.robot == first else (other, own)))

    def have_met(self, comparison: Comparison) -> bool:
        """Tell whether the two runs that `comparison` is of were joined once."""
        return self._pair(comparison.reference, comparison.other).met

    def is_final(self, comparison: Comparison) -> bool:
        """Tell whether both maps are the last ones of their robots."""
        return all(self._is_last(end) for end in (comparison.reference, comparison.other))

    def done(
        self, comparison: Comparison, now: float, took: float, found: Sequence[Alignment] = ()
    ) -> None:
        """Note that `comparison` has taken `took` [s], and what was `found` and published."""
        ends = comparison.reference, comparison.other
        own, other = ends if run_of(ends[0]) in self._own_runs else ends[::-1]
        pair = self._pair(own, other)
        pair.compared = MapVersion.of(own), MapVersion.of(other)
        pair.published = Compared(
            own_version=own.version, peer_boot=other.boot, peer_version=other.version
        )
        pair.met |= joins(found)
        pair.learned = None
        rest = max(self._parameters.comparison_interval, took * self._parameters.comparison_rest)
        pair.rests_until, pair.waits_since = now + rest, None
        self._wake()

    @property
    def orphans(self) -> Iterator[AlignmentMessage]:
        """What robots that are gone have found, in this robot's name: it may be all there is."""
        for pair in self._pairs.values():
            if pair.learned is not None and self._team.is_gone(pair.learned.robot):
                yield pair.learned.model_copy(update={"robot": self._robot})

    @property
    def published(self) -> Mapping[str, Compared]:
        """By peer, the versions we compared last of this run and the peer's newest."""
        if self._own is None:
            return {}
        return {m.robot: told for m in self._team.newest if (told := self._told(self._own, m))}

    def _told(self, own: RobotMap, other: RobotMap) -> Compared | None:
        """Return which versions of two maps we compared last, or need not compare."""
        if _is_path(other):
            return Compared(
                own_version=own.version, peer_boot=other.boot, peer_version=other.version
            )
        pair = self._pairs.get(_key(own, other))
        return None if pair is None else pair.published

    @property
    def held(self) -> tuple[MapVersion, ...]:
        """Which state of the map of each run that is alive, or was the last to be, is here."""
        return tuple(MapVersion.of(robot_map) for robot_map in self._team.current)

    @property
    def idle(self) -> bool:
        """Whether nothing is left for us to compare, unless something new arrives."""
        return self._own is None or next(self._ours, None) is None

    @property
    def _own_boots(self) -> set[str]:
        return {boot for _, boot in self._own_runs}

    @property
    def _own_runs(self) -> set[Run]:
        runs = {run_of(robot_map) for robot_map in self._earlier.values()}
        return runs if self._own is None else runs | {run_of(self._own)}

    @property
    def _ours(self) -> Iterator[tuple[RobotMap, RobotMap]]:
        """Yield the pairs that are to be compared by us, a map of ours first."""
        assert self._own is not None  # asked before
        own = [self._own, *self._earlier.values()]
        others = list(self._team.all)
        every = len(others) <= self._parameters.strangers
        for ours, other in [*combinations(own, 2), *((a, b) for a in own for b in others)]:
            if not self._outdated(ours, other) or not self._duty(ours, other):
                continue
            if _is_path(ours) or _is_path(other):
                continue
            if every or self._likely(ours, other):
                yield ours, other

    def _outdated(self, own: RobotMap, other: RobotMap) -> bool:
        """Tell whether the newest maps have not been compared."""
        pair = self._pairs.get(_key(own, other))
        now = {run_of(own): own.version, run_of(other): other.version}
        return pair is None or pair.compared is None or states_of(pair.compared) != now

    def _duty(self, own: RobotMap, other: RobotMap) -> bool:
        """Tell whether it is for us to compare two maps."""
        if self._is_over(own, other) and self._joined.tells(own, other):
            return False
        if own is not self._own or other.boot in self._earlier or self._alone:
            return True  # runs of ours that are over are nobody else's business
        gone = self._team.is_gone(other.robot)
        if other.robot == self._robot:
            return gone or own.boot < other.boot
        # Whoever is here compares the runs that it has behind it.
        over = self._team.is_over(other)
        return gone or (not over and responsible(self._robot, other.robot) == self._robot)

    def _is_over(self, own: RobotMap, other: RobotMap) -> bool:
        """Tell whether one of the two is of a run that another one has followed."""
        return own is not self._own or other.boot in self._earlier or self._team.is_over(other)

    def _is_last(self, robot_map: RobotMap) -> bool:
        """Tell whether a map is the last of its run."""
        if run_of(robot_map) in self._own_runs:
            return self._own_finished or robot_map.boot in self._earlier
        return self._team.is_last(robot_map)

    def _due(self, pair: tuple[RobotMap, RobotMap], rests_until: float, now: float) -> bool:
        own, other = pair
        ours_last = self._own_finished or own is not self._own
        both_last = ours_last and (other.boot in self._earlier or self._team.is_last(other))
        return both_last or now >= rests_until

    def _lets_others_go(self, own: RobotMap, other: RobotMap, now: float) -> bool:
        """Tell whether a pair that is due waits as long as there are others."""
        pair = self._pair(own, other)
        if pair.waits_since is None:
            pair.waits_since = now
        patient = now - pair.waits_since < self._parameters.comparison_patience
        return patient and not self._likely(own, other)

    def _likely(self, own: RobotMap, other: RobotMap) -> bool:
        """Tell whether shapes say that two runs saw one place; of runs that are over, not asked."""
        return own is not self._own or self._encounters.likely(run_of(own), run_of(other))

    def _note_compared(self, ends: tuple[MapVersion, MapVersion]) -> None:
        pair = self._pair(*ends)
        if pair.compared is None or not (ends == pair.compared or is_older(ends, pair.compared)):
            pair.compared = ends

    def _pair(self, one: RobotMap | MapVersion, another: RobotMap | MapVersion) -> _Pair:
        return self._pairs.setdefault(_key(one, another), _Pair())

    def _wake(self) -> None:
        self._quiet_until = -math.inf


def _is_path(robot_map: RobotMap) -> bool:
    """Tell whether a map is a path without walls: of a robot that follows in a stored map."""
    driven = any(len(submap.trajectory.pose) for submap in robot_map.submaps)
    return driven and not any(len(submap.map.segments) for submap in robot_map.submaps)


def _key(one: RobotMap | MapVersion, another: RobotMap | MapVersion) -> PairOfRuns:
    return frozenset({run_of(one), run_of(another)})
