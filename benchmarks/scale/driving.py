"""A team drives on a virtual clock: what it sends, and which maps its index has it compare.

Every robot takes in every other one's messages, and all hold the same index: what one of them pays
for that is measured once.
"""

import heapq
import time
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

from benchmarks.scale.members import Member
from mapweave.commands.progress import track
from mapweave.matching.encounters import Encounters
from mapweave_agent.publication_schedule import AgentParameters
from mapweave_protocol.link.assembler import MapAssembler, MapSender
from mapweave_protocol.wire.codec import decode
from mapweave_protocol.wire.messages import MapMessage
from mapweave_protocol.wire.pairs import responsible, run_of

Pair = tuple[int, int]  # places in the team, the smaller one first


@dataclass
class Costs:
    """Processor time by what it was spent on [s], and how often that was done."""

    seconds: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))
    count: Counter[str] = field(default_factory=Counter)

    @contextmanager
    def of(self, what: str) -> Iterator[None]:
        """Count what is done within."""
        start = time.process_time()
        yield
        self.add(what, time.process_time() - start)

    def add(self, what: str, seconds: float) -> None:
        """Count what was done once, and took so long."""
        self.seconds[what] += seconds
        self.count[what] += 1

    def mean(self, what: str) -> float:
        """[s] of one."""
        return self.seconds[what] / max(self.count[what], 1)


@dataclass
class Driven:
    """What came of it.

    Attributes
    ----------
    sent
        [bytes] of maps, by place in the team.
    messages
        Of maps, likewise.
    due
        How often each pair was to be compared, as its maps grew, of those the index proposes.
    comparer
        Who did, likewise.
    """

    sent: Counter[int] = field(default_factory=Counter)
    messages: Counter[int] = field(default_factory=Counter)
    due: Counter[Pair] = field(default_factory=Counter)
    comparer: dict[Pair, int] = field(default_factory=dict)


def drive(team: Sequence[Member], costs: Costs) -> Driven:
    """Let a team drive: a map is published whenever a submap is finished, and all take it in.

    A pair that shapes speak for is compared when one of its maps is news, but not sooner than a
    robot does so.
    """
    driven, encounters, assembler = Driven(), Encounters(), MapAssembler()
    senders = [MapSender() for _ in team]
    rest = AgentParameters().comparison_interval
    rests: dict[Pair, float] = {}
    places = {run_of(member.robot_map): place for place, member in enumerate(team)}
    for now, place, count in track(_events(team), "driving"):
        with costs.of("a map coded"):
            payload = senders[place].payload(team[place].at(count))
        driven.sent[place] += len(payload)
        driven.messages[place] += 1
        with costs.of("a map taken in"):
            robot_map = assembler.update(decode(MapMessage, payload))
        assert robot_map is not None  # nothing is lost
        with costs.of("its submap looked up"):
            encounters.take(robot_map)
            encounters.catch_up()
        for run in encounters.likely_of(run_of(robot_map)):
            pair = min(place, places[run]), max(place, places[run])
            if now >= rests.get(pair, 0.0):
                driven.due[pair] += 1
                rests[pair] = now + rest
    for first, second in driven.due:
        names = team[first].robot_map.robot, team[second].robot_map.robot
        driven.comparer[first, second] = first if responsible(*names) == names[0] else second
    return driven


def _events(team: Sequence[Member]) -> list[tuple[float, int, int]]:
    """Return when which robot has finished how many submaps, in order."""
    each = (
        [(float(at), place, k + 1) for k, at in enumerate(member.finished)]
        for place, member in enumerate(team)
    )
    return list(heapq.merge(*each))
