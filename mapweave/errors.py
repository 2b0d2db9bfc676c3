"""What can go wrong, as exceptions that carry data; the command line turns them into one line."""

from collections.abc import Sequence
from pathlib import Path


class MapweaveError(Exception):
    """Base of every error that mapweave raises on purpose; its text is one line for a person."""


class FileError(MapweaveError):
    """A file that cannot be used.

    Parameters
    ----------
    path
        The file.
    problem
        What is wrong with it, and what was expected.
    """

    def __init__(self, path: str | Path, problem: str) -> None:
        super().__init__(f"{path}: {problem}")
        self.path = Path(path)
        self.problem = problem


def _quoted(name: object) -> str:
    """Return `name`, which may be of anybody and of any length, in quotation marks."""
    return repr(name[:64] + "…" if isinstance(name, str) and len(name) > 64 else name)


ID_IN_WORDS = (
    "1 to 32 characters, lower-case letters, digits, '_' or '-', the first a letter or digit"
)


class InvalidIdError(MapweaveError):
    """A robot or team name that is not ``[a-z0-9][a-z0-9_-]{0,31}``."""

    def __init__(self, kind: str, name: str) -> None:
        super().__init__(f"{kind} {_quoted(name)}: expected {ID_IN_WORDS}")
        self.kind = kind
        self.name = name


class InvalidComponentError(MapweaveError):
    """A name that is not of a robot's component."""

    def __init__(self, name: str) -> None:
        super().__init__(
            f"component {_quoted(name)}: expected a robot's id and a number, such as 'a/0'"
        )
        self.name = name


class MissingExtraError(MapweaveError):
    """An optional package that the asked-for output needs."""

    def __init__(self, need: str, extra: str) -> None:
        super().__init__(f"{need} needs an optional package: pip install 'mapweave[{extra}]'")
        self.extra = extra


class UnknownSourceError(MapweaveError):
    """A source of scans that neither is a file nor has a scheme that a package knows.

    Parameters
    ----------
    name, scheme
        What was asked for, and what stands before its colon.
    known
        The schemes that installed packages bring.
    """

    def __init__(self, name: str, scheme: str, known: Sequence[str]) -> None:
        there = f"those known are {', '.join(known)}" if known else "no package here brings one"
        super().__init__(
            f"source {name!r}: no such file, and no scheme {scheme!r}; {there}; expected a file,"
            " - for standard input, or SCHEME:..."
        )
        self.name = name
        self.scheme = scheme


class UnusableOdometryError(MapweaveError):
    """Odometry of a ROS 2 network, for scans that are not of one.

    Parameters
    ----------
    source, odometry
        What was asked for.
    """

    def __init__(self, source: str, odometry: str) -> None:
        super().__init__(
            f"odometry {odometry!r}: goes with scans of the same network, and these are of"
            f" {source!r}; expected --source ros2:..., or --odometry prior"
        )
        self.source = source
        self.odometry = odometry


class ArgumentError(MapweaveError, ValueError):
    """An argument that cannot be used.

    Parameters
    ----------
    argument
        Its name.
    problem
        What was expected, and what was given.
    """

    def __init__(self, argument: str, problem: str) -> None:
        super().__init__(f"{argument}: {problem}")
        self.argument = argument
        self.problem = problem


class FinishedError(MapweaveError):
    """A scan for a map that was finished before."""

    def __init__(self, robot: str) -> None:
        super().__init__(
            f"the map of robot {robot!r} is finished and takes no more scans; expected a new Mapper"
        )
        self.robot = robot


class ConfigError(MapweaveError):
    """A configuration that cannot be used.

    Parameters
    ----------
    origin
        The file or the variable that says so; empty where a program does.
    field
        Such as ``sensor.range_sigma``; empty where it is the file as a whole.
    problem
        What is wrong with it, and what was expected.
    """

    def __init__(self, origin: str, field: str, problem: str) -> None:
        super().__init__(": ".join(part for part in (origin, field, problem) if part))
        self.origin = origin
        self.field = field
        self.problem = problem
