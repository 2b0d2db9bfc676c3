"""The wire: what the robots of a team send, against the same scans as occupancy grids."""

import argparse
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.console import Console

from benchmarks.logs import find_logs
from benchmarks.tables import OUTPUT, format_table, write_json
from mapweave_deploy.run.display import Lines
from mapweave_deploy.run.launcher import Plan, TeamOutcome, free_endpoint, run_team
from mapweave_deploy.run.occupancy import grid_bytes
from mapweave_deploy.run.processes import ProcessGroup
from mapweave_deploy.run.team_plan import Member, team_from_logs
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import MapMessage

HEAD = ["robot", "scans", "maps", "maps kB", "alignments kB", "status kB", "total kB"]
HEAD += ["map once kB", "grid once kB", "deflated kB"]


@dataclass(frozen=True, slots=True)
class Traffic:
    """What one robot sent.

    Attributes
    ----------
    scans, messages
        That it mapped, and in how many map messages it said so.
    maps, alignments, status
        All of each kind that it sent, from first to last [bytes].
    once
        Its last map as one complete message [bytes].
    grid, deflated
        The same scans as an occupancy grid, plain and compressed [bytes].
    """

    robot: str
    scans: int
    messages: int
    maps: int
    alignments: int
    status: int
    once: int
    grid: int
    deflated: int

    @property
    def total(self) -> int:
        """All kinds of messages together [bytes]."""
        return self.maps + self.alignments + self.status


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which log and how many robots."""
    parser.add_argument("--log", default="fr079", metavar="NAME", help="cut up (%(default)s)")
    parser.add_argument("--robots", type=int, default=3, metavar="N", help="in the team (3)")
    parser.add_argument("--rate", default="max", help="times real time, or max (the default)")
    parser.add_argument("--output", type=Path, default=OUTPUT / "wire.json", help="(%(default)s)")


def run(options: argparse.Namespace) -> None:
    """Run a team as processes, count its messages, print the table."""
    for log in find_logs([options.log]):
        members = team_from_logs([log.path], options.robots)
        outcome = _run_team(members, options.rate)
        rows = [_count(outcome, member) for member in members]
        print(tell(rows))
        write_json(options.output, [asdict(row) for row in rows])


def _run_team(members: list[Member], rate: str) -> TeamOutcome:
    with tempfile.TemporaryDirectory() as folder:
        store = Path(folder) / "store.sqlite"
        plan = Plan(
            "bench", members, rate, free_endpoint(), store, store.parent / "states", timeout=None
        )
        with ProcessGroup(Path(folder)) as crew:
            return run_team(crew, plan, Lines(Console()))


def _count(outcome: TeamOutcome, member: Member) -> Traffic:
    sent = outcome.recorder.sent(member.robot)
    plain, deflated = grid_bytes(member, outcome.maps[member.robot])
    return Traffic(
        member.robot,
        outcome.recorder.statuses[member.robot].scans_seen,
        sent["map"].messages,
        sent["map"].size,
        sent["alignment"].size,
        sent["status"].size,
        len(encode(MapMessage.pack(outcome.maps[member.robot]))),
        plain,
        deflated,
    )


def tell(rows: Sequence[Traffic]) -> str:
    """Return the table as text."""
    return "\n".join(
        [
            format_table(HEAD, [_row(row) for row in rows]),
            "All messages from first to last; the last map in one complete message; the scans as",
            "an occupancy grid with cells of 5 cm, once, plain and deflated by zlib at its best.",
        ]
    )


def _row(row: Traffic) -> list[str]:
    sizes = (row.maps, row.alignments, row.status, row.total, row.once, row.grid, row.deflated)
    counts = (str(row.scans), str(row.messages))
    return [row.robot, *counts, *(f"{size / 1000:.1f}" for size in sizes)]
