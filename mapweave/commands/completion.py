"""``mapweave completion``: what has a shell complete commands, options and files."""

import argparse
from importlib.metadata import entry_points
from pathlib import Path

from mapweave.cli import COMMAND_GROUP, Command, parser_of
from mapweave.errors import MissingExtraError

SHELLS = ("bash", "zsh", "tcsh")
FILES = {"log", "source", "first", "others", "map"}
"""Arguments that are files among other things, and so are no paths to argparse."""


def _configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("shell", choices=SHELLS, metavar="SHELL", help=", ".join(SHELLS))


def _run(options: argparse.Namespace) -> int:
    """Print a script: it needs neither Python nor mapweave when a key is pressed."""
    try:
        import shtab
    except ImportError as error:
        raise MissingExtraError("shell completion", "completion") from error
    parser = argparse.ArgumentParser(prog="mapweave")
    parser.add_argument("--version", action="store_true", help="print the version")
    commands = parser.add_subparsers()
    for point in sorted(entry_points(group=COMMAND_GROUP), key=lambda point: point.name):
        command: Command = point.load()
        own = parser_of(point.name, command)
        for action in own._actions:
            if action.type is Path or action.dest in FILES:
                action.complete = shtab.FILE  # type: ignore[attr-defined] # as shtab wants it
        commands.add_parser(point.name, parents=[own], help=command.summary, add_help=False)
    print(shtab.complete(parser, options.shell))  # noqa: T201
    return 0


command = Command("Print what has a shell complete commands and options.", _configure, _run, "bash")
