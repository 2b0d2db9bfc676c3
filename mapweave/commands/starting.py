"""``--continue`` and ``--localize``: what a run begins with."""

import argparse
from dataclasses import dataclass
from pathlib import Path

from mapweave.errors import FileError
from mapweave.mapping.localization.known_map import KnownMap
from mapweave.maps import RobotMap


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """A stored map, or nothing.

    Attributes
    ----------
    known
        A robot's map that the run goes on from.
    place
        A map in which the robot finds itself, and that stays as it is.
    """

    known: RobotMap | None = None
    place: KnownMap | None = None

    @property
    def submaps(self) -> int:
        """How many submaps are there before the first scan."""
        if self.place is not None:
            return len(self.place.submaps)
        return 0 if self.known is None else len(self.known.submaps)

    @classmethod
    def of(cls, options: argparse.Namespace) -> "Start":
        """Read what the options of `add_start_arguments` name.

        Raises
        ------
        FileError
            If a file is no such map, or one without walls.
        """
        if options.continued is None and options.localize is None:
            return cls()
        from mapweave.io.map_files import load, read_map  # loads what files are checked by

        if options.continued is not None:
            return cls(known=_with_walls(options.continued, read_map(options.continued)))
        place = KnownMap.of(load(options.localize))
        if not any(len(lines.segments) for lines in place.components.values()):
            raise _no_walls(options.localize)
        return cls(place=place)


def add_start_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the two; read them with `Start.of`."""
    starts = parser.add_mutually_exclusive_group()
    starts.add_argument(
        "--continue",
        dest="continued",
        metavar="MAP.json",
        type=Path,
        help="go on from a stored map of a robot, which this run is joined to by shape",
    )
    starts.add_argument(
        "--localize",
        metavar="MAP.json|JOINT.json",
        type=Path,
        help="find the robot in a stored map, follow it there, and leave the map as it is",
    )


def _with_walls(path: Path, known: RobotMap) -> RobotMap:
    if not any(len(submap.map.segments) for submap in known.submaps):
        raise _no_walls(path)
    return known


def _no_walls(path: Path) -> FileError:
    return FileError(path, "has no walls; expected a map of the place where the robot is")
