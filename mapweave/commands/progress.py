"""A progress bar on standard error, for a person at a terminal; nothing otherwise."""

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeRemainingColumn,
)

Item = TypeVar("Item")


def track(items: Iterable[Item], description: str, total: int | None = None) -> Iterator[Item]:
    """Yield `items` while a bar shows how many are done; the bar goes when they are.

    Parameters
    ----------
    items
        What to work through.
    description
        What is being done, such as ``mapping``.
    total
        How many there will be; taken from `items` when it knows, and left open otherwise.
    """
    if not sys.stderr.isatty():
        yield from items
        return
    with _bar() as progress:
        yield from progress.track(items, total=total, description=description)


@contextmanager
def busy(description: str) -> Iterator[None]:
    """Show that something is being done of which nobody knows how long it takes."""
    if not sys.stderr.isatty():
        yield
        return
    # What is printed meanwhile is left alone.
    spinner = Progress(
        SpinnerColumn(),
        TextColumn("{task.description}"),
        console=Console(stderr=True),
        transient=True,
        redirect_stdout=False,
    )
    with spinner:
        spinner.add_task(description, total=None)
        yield


def _bar() -> Progress:
    return Progress(
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        transient=True,
    )
