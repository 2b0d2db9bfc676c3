"""What a person sees while a team runs: bars at a terminal, plain lines elsewhere."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn
from rich.text import Text

from mapweave.text import counted
from mapweave_deploy.run.team_plan import Member
from mapweave_protocol.wire.messages import StatusMessage


class Display(Protocol):
    """Shows a team's progress."""

    def say(self, line: str) -> None:
        """Show a line of what happens."""

    def update(self, statuses: Mapping[str, StatusMessage]) -> None:
        """Show how far each robot is."""


class Lines:
    """Plain lines: for logs and pipes."""

    def __init__(self, console: Console) -> None:
        self._console = console

    def say(self, line: str) -> None:
        """Show a line of what happens."""
        self._console.print(Text(line), soft_wrap=True)

    def update(self, statuses: Mapping[str, StatusMessage]) -> None:
        """Show nothing: the lines tell when a robot has finished."""


class Bars:
    """A bar for each robot, the lines above them."""

    def __init__(self, progress: Progress, members: list[Member]) -> None:
        self._progress = progress
        self._tasks: dict[str, TaskID] = {
            member.robot: self._progress.add_task(
                member.robot, total=member.scans[1] - member.scans[0], state="starting"
            )
            for member in members
        }

    def say(self, line: str) -> None:
        """Show a line of what happens."""
        self._progress.console.print(Text(line), soft_wrap=True)

    def update(self, statuses: Mapping[str, StatusMessage]) -> None:
        """Show how far each robot is."""
        for robot, task in self._tasks.items():
            status = statuses.get(robot)
            if status is not None:
                self._progress.update(task, completed=status.scans_seen, state=_words(status))


def _words(status: StatusMessage) -> str:
    return f"{status.scans_placed} placed, {counted(status.submaps, 'submap')}, {status.state}"


@contextmanager
def open_display(console: Console, members: list[Member]) -> Iterator[Display]:
    """Give what suits the console; the terminal is left as it should be."""
    if not console.is_terminal:
        yield Lines(console)
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[state]}"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console) as progress:
        yield Bars(progress, members)
