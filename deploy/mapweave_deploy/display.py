"""What a person sees while a team runs: bars at a terminal, plain lines elsewhere."""

from collections.abc import Mapping
from types import TracebackType
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn
from rich.text import Text

from mapweave_deploy.roster import Member
from mapweave_protocol.messages import StatusMessage


class Display(Protocol):
    """Shows a team's progress; a context manager."""

    def say(self, line: str) -> None:
        """Show a line of what happens."""

    def update(self, statuses: Mapping[str, StatusMessage]) -> None:
        """Show how far each robot is."""

    def __enter__(self) -> "Display":
        """Begin to show."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Leave the terminal as it should be."""


class Lines:
    """Plain lines: for logs and pipes."""

    def __init__(self, console: Console) -> None:
        self._console = console

    def say(self, line: str) -> None:
        """Show a line of what happens."""
        self._console.print(Text(line), soft_wrap=True)

    def update(self, statuses: Mapping[str, StatusMessage]) -> None:
        """Show nothing: the lines tell when a robot has finished."""

    def __enter__(self) -> "Lines":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        pass


class Bars:
    """A bar for each robot, the lines above them."""

    def __init__(self, console: Console, members: list[Member]) -> None:
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.fields[state]}"),
            TimeElapsedColumn(),
            console=console,
        )
        self._tasks: dict[str, TaskID] = {
            member.robot: self._progress.add_task(
                member.robot, total=member.scans[1] - member.scans[0], state="starting"
            )
            for member in members
        }

    def say(self, line: str) -> None:
        """Show a line of what happens."""
        self._progress.console.print(Text(line))

    def update(self, statuses: Mapping[str, StatusMessage]) -> None:
        """Show how far each robot is."""
        for robot, task in self._tasks.items():
            status = statuses.get(robot)
            if status is not None:
                self._progress.update(task, completed=status.scans_seen, state=_words(status))

    def __enter__(self) -> "Bars":
        self._progress.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._progress.stop()


def _words(status: StatusMessage) -> str:
    return f"{status.scans_placed} placed, {status.submaps} submaps, {status.state}"


def make_display(console: Console, members: list[Member]) -> Display:
    """Return what suits the console."""
    return Bars(console, members) if console.is_terminal else Lines(console)
