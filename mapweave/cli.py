"""The program ``mapweave``: finds subcommands by entry point, runs one, reports errors in a line.

Every installed package may contribute to the entry-point group ``mapweave.commands``; only the
subcommand asked for is imported: for the overview the summaries are read from the source, where
they stand as the first argument of ``command = Command("…", …)``.
"""

import argparse
import ast
import errno
import json
import math
import os
import re
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points, version
from importlib.util import find_spec
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, NoReturn, TypeVar

from mapweave.errors import MapweaveError
from mapweave.kernels.loading import missing

if TYPE_CHECKING:
    from mapweave.config import Config

T = TypeVar("T")

COMMAND_GROUP = "mapweave.commands"
EXIT_FAILED = 1
EXIT_USAGE = 2
EXIT_INTERRUPTED = 130
INTERRUPTED = "mapweave: interrupted"
STANDARD_ERROR = 2
NO_ROOM = {errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO}
_NEGATIVE_PLACE = re.compile(r"-[0-9.]+(,-?[0-9.]+)+")


@dataclass(frozen=True, slots=True)
class Command:
    """A subcommand.

    Attributes
    ----------
    summary
        One line for ``mapweave --help``.
    configure
        Adds the subcommand's arguments to its parser.
    run
        Does the work and returns the exit status.
    example
        A line of words after ``mapweave COMMAND`` that do something useful, for its ``--help``.
    """

    summary: str
    configure: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace], int]
    example: str = ""


def argument(parse: Callable[[str], T]) -> Callable[[str], T]:
    """Return `parse`, which raises ValueError, with its message as argparse shows it."""

    def parse_argument(text: str) -> T:
        try:
            return parse(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from error

    return parse_argument


def positive(text: str) -> float:
    """Return the number that `text` says, more than 0; ValueError otherwise."""
    value = float(text)
    if not 0 < value < math.inf:
        raise ValueError(f"{text}: expected a number, more than 0")
    return value


def not_negative(text: str) -> float:
    """Return the number that `text` says, 0 or more; ValueError otherwise."""
    value = float(text)
    if not 0 <= value < math.inf:
        raise ValueError(f"{text}: expected a number, 0 or more")
    return value


def whole(text: str) -> int:
    """Return the whole number that `text` says, 1 or more; ValueError otherwise."""
    if not text.isascii() or not text.isdigit() or not 0 < int(text[:18]) == int(text):
        raise ValueError(f"{text}: expected a whole number, 1 or more")
    return int(text)


def add_config_argument(parser: argparse.ArgumentParser) -> None:
    """Add ``--config``; read it with `config_of`."""
    parser.add_argument(
        "--config",
        metavar="FILE.toml",
        type=Path,
        help="sensor, robot and numbers of mapping; mapweave config shows them",
    )


def add_topic_argument(parser: argparse.ArgumentParser) -> None:
    """Add ``--topic``: which laser of a bag."""
    parser.add_argument(
        "--topic",
        metavar="TOPIC",
        help="the laser of a bag that has several, such as /scan, or lasers, such as /front+/rear",
    )


def add_json_argument(parser: argparse.ArgumentParser) -> None:
    """Add ``--json``: what is said is for a program; say it with `say`."""
    parser.add_argument("--json", action="store_true", help="say it as JSON, for a program")


def say(options: argparse.Namespace, content: object, lines: Iterable[str]) -> None:
    """Print `content` as a line of JSON where ``--json`` asks for it, and `lines` otherwise."""
    for line in [json.dumps(content, allow_nan=False)] if options.json else lines:
        print(line, flush=True)  # noqa: T201


def config_of(options: argparse.Namespace) -> "Config":
    """Return the configuration that ``--config`` and the environment make of the defaults.

    Raises
    ------
    ConfigError
        If there is something wrong with either.
    """
    from mapweave.config import Config  # --help need not load pydantic

    return Config.load(options.config, os.environ)


def _overview(points: Sequence[str]) -> str:
    commands = {point.name: point for point in entry_points(group=COMMAND_GROUP)}
    width = max(map(len, points))
    lines = [f"  {name:<{width}}  {summary_of(commands[name])}" for name in points]
    return "usage: mapweave COMMAND …\n\n" + "\n".join(
        [
            "Joint line maps of robot teams from raw 2D laser scans.",
            "",
            *lines,
            "",
            "mapweave COMMAND --help tells more; mapweave --version.",
        ]
    )


def summary_of(point: EntryPoint) -> str:
    """Return the summary of a subcommand, as its source states it; else import it and look.

    Only the packages around its module are imported.
    """
    spec = find_spec(point.module)
    source = Path(spec.origin) if spec is not None and spec.has_location and spec.origin else None
    if source is not None and source.suffix == ".py":
        for statement in ast.parse(source.read_bytes()).body:
            match statement:
                case ast.Assign(
                    targets=[ast.Name(id=name)],
                    value=ast.Call(args=[ast.Constant(value=str(summary)), *_]),
                ) if name == point.attr:
                    return summary
    command: Command = point.load()
    return command.summary


def parser_of(name: str, command: Command) -> argparse.ArgumentParser:
    """Return the parser of a subcommand: its help ends with an example."""
    prog = f"mapweave {name}"
    parser = argparse.ArgumentParser(
        prog=prog,
        description=command.summary,
        epilog=f"example: {prog} {command.example}".rstrip(),
    )
    command.configure(parser)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program and return its exit status: 0 done, 1 failed, 2 wrong usage."""
    return _report(list(sys.argv[1:] if arguments is None else arguments))


def _run(words: list[str]) -> int:
    _check_folder()
    points = {point.name: point for point in entry_points(group=COMMAND_GROUP)}
    if words and words[0] == "--version":
        print(f"mapweave {version('mapweave')}")  # noqa: T201
        return 0
    if not words or words[0] in ("-h", "--help"):
        print(_overview(sorted(points)), file=sys.stdout if words else sys.stderr)
        return 0 if words else EXIT_USAGE
    if words[0] not in points:
        known = ", ".join(sorted(points))
        print(f"mapweave: no command {words[0]!r}; there are {known}", file=sys.stderr)  # noqa: T201
        return EXIT_USAGE
    with _ended_at_once():
        command: Command = points[words[0]].load()
        parser = parser_of(words[0], command)
    options = parser.parse_args(_places_joined(words[1:]))
    if told := missing():
        print(f"mapweave: {told}", file=sys.stderr)  # noqa: T201
    return command.run(options)


def _places_joined(words: list[str]) -> list[str]:
    """Return `words`, a place such as -3.5,1 one word with its option: it looks like an option."""
    joined = list[str]()
    for word in words:
        if joined and joined[-1].startswith("--") and _NEGATIVE_PLACE.fullmatch(word):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


@contextmanager
def _ended_at_once() -> Iterator[None]:
    """Have Ctrl-C end the program while modules are loaded, and nothing is begun.

    Some that are compiled make errors of their own of the exception that it otherwise is.
    """
    before = signal.getsignal(signal.SIGINT)
    here = threading.current_thread() is threading.main_thread()
    if not here or before is not signal.default_int_handler:  # as where it is ignored
        yield
        return
    signal.signal(signal.SIGINT, _end)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _end(_number: int, _frame: FrameType | None) -> NoReturn:
    os.write(STANDARD_ERROR, f"{INTERRUPTED}\n".encode())
    os._exit(EXIT_INTERRUPTED)


def _check_folder() -> None:
    try:
        Path.cwd()
    except FileNotFoundError as error:
        problem = "the folder this runs in is gone; change to one that is there"
        raise MapweaveError(problem) from error


def _report(words: list[str]) -> int:
    """Run what `words` ask for; the one place where an error becomes a line and a status."""
    try:
        try:
            return _run(words)
        finally:
            sys.stdout.flush()  # in here, where it is no traceback that a reader has gone
    except MapweaveError as error:
        print(f"mapweave: {error}", file=sys.stderr)  # noqa: T201
        return EXIT_FAILED
    except MemoryError:
        print("mapweave: not enough memory for this input", file=sys.stderr)  # noqa: T201
        return EXIT_FAILED
    except KeyboardInterrupt:
        print(INTERRUPTED, file=sys.stderr)  # noqa: T201
        return EXIT_INTERRUPTED
    except BrokenPipeError:
        return _give_up_output()
    except OSError as error:
        if error.errno not in NO_ROOM:
            raise
        print(f"mapweave: cannot write ({error.strerror})", file=sys.stderr)  # noqa: T201
        return _give_up_output()


def _give_up_output() -> int:
    """Write no more: Python would complain again when flushing at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return EXIT_FAILED
