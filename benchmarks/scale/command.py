"""Scale: a team of a hundred robots and more on a virtual clock: who compares what, what it costs.

Robots of recordings, each stretch as one, and of buildings made up; real messages, no network. Maps
and what was compared are kept, and a run goes on where the one before ended.
"""

import argparse
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
import scipy

from benchmarks.logs import find_logs
from benchmarks.scale.driving import Costs, Driven, Pair, drive
from benchmarks.scale.members import Member, is_joined_right, made_up, recorded
from benchmarks.scale.remembered import compare_remembered
from benchmarks.tables import OUTPUT, format_table, write_json
from mapweave.commands.progress import track
from mapweave.fusion.align import FusionParameters
from mapweave.maps import Alignment
from mapweave.team.joint_builder import JointMapBuilder
from mapweave.text import percent
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import AlignmentMessage, MapVersion

MOST_VERIFIED, MOST_LOST = 0.02, 0.01  # of the pairs of submaps; of the true joins
DRAWN = 20  # times that pairs are drawn in the place of what shapes propose
FRAME = 50  # [bytes] that Zenoh adds to a message


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say how many robots in how many buildings, and of which recordings."""
    parser.add_argument("--robots", type=int, default=100, metavar="N", help="in all (100)")
    parser.add_argument("--buildings", type=int, default=10, metavar="N", help="in all (10)")
    parser.add_argument("--logs", nargs="+", metavar="NAME", help="which logs (default all)")
    parser.add_argument(
        "--stretches", type=int, nargs="+", default=[8], metavar="N", help="a log is cut into (8)"
    )
    parser.add_argument(
        "--no-compare",
        dest="compare",
        action="store_false",
        help="only drive: nothing is compared or built, and no joins are counted",
    )
    parser.add_argument("--output", type=Path, default=OUTPUT / "scale.json", help="%(default)s")


@dataclass(frozen=True)
class Joins:
    """What came of comparing maps.

    Attributes
    ----------
    true
        Pairs within a building that are joined when they are compared, not wrongly.
    found
        Those of them that the index proposes.
    wrong
        Names of the pairs joined wrongly.
    unknown
        Pairs of two recordings of one building that are joined: no truth tells.
    alignments
        Of what the index proposes.
    sent
        [bytes] of these, as messages.
    """

    true: tuple[Pair, ...]
    found: tuple[Pair, ...]
    wrong: tuple[str, ...]
    unknown: int
    alignments: tuple[Alignment, ...]
    sent: int


NOTHING = Joins((), (), (), 0, (), 0)


def run(options: argparse.Namespace) -> None:
    """Let the team drive, compare, print the table; exit with 1 where a figure falls short."""
    team = list(recorded(find_logs(options.logs), options.stretches))[: options.robots]
    known = len({member.building for member in team})
    missing = options.buildings - known, options.robots - len(team)
    if min(missing) > 0:
        team += made_up(*missing)
    costs = Costs()
    driven = drive(team, costs)
    joins = compare_all(team, driven, costs) if options.compare else NOTHING
    version = _build(team, joins, costs) if options.compare else "not built"
    rows = figures(team, driven, joins)
    print(_tell_team(team, known), tell(rows), _tell_costs(team, driven, joins, costs), sep="\n")
    print(f"A version of all of it: {version}")
    print("\n".join(["Wrong joins:", *joins.wrong]) if joins.wrong else "Wrong joins: none")
    means = {what: costs.mean(what) for what in costs.count}
    write_json(options.output, {"figures": [asdict(r) for r in rows], "mean_seconds": means})
    if joins.wrong or any(row.short for row in rows):
        raise SystemExit(1)


@dataclass(frozen=True)
class Figure:
    """A share that is measured, and what it may be at the most, where that is a bar."""

    what: str
    count: int
    of: int
    most: float | None = None

    @property
    def short(self) -> bool:
        """Whether it is missed."""
        return self.most is not None and self.count > self.most * self.of


def compare_all(team: Sequence[Member], driven: Driven, costs: Costs) -> Joins:
    """Compare the pairs that the index proposes, and, uncounted, all others within a building.

    Between buildings nothing is lost: there is nothing to join.
    """
    p = FusionParameters()
    within = {
        (a, b) for a, b in combinations(range(len(team)), 2) if team[a].building == team[b].building
    }
    true, found, wrong, unknown = list[Pair](), list[Pair](), list[str](), 0
    alignments, sent = list[Alignment](), 0
    for pair in track(sorted(within | set(driven.due)), "comparing"):
        one, other = team[pair[0]], team[pair[1]]
        proposed = pair in driven.due
        compared = compare_remembered(one.robot_map, other.robot_map, p)
        what = "a pair compared" if proposed else "a pair that is not proposed"
        costs.add(what, compared.seconds)
        each = compared.alignments
        joined = [a for a in each if a.decision == "accepted"]
        right = [is_joined_right(one, other, a) for a in joined]
        if proposed:
            alignments += each
            sent += FRAME + len(encode(_message(one, other, each)))
        if any(r is False for r in right):
            wrong.append(f"{one.robot_map.robot} - {other.robot_map.robot}: {joined[0].reason}")
        elif joined:
            unknown += None in right
            true.append(pair)
            found += [pair] if proposed else []
    return Joins(tuple(true), tuple(found), tuple(wrong), unknown, tuple(alignments), sent)


def _message(one: Member, other: Member, found: Sequence[Alignment]) -> AlignmentMessage:
    ends = MapVersion.of(one.robot_map), MapVersion.of(other.robot_map)
    return AlignmentMessage.pack(one.robot_map.robot, *ends, found)


def _build(team: Sequence[Member], joins: Joins, costs: Costs) -> str:
    """Build what a coordinator does, twice: the second time, one robot's map is news."""
    builder, maps = JointMapBuilder(), [member.robot_map for member in team]
    with costs.of("a first version of all"):
        builder.build([*maps[1:], team[0].at(1)], joins.alignments, 1)
    start = time.process_time()
    with costs.of("the version after it"):
        joint = builder.build(maps, joins.alignments, 2)
    together = sorted((len(c.robots) for c in joint.components), reverse=True)
    return f"{time.process_time() - start:.1f} s; robots together: {together[:12]}"


def figures(team: Sequence[Member], driven: Driven, joins: Joins) -> list[Figure]:
    """Return what is measured against the bars."""
    sizes = np.array([len(member.robot_map.submaps) for member in team])
    submaps = int((sizes.sum() ** 2 - (sizes**2).sum()) // 2)
    robots = len(team) * (len(team) - 1) // 2
    every, some = (_groups(len(team), pairs) for pairs in (joins.true, joins.found))
    lost, apart = lost_by_chance(len(team), len(driven.due), joins.true)
    return [
        Figure("pairs compared, of the pairs of submaps", len(driven.due), submaps, MOST_VERIFIED),
        Figure("pairs compared, of the pairs of robots", len(driven.due), robots),
        Figure("joins not found, as two others tell", some - every, len(joins.true), MOST_LOST),
        Figure("joins not found between two robots", _lost(joins), len(joins.true)),
        Figure("the same, as many pairs drawn: no shapes, that cost", lost, len(joins.true)),
        Figure("and as two others tell", apart, len(joins.true)),
    ]


def lost_by_chance(robots: int, compared: int, true: Sequence[Pair]) -> tuple[int, int]:
    """Return how many joins are not found when as many pairs are drawn as shapes propose.

    Between two robots, and as two others tell; the mean of what is drawn many times.
    """
    pairs = list(combinations(range(robots), 2))
    rng, lost = np.random.default_rng(1), list[tuple[int, int]]()
    for _ in range(DRAWN):
        drawn = {pairs[k] for k in rng.choice(len(pairs), min(compared, len(pairs)), replace=False)}
        found = [pair for pair in true if pair in drawn]
        lost.append((len(true) - len(found), _groups(robots, found) - _groups(robots, true)))
    between, apart = np.mean(lost, axis=0)
    return round(float(between)), round(float(apart))


def _lost(joins: Joins) -> int:
    return len(joins.true) - len(joins.found)


def _groups(count: int, pairs: Sequence[Pair]) -> int:
    """How many groups the robots are in that pairs hold together."""
    i, j = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    graph = scipy.sparse.coo_array((np.ones(len(i)), (i, j)), (count, count))
    return int(scipy.sparse.csgraph.connected_components(graph, directed=False)[0])


def tell(rows: Sequence[Figure]) -> str:
    """Return the table of the figures."""
    head = ["figure", "count", "of", "share", "at most", ""]
    cells = [
        [r.what, str(r.count), str(r.of), f"{r.count / max(r.of, 1):.2%}", *_against(r)]
        for r in rows
    ]
    return format_table(head, cells)


def _against(row: Figure) -> tuple[str, str]:
    return ("-", "") if row.most is None else (percent(row.most), "short" if row.short else "")


def _tell_team(team: Sequence[Member], known: int) -> str:
    drawn = sum(member.stretch is None for member in team)
    submaps = sum(len(member.robot_map.submaps) for member in team)
    buildings = len({member.building for member in team})
    return (
        f"{len(team)} robots, {submaps} submaps, {buildings} buildings;"
        f" {drawn} robots in {buildings - known} buildings are made up"
    )


def _tell_costs(team: Sequence[Member], driven: Driven, joins: Joins, costs: Costs) -> str:
    """Return what a robot sends, takes in and pays for, and a coordinator."""
    n, messages, sent = len(team), driven.messages.total(), driven.sent.total()
    took, looked = (costs.seconds[k] for k in ("a map taken in", "its submap looked up"))
    duty = np.zeros(n)
    for pair, times in driven.due.items():
        duty[driven.comparer[pair]] += times * costs.mean("a pair compared")
    rows = [
        ["map messages of a robot", f"{messages / n:.1f}"],
        ["their bytes, a robot", f"{sent / n:.0f}"],
        ["bytes of alignments, a robot", f"{joins.sent / n:.0f}"],
        ["bytes a robot hears, the others' maps", f"{(sent + FRAME * messages) * (n - 1) / n:.0f}"],
        ["s of processor, a robot, taking in the others' maps", f"{took * (n - 1) / n:.2f}"],
        ["the same, looking up submaps", f"{looked:.2f}"],
        ["ms a submap of that", f"{1000 * looked / max(messages, 1):.2f}"],
        [
            "s of processor, a robot, comparing, mean and most",
            f"{duty.mean():.2f} {duty.max():.2f}",
        ],
        ["ms a pair compared", f"{1000 * costs.mean('a pair compared'):.1f}"],
        ["s of processor, coordinator, taking in all maps", f"{took:.2f}"],
        ["s, its first version of all", f"{costs.seconds['a first version of all']:.2f}"],
        ["s, the version after it", f"{costs.seconds['the version after it']:.2f}"],
        ["pairs joined where no truth tells", str(joins.unknown)],
    ]
    return format_table(["what it costs", ""], rows)
