"""The wire: what the robots of a team send, against the same scans as occupancy grids."""

import argparse
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.console import Console

from mapweave_deploy.crew import Crew
from mapweave_deploy.display import Lines
from mapweave_deploy.launcher import Outcome, Plan, free_endpoint, run_team
from mapweave_deploy.occupancy import grid_bytes
from mapweave_deploy.roster import Member, team_from_logs
from tests.benchmarks.logs import find_logs
from tests.benchmarks.tables import OUTPUT, format_table, write_json

HEAD = ["robot", "scans", "map kB", "alignments kB", "status kB", "total kB", "B/scan"]
HEAD += ["grid kB", "deflated kB", "grid/total", "deflated/total"]


@dataclass(frozen=True, slots=True)
class Traffic:
    """What one robot sent in all, and its scans as a grid, sent once [bytes]."""

    robot: str
    scans: int
    maps: int
    alignments: int
    status: int
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


def _run_team(members: list[Member], rate: str) -> Outcome:
    with tempfile.TemporaryDirectory() as folder:
        store = Path(folder) / "store.sqlite"
        plan = Plan("bench", members, rate, free_endpoint(), store, timeout=None)
        with Crew(Path(folder)) as crew, Lines(Console()) as display:
            return run_team(crew, plan, display)


def _count(outcome: Outcome, member: Member) -> Traffic:
    sent = outcome.recorder.sent(member.robot)
    plain, deflated = grid_bytes(member, outcome.maps[member.robot])
    return Traffic(
        member.robot,
        outcome.recorder.statuses[member.robot].scans_seen,
        sent["map"].size,
        sent["alignment"].size,
        sent["status"].size,
        plain,
        deflated,
    )


def tell(rows: Sequence[Traffic]) -> str:
    """Return the table as text."""
    return "\n".join(
        [
            format_table(HEAD, [_row(row) for row in rows]),
            "grid: the same scans as an occupancy grid with cells of 5 cm, sent once;"
            " deflated: the same, compressed by zlib at its best. The messages are all that the"
            " robot published from first to last.",
        ]
    )


def _row(row: Traffic) -> list[str]:
    sizes = (row.maps, row.alignments, row.status, row.total)
    return [
        row.robot,
        str(row.scans),
        *(f"{size / 1000:.1f}" for size in sizes),
        f"{row.total / row.scans:.0f}",
        f"{row.grid / 1000:.0f}",
        f"{row.deflated / 1000:.1f}",
        f"{row.grid / row.total:.1f}",
        f"{row.deflated / row.total:.2f}",
    ]
